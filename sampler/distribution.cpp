// See distribution.h.
#include "sampler/distribution.h"

#include <cmath>
#include <numbers>

#include "sampler/check.h"

namespace retake {

Distribution Distribution::uniform(double low, double high) {
  CHECK(low < high, low, high);
  return {Kind::uniform, low, high, -std::log(high - low), 0};
}

Distribution Distribution::gaussian(double mean, double standard_deviation) {
  CHECK(standard_deviation > 0, standard_deviation);
  return {Kind::gaussian, mean, standard_deviation,
          -std::log(standard_deviation) - 0.5 * std::log(2 * std::numbers::pi), 0};
}

Distribution Distribution::on_off(double probability) {
  CHECK(probability > 0 && probability < 1, probability);
  return {Kind::on_off, probability, 0, std::log(probability), std::log1p(-probability)};
}

double Distribution::mean() const {
  return kind_ == Kind::uniform ? 0.5 * (first_ + second_) : first_;
}

double Distribution::standard_deviation() const {
  switch (kind_) {
    case Kind::uniform:
      return (second_ - first_) / std::sqrt(12.0);
    case Kind::gaussian:
      return second_;
    case Kind::on_off:
      return std::sqrt(first_ * (1 - first_));
  }
  return 0;
}

double Distribution::wrap(double value) const {
  if (kind_ != Kind::uniform || (value >= first_ && value <= second_)) return value;
  const double width = second_ - first_;
  const double turns = std::floor((value - first_) / width);
  const double wrapped = value - turns * width;
  return wrapped < first_ ? first_ : wrapped > second_ ? second_ : wrapped;
}

}  // namespace retake
