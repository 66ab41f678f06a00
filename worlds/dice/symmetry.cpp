// See symmetry.h.
#include "worlds/dice/symmetry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "sampler/check.h"
#include "sampler/roulette.h"

namespace retake::dice {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// (along, across) of a direction: turns `vector` by the angle of `heading`, a unit vector.
Vector2d turned(const Vector2d& vector, const Vector2d& heading) {
  return {heading.x() * vector.x() - heading.y() * vector.y(),
          heading.y() * vector.x() + heading.x() * vector.y()};
}
Vector2d turned_back(const Vector2d& vector, const Vector2d& heading) {
  return turned(vector, {heading.x(), -heading.y()});
}
Vector2d mirror(const Vector2d& displacement, bool mirrored) {
  return {displacement.x(), mirrored ? -displacement.y() : displacement.y()};
}

/// The same horizontal speed, bit for bit, in another direction: then nothing of the motion changes. What
/// rounding makes of it is put right in the last places.
Vector2d velocity_of(double speed, const Vector2d& direction) {
  constexpr int kReach = 16;  // chosen: few directions need half as many
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  // Steps that move the square of the speed by a quarter of its last place, if they can.
  const auto step = [&](double value) {
    const double least = kEpsilon * std::abs(value), most = 1e-12 * speed;
    return std::clamp(kEpsilon * speed * speed / (8 * std::abs(value)), least, std::max(least, most));
  };
  const Vector2d plain = speed * direction, steps(step(plain.x()), step(plain.y()));
  for (int reach = 0; reach <= kReach; ++reach)
    for (int i = -reach; i <= reach; ++i)
      for (int j = -reach; j <= reach; ++j) {
        const Vector2d velocity(plain.x() + i * steps.x(), plain.y() + j * steps.y());
        if (std::sqrt(velocity.x() * velocity.x() + velocity.y() * velocity.y()) == speed) return velocity;
      }
  return plain;  // simulated anew, then
}

double log_sum(double a, double b) {
  const double most = std::max(a, b);
  return most + std::log(std::exp(a - most) + std::exp(b - most));
}

/// What a throw's heading is, given its start's distance from the target: von Mises again.
struct HeadingPosterior {
  double mean, concentration;
};

}  // namespace

double log_scaled_bessel_i0(double x) {
  constexpr double kLarge = 50;  // beyond it three terms of the asymptotic series are exact to 1e-7
  if (x < kLarge) return std::log(std::cyl_bessel_i(0.0, x)) - x;
  const double y = 1 / (8 * x);
  return std::log(1 + y * (1 + y * (4.5 + y * 37.5))) - 0.5 * std::log(2 * kPi * x);
}

double draw_von_mises(double mean, double concentration, RandomStream& random) {
  if (concentration < 1e-6) return mean + kPi * (2 * random.uniform() - 1);
  // Densities then agree to 1e-9, and what follows has no digits left.
  if (concentration > 1e8) return mean + random.gaussian() / std::sqrt(concentration);
  const double tau = 1 + std::sqrt(1 + 4 * concentration * concentration);
  const double rho = (tau - std::sqrt(2 * tau)) / (2 * concentration);
  const double r = (1 + rho * rho) / (2 * rho);
  for (;;) {
    const double z = std::cos(kPi * random.uniform());
    const double f = (1 + r * z) / (r + z), c = concentration * (r - f);
    const double u = random.uniform();
    if (c * (2 - c) > u || std::log(c / u) + 1 >= c) {
      const double angle = std::acos(std::clamp(f, -1.0, 1.0));
      return mean + (random.bernoulli(0.5) ? angle : -angle);
    }
  }
}

Symmetry::Symmetry(std::shared_ptr<const DiceModel> model, const EndWish& wish, const EndMeasures& measures)
    : model_(std::move(model)), wish_(wish), measures_(measures) {
  CHECK(model_->settings().dice == 1 && model_->settings().pose == GridPose::random);
  if (wish_.place) {
    most_log_weight_ += most_log_weight_of_place();
    for (std::size_t look = 0; look < kLooks; ++look)
      most_log_promise_[look] = most_log_promise(look);
  }
  if (wish_.face && model_->settings().random_paint) most_log_weight_ -= std::log(6);
}

double Symmetry::concentration(double speed) const {
  const double spread = model_->settings().speed_spread;
  return model_->settings().speed * speed / (spread * spread);
}

