// ColumnGrid: bodies by upright columns of space, to find those near a place. doc/design.md, section 4.
// It must not know what bodies are.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace retake::impulse {

/// A hash table of columns as wide as two spheres. Thread safety: one thread at a time.
class ColumnGrid {
 public:
  /// Requires: a positive width [m].
  explicit ColumnGrid(double width);
  /// Empties it, and makes room for about so many bodies.
  void clear(std::size_t bodies);
  /// Enters a body in every column that an upright box touches.
  void insert(std::uint32_t body, const Eigen::Vector3d& low, const Eigen::Vector3d& high);
  /// Calls for every body whose box the column of a place touches, and perhaps for others, in no
  /// particular order; for some more than once.
  template <typename Call>
  void for_each(const Eigen::Vector3d& place, const Call& call) const {
    for (std::int32_t at = heads_[bucket(column(place.x()), column(place.z()))]; at >= 0;) {
      const Entry& entry = entries_[static_cast<std::size_t>(at)];
      call(entry.body);
      at = entry.next;
    }
  }

 private:
  struct Entry {
    std::uint32_t body;
    std::int32_t next;
  };
  std::int64_t column(double along) const;
  std::size_t bucket(std::int64_t x, std::int64_t z) const;

  double per_metre_;
  std::vector<std::int32_t> heads_;  ///< of lists in entries_, -1 for none; a power of two
  std::vector<Entry> entries_;
};

}  // namespace retake::impulse
