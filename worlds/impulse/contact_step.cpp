// See contact_step.h.
#include "worlds/impulse/contact_step.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace retake::impulse {
namespace {

using Eigen::Vector3d;

// A solid sphere of mass 1 and radius r has the moment of inertia 2/5 r^2: an impulse at its surface turns it
// by 5/2 / r, and moves the point where it acts by 1 + 5/2.
constexpr double kTurning = 2.5;
constexpr double kTangential = 3.5;

/// Slows a rotation down by at most `change` [rad/s].
void slow_down(Vector3d& angular_velocity, double change) {
  const double speed = angular_velocity.norm();
  if (speed > change)
    angular_velocity -= change / speed * angular_velocity;
  else
    angular_velocity.setZero();
}

}  // namespace

ContactStep::ContactStep(const Settings& settings)
    : settings_(settings),
      rest_speed_squared_(settings.rest_speed * settings.rest_speed),
      rest_steps_(settings.rest_steps()) {}

void ContactStep::clear() {
  outcomes_.clear();
  contacts_.clear();
  hits_.clear();
}

std::size_t ContactStep::add(std::uint32_t body, const SphereState& fallen) {
  outcomes_.push_back({.body = body, .region = 0, .state = fallen});
  return outcomes_.size() - 1;
}

void ContactStep::add_pair(std::size_t a, std::size_t b) {
  add_contact(a, b, static_cast<std::int32_t>(outcomes_[b].body), outcomes_[b].state.position);
  outcomes_[b].touches = true;
}

void ContactStep::add_pair_with_resting(std::size_t a, std::uint32_t resting, const Vector3d& place) {
  add_contact(a, kStill, static_cast<std::int32_t>(resting), place);
}

void ContactStep::add_contact(std::size_t a, std::size_t b, std::int32_t other, const Vector3d& place) {
  const Vector3d apart = outcomes_[a].state.position - place;
  const double distance = apart.norm();
  contacts_.push_back({.first = a,
                       .second = b,
                       .other = other,
                       .overlap = 2 * settings_.radius - distance,
                       .normal = distance > 0 ? Vector3d(apart / distance) : Vector3d(Vector3d::UnitY())});
  outcomes_[a].touches = true;
}

void ContactStep::solve(const Surface& surface) {
  find_surface_contacts(surface);
  for (int sweep = 0; sweep < settings_.sweeps; ++sweep)
    for (Contact& contact : contacts_)
      resolve(contact, sweep == 0);
  for (const Contact& contact : contacts_)
    if (contact.hits) note_hit(contact);
  for (const Contact& contact : contacts_)
    separate(contact);
  for (Outcome& outcome : outcomes_)
    settle(outcome);
}

void ContactStep::find_surface_contacts(const Surface& surface) {
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    Outcome& outcome = outcomes_[i];
    outcome.region = surface.region(outcome.state.position);
    surface.find_contacts(outcome.region, outcome.state.position, found_);
    for (const SurfaceContact& found : found_.list())
      contacts_.push_back({.first = i,
                           .second = kStill,
                           .other = kSurface,
                           .overlap = found.overlap,
                           .normal = found.normal});
    outcome.touches |= !found_.list().empty();
  }
}

/// One impulse along the normal and one of friction.
void ContactStep::resolve(Contact& contact, bool rebounds) {
  SphereState& first = outcomes_[contact.first].state;
  SphereState* second = contact.second == kStill ? nullptr : &outcomes_[contact.second].state;
  const Vector3d& normal = contact.normal;
  const double inverse_mass = second != nullptr ? 2 : 1;

  // Along the normal.
  Vector3d velocity = first.linear_velocity;
  if (second != nullptr) velocity -= second->linear_velocity;
  const double approach = -velocity.dot(normal);
  if (!(approach > 0)) return;
  const bool hits = rebounds && approach > settings_.restitution_speed;
  const double impulse = (1 + (hits ? settings_.restitution : 0)) * approach / inverse_mass;
  contact.hits |= hits;
  contact.impulse += impulse;
  first.linear_velocity += impulse * normal;
  if (second != nullptr) second->linear_velocity -= impulse * normal;

  // Friction against the slip at the point of contact, as much as stops it at most.
  Vector3d turning = first.angular_velocity;
  if (second != nullptr) turning += second->angular_velocity;
  const Vector3d slip = velocity + approach * normal - settings_.radius * turning.cross(normal);
  const double slip_speed = slip.norm();
  if (slip_speed > 0) {
    const double friction = std::min(settings_.friction * impulse, slip_speed / (kTangential * inverse_mass));
    const Vector3d push = -friction / slip_speed * slip;
    const Vector3d turn = -kTurning / settings_.radius * normal.cross(push);
    first.linear_velocity += push;
    first.angular_velocity += turn;
    if (second != nullptr) {
      second->linear_velocity -= push;
      second->angular_velocity += turn;
    }
  }

  // Rolling resistance.
  const double slowing = kTurning * settings_.rolling_resistance * impulse / settings_.radius;
  if (slowing > 0) {
    slow_down(first.angular_velocity, slowing);
    if (second != nullptr) slow_down(second->angular_velocity, slowing);
  }
}

/// Takes away a part of the overlap that was there before the impulses.
void ContactStep::separate(const Contact& contact) {
  const double excess = contact.overlap - settings_.permitted_overlap;
  if (excess <= 0) return;
  const double shift = settings_.separation * excess;
  if (contact.second == kStill) {
    outcomes_[contact.first].state.position += shift * contact.normal;
  } else {
    outcomes_[contact.first].state.position += shift / 2 * contact.normal;
    outcomes_[contact.second].state.position -= shift / 2 * contact.normal;
  }
}

void ContactStep::note_hit(const Contact& contact) {
  const Outcome& first = outcomes_[contact.first];
  const double impulse = contact.impulse * settings_.mass();
  const double inward = contact.other == kSurface ? contact.overlap : contact.overlap / 2;
  const Vector3d point = first.state.position - (settings_.radius - inward) * contact.normal;
  hits_.push_back({first.body, contact.other, impulse, point, contact.normal});
  if (contact.second != kStill)
    hits_.push_back({outcomes_[contact.second].body, static_cast<std::int32_t>(first.body), impulse, point,
                     -contact.normal});
}

void ContactStep::settle(Outcome& outcome) const {
  SphereState& state = outcome.state;
  const bool quiet = outcome.touches && state.linear_velocity.squaredNorm() < rest_speed_squared_;
  state.quiet_steps = quiet ? state.quiet_steps + 1 : 0;
  outcome.rests = state.quiet_steps >= rest_steps_;
  if (!outcome.rests) return;
  state.linear_velocity.setZero();
  state.angular_velocity.setZero();
}

}  // namespace retake::impulse