Vector2d Symmetry::displacement(const State& state, const Score& score) const {
  const std::size_t start = model_->start_x(0), velocity = model_->velocity_x(0);
  const Vector2d moved(score.measures[measures_.rest_x] - at(state, start),
                       score.measures[measures_.rest_z] - at(state, start + 2));
  const Vector2d heading = Vector2d(at(state, velocity), at(state, velocity + 2)).normalized();
  return mirror(turned_back(moved, heading), at(state, model_->mirrored()) == 1);
}

namespace {

/// The heading's prior is von Mises about x, and its likelihood too: the start, Gaussian about the origin, is
/// the target less the displacement turned by the heading.
HeadingPosterior posterior(double prior_concentration, const Vector2d& displacement, const Vector2d& target,
                           double start_spread) {
  const double strength = displacement.norm() * target.norm() / (start_spread * start_spread);
  const double angle = std::atan2(target.y(), target.x()) - std::atan2(displacement.y(), displacement.x());
  const Vector2d sum(prior_concentration + strength * std::cos(angle), strength * std::sin(angle));
  return {.mean = std::atan2(sum.y(), sum.x()), .concentration = sum.norm()};
}

/// log of the density of ending at the target, per area [1/m2], with heading and start integrated out.
double log_density(double prior_concentration, const Vector2d& displacement, const Vector2d& target,
                   double start_spread) {
  const HeadingPosterior heading = posterior(prior_concentration, displacement, target, start_spread);
  const double variance = start_spread * start_spread;
  return -std::log(2 * kPi * variance) -
         (displacement.squaredNorm() + target.squaredNorm()) / (2 * variance) + heading.concentration +
         log_scaled_bessel_i0(heading.concentration) - prior_concentration -
         log_scaled_bessel_i0(prior_concentration);
}

/// The largest value of a function with one hump on [low, high], looked for ever closer until points lie
/// `fine` apart; at most 170 values are looked at, whatever the numbers.
template <typename Function>
double largest_on(double low, double high, double fine, const Function& function) {
  constexpr int kPoints = 12, kRounds = 13;  // each narrows to a sixth
  double most = -std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    const double step = (high - low) / kPoints;
    double best = low;
    for (int i = 0; i <= kPoints; ++i) {
      const double at = low + i * step, value = function(at);
      if (value <= most) continue;
      most = value;
      best = at;
    }
    if (!(step > fine)) break;
    low = std::max(low, best - step);
    high = std::min(high, best + step);
  }
  return most;
}

/// The largest log_density of a displacement and its mirror image together, over all displacements. None is
/// longer than the way to the target: a longer one is farther from it in every direction.
double most_log_density(double prior_concentration, const Vector2d& target, double start_spread) {
  constexpr double kFine = 0.05;  // deviations; then the largest is known to 0.002
  const double distance = target.norm(), direction = std::abs(std::atan2(target.y(), target.x()));
  const Vector2d above(target.x(), std::abs(target.y()));
  const auto at_angle = [&](double angle) {
    return largest_on(0, distance, kFine * start_spread, [&](double length) {
      const Vector2d displacement(length * std::cos(angle), length * std::sin(angle));
      return log_sum(log_density(prior_concentration, displacement, above, start_spread),
                     log_density(prior_concentration, mirror(displacement, true), above, start_spread));
    });
  };
  // One of the two is largest along the target, and where they overlap both along x, forwards or back.
  const double sharpness = prior_concentration + distance * distance / (start_spread * start_spread);
  const double fine = kFine / std::sqrt(1 + sharpness);
  return std::max({at_angle(direction), largest_on(0, direction, fine, at_angle),
                   largest_on(direction, kPi, fine, at_angle)});
}

}  // namespace

double Symmetry::survival(std::size_t look, std::span<const double> features) const {
  return survival_of_promise(log_promise(look, {features[0], features[1]}) - most_log_promise_[look]);
}

double Symmetry::log_promise(std::size_t look, const Vector2d& rest) const {
  const DiceSettings& settings = model_->settings();
  const double spread = std::hypot(settings.start_spread, look_times(settings)[look].spread);
  const double prior = concentration(settings.speed);
  const Vector2d target(wish_.place->x, wish_.place->z);
  return log_sum(log_density(prior, rest, target, spread),
                 log_density(prior, mirror(rest, true), target, spread));
}

