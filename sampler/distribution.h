// Distribution: the prior of one Variable, which draws and gives its log density.
// Paper, section 3.1. Draw and density are one object, so that they cannot disagree.
#pragma once

#include "sampler/random.h"

namespace retake {

/// Uniform on [low, high], Gaussian with mean and standard deviation, or a Switch that is 1 with a
/// probability, else 0.
class Distribution {
 public:
  enum class Kind { uniform, gaussian, on_off };

  /// Requires: low < high.
  static Distribution uniform(double low, double high);
  /// Requires: standard_deviation > 0.
  static Distribution gaussian(double mean, double standard_deviation);
  /// Requires: 0 < probability < 1.
  static Distribution on_off(double probability);

  Kind kind() const { return kind_; }
  double low() const { return first_; }    ///< of a uniform
  double high() const { return second_; }  ///< of a uniform
  double mean() const;
  double standard_deviation() const;

  double draw(RandomStream& random) const {
    switch (kind_) {
      case Kind::uniform:
        return first_ + (second_ - first_) * random.uniform();
      case Kind::gaussian:
        return first_ + second_ * random.gaussian();
      case Kind::on_off:
        return random.bernoulli(first_) ? 1.0 : 0.0;
    }
    return 0;
  }

  /// Normalised; minus infinity outside the support.
  double log_density(double value) const {
    switch (kind_) {
      case Kind::uniform:
        return value >= first_ && value <= second_ ? log_scale_ : kImpossible;
      case Kind::gaussian: {
        const double z = (value - first_) / second_;
        return log_scale_ - 0.5 * z * z;
      }
      case Kind::on_off:
        return value == 1 ? log_scale_ : value == 0 ? log_off_ : kImpossible;
    }
    return kImpossible;
  }

  /// Brings a value that left a uniform's range back in at the other end; others are returned as they are.
  double wrap(double value) const;

 private:
  static constexpr double kImpossible = -__builtin_huge_val();
  Distribution(Kind kind, double first, double second, double log_scale, double log_off)
      : kind_(kind), first_(first), second_(second), log_scale_(log_scale), log_off_(log_off) {}

  Kind kind_;
  double first_;      ///< low, mean or probability
  double second_;     ///< high or standard deviation
  double log_scale_;  ///< log of the normalising factor, or of the probability of 1
  double log_off_;    ///< log of the probability of 0
};

}  // namespace retake
