// Trace: how a chain went, in a bounded number of evenly spaced iterations; figures 2, 6 and 7 of the paper.
// When it is full, every second point is dropped and the stride doubles, so the points depend on the chain
// alone. It must not know the store, which keeps its blocks as bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sampler/chain.h"
#include "worlds/measure.h"

namespace retake {

class Trace {
 public:
  static constexpr std::size_t kMostPoints = 2048;

  /// Of the measures that a Score has. Members of lists are left out: they are many, and no curves.
  explicit Trace(const std::vector<Measure>& measures);
  /// Restores a trace from its blocks in order. Throws: std::runtime_error if they are damaged.
  Trace(const std::vector<Measure>& measures, const std::vector<std::string>& blocks);

  /// Records where the chain stands, if its iteration is a multiple of the stride.
  void record(const Chain& chain) {
    if (chain.counts().iteration == next_) append(chain);
  }

  struct Block {
    std::string bytes;     ///< empty: nothing new
    bool replace = false;  ///< the block takes the place of all earlier ones
  };
  /// What was recorded since the last call.
  Block take_block();

  struct Point {
    std::uint64_t iteration;
    double log_prior;
    double log_constraint;
    bool satisfied;
    const double* measures;  ///< those that are in no list
  };
  std::size_t size() const { return values_.size() / width_; }
  Point point(std::size_t index) const;

 private:
  static constexpr std::size_t kFixedColumns = 4;  // iteration, log_prior, log_constraint, satisfied
  void append(const Chain& chain);

  std::vector<std::size_t> traced_;  ///< which of Score::measures
  std::size_t width_;
  std::uint64_t stride_ = 1;
  std::uint64_t next_ = 1;  ///< the multiple of the stride that is recorded next
  std::vector<double> values_;
  std::size_t taken_ = 0;  ///< numbers of values_ that earlier blocks hold
  bool replace_ = false;
};

}  // namespace retake