double Symmetry::most_log_promise(std::size_t look) const {
  const DiceSettings& settings = model_->settings();
  const double spread = std::hypot(settings.start_spread, look_times(settings)[look].spread);
  return most_log_density(concentration(settings.speed), {wish_.place->x, wish_.place->z}, spread);
}

double Symmetry::log_weight_of_place(double speed, const Vector2d& displacement,
                                     const Vector2d& target) const {
  const double spread = model_->settings().start_spread, prior = concentration(speed);
  const double area = kPi * wish_.place->radius * wish_.place->radius;
  return std::log(0.5 * area) + log_sum(log_density(prior, displacement, target, spread),
                                        log_density(prior, mirror(displacement, true), target, spread));
}

double Symmetry::place(const State& drawn, const Score& score, State& candidate, RandomStream& random) const {
  double log_weight = 0;
  if (wish_.place) log_weight += place_die(drawn, score, candidate, random);
  if (wish_.face && model_->settings().random_paint) log_weight += paint_die(drawn, score, candidate, random);
  return log_weight;
}

double Symmetry::place_die(const State& drawn, const Score& score, State& candidate,
                           RandomStream& random) const {
  // Where in the disc it is to end.
  const double radius = wish_.place->radius * std::sqrt(random.uniform());
  const double angle = 2 * kPi * random.uniform();
  const Vector2d target(wish_.place->x + radius * std::cos(angle), wish_.place->z + radius * std::sin(angle));

  // Handedness, heading and start, in this order.
  const Vector2d moved = displacement(drawn, score);
  const std::size_t start = model_->start_x(0), velocity = model_->velocity_x(0);
  const double vx = at(drawn, velocity), vz = at(drawn, velocity + 2), speed = std::sqrt(vx * vx + vz * vz);
  const double spread = model_->settings().start_spread, prior = concentration(speed);
  const double plain = log_density(prior, moved, target, spread);
  const double mirrored = log_density(prior, mirror(moved, true), target, spread);
  const bool is_mirrored = random.bernoulli(1 / (1 + std::exp(plain - mirrored)));
  const Vector2d along = mirror(moved, is_mirrored);
  const HeadingPosterior heading = posterior(prior, along, target, spread);
  const double direction = draw_von_mises(heading.mean, heading.concentration, random);
  const Vector2d flight = velocity_of(speed, {std::cos(direction), std::sin(direction)});
  const Vector2d from = target - turned(along, flight.normalized());
  at(candidate, model_->mirrored()) = is_mirrored ? 1 : 0;
  at(candidate, velocity) = flight.x();
  at(candidate, velocity + 2) = flight.y();
  at(candidate, start) = from.x();
  at(candidate, start + 2) = from.y();
  return log_weight_of_place(speed, moved, target);
}

/// One of the four paints by which the face that is up shows what is wished; one that is no face is left.
double Symmetry::paint_die(const State& drawn, const Score& score, State& candidate,
                           RandomStream& random) const {
  const double up = score.measures[measures_.top_face];
  if (std::isnan(up)) return 0;
  const auto painted = std::min(static_cast<std::size_t>(at(drawn, model_->paint(0))), kPaints - 1);
  const bool is_mirrored = at(drawn, model_->mirrored()) != at(candidate, model_->mirrored());
  const auto fitting = paints_that_show(*wish_.face, painted, static_cast<int>(up), is_mirrored);
  at(candidate, model_->paint(0)) =
      static_cast<double>(fitting[random.index(fitting.size())]) + random.uniform();
  return -std::log(6);
}

double Symmetry::most_log_weight_of_place() const {
  // Over displacements of every length and angle, and targets nearest and farthest in the disc.
  const DiceSettings& settings = model_->settings();
  const Vector2d centre(wish_.place->x, wish_.place->z);
  const double speed = settings.speed + 5 * settings.speed_spread, radius = wish_.place->radius;
  const double distance = centre.norm();
  double most = -std::numeric_limits<double>::infinity();
  for (const double r : {std::max(distance - radius, 0.0), distance, distance + radius}) {
    const Vector2d target = distance > 0 ? Vector2d(centre * (r / distance)) : Vector2d(r, 0);
    most = std::max(most, most_log_density(concentration(speed), target, settings.start_spread));
  }
  return std::log(0.5 * kPi * radius * radius) + most + 0.002;  // between the points that were looked at
}

}  // namespace retake::dice
