// See trace.h. A block is: stride, then the numbers of its points.
#include "server/chains/trace.h"

#include <stdexcept>

#include "sampler/bytes.h"

namespace retake {

Trace::Trace(const std::vector<Measure>& measures) {
  for (std::size_t i = 0; i < measures.size(); ++i)
    if (measures[i].list.empty()) traced_.push_back(i);
  width_ = kFixedColumns + traced_.size();
}

Trace::Trace(const std::vector<Measure>& measures, const std::vector<std::string>& blocks) : Trace(measures) {
  try {
    for (const std::string& block : blocks) {
      ByteReader in(block);
      stride_ = in.get<std::uint64_t>();
      std::vector<double> numbers;
      in.get_numbers(numbers);
      if (stride_ == 0 || numbers.size() % width_ != 0 || !in.at_end())
        throw std::out_of_range("wrong width");
      values_.insert(values_.end(), numbers.begin(), numbers.end());
    }
  } catch (const std::out_of_range& fault) {
    throw std::runtime_error(std::string("chain trace cannot be read: ") + fault.what());
  }
  taken_ = values_.size();
  if (!values_.empty()) next_ = static_cast<std::uint64_t>(values_[values_.size() - width_]) + stride_;
}

void Trace::append(const Chain& chain) {
  if (size() == kMostPoints) {
    // Keep the points that the doubled stride would have recorded.
    stride_ *= 2;
    std::vector<double> kept;
    kept.reserve(kMostPoints * width_);
    for (std::size_t row = 0; row < values_.size(); row += width_)
      if (static_cast<std::uint64_t>(values_[row]) % stride_ == 0)
        kept.insert(kept.end(), values_.begin() + static_cast<std::ptrdiff_t>(row),
                    values_.begin() + static_cast<std::ptrdiff_t>(row + width_));
    values_ = std::move(kept);
    taken_ = 0;
    replace_ = true;
    if (next_ % stride_ != 0) {
      next_ += stride_ / 2;
      return;
    }
  }
  next_ += stride_;
  const Stay& stay = chain.stay();
  values_.insert(values_.end(), {static_cast<double>(chain.counts().iteration), stay.log_prior,
                                 stay.score.log_constraint, stay.score.satisfied ? 1.0 : 0.0});
  for (const std::size_t measure : traced_)
    values_.push_back(stay.score.measures[measure]);
}

Trace::Block Trace::take_block() {
  Block block;
  if (taken_ == values_.size() && !replace_) return block;
  ByteWriter out;
  out.put(stride_);
  out.put_numbers(values_.data() + taken_, values_.size() - taken_);
  block = {.bytes = out.take(), .replace = replace_};
  taken_ = values_.size();
  replace_ = false;
  return block;
}

Trace::Point Trace::point(std::size_t index) const {
  const double* row = values_.data() + index * width_;
  return {.iteration = static_cast<std::uint64_t>(row[0]),
          .log_prior = row[1],
          .log_constraint = row[2],
          .satisfied = row[3] != 0,
          .measures = row + kFixedColumns};
}

}  // namespace retake
