// See roster.h.
#include "worlds/terms/roster.h"

#include <algorithm>

#include "worlds/parameters.h"

namespace retake::terms {
namespace {

constexpr std::size_t kMostNamed = 20;  // in a message, chosen: all of a lane

std::string there_is_no(const std::string& name, std::vector<std::string> names) {
  const std::size_t more = names.size() > kMostNamed ? names.size() - kMostNamed : 0;
  names.resize(names.size() - more);
  return "there is no body " + nlohmann::json(name).dump() + " here; there are " + list_of_names(names) +
         (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

std::vector<std::string> names_of(const std::vector<Roster::Mover>& movers) {
  std::vector<std::string> names;
  for (const Roster::Mover& mover : movers)
    names.push_back(mover.name);
  return names;
}

}  // namespace

const Roster::Mover* find_mover(const Roster& roster, const std::string& name, const std::string& pointer,
                                std::vector<Fault>& faults) {
  for (const Roster::Mover& mover : roster.movers)
    if (mover.name == name) return &mover;
  if (std::find(roster.still.begin(), roster.still.end(), name) != roster.still.end())
    faults.push_back(
        {pointer, name + " stands still; what moves are " + list_of_names(names_of(roster.movers))});
  else
    faults.push_back({pointer, there_is_no(name, names_of(roster.movers))});
  return nullptr;
}

const Track* find_track(const Animation& animation, std::string_view name) {
  for (const Track& track : animation.tracks)
    if (track.name == name) return &track;
  return nullptr;
}

Partner Partner::read(const Roster& roster, const std::string& name, const std::string& pointer,
                      std::vector<Fault>& faults) {
  Partner partner;
  partner.name_ = name;
  if (name == kAnyBody) return partner;
  std::vector<std::string> names = names_of(roster.movers);
  const auto still = std::find(roster.still.begin(), roster.still.end(), name);
  if (std::find(names.begin(), names.end(), name) != names.end()) {
    partner.mover_ = name;
  } else if (still != roster.still.end()) {
    partner.still_ = static_cast<std::size_t>(still - roster.still.begin());
  } else {
    names.insert(names.begin(), kAnyBody);
    names.insert(names.end(), roster.still.begin(), roster.still.end());
    faults.push_back({pointer, there_is_no(name, std::move(names))});
  }
  return partner;
}

Partner::Here Partner::in(const Animation& animation) const {
  Here here;
  here.any_ = mover_.empty() && !still_;
  if (still_) here.body_ = animation.tracks.size() + *still_;
  if (!mover_.empty())
    if (const Track* track = find_track(animation, mover_))
      here.body_ = static_cast<std::size_t>(track - animation.tracks.data());
  return here;
}

std::vector<std::pair<std::string, std::string>> meeting(const Partner& one, const Partner& other) {
  if (one.mover().empty() || other.mover().empty()) return {};
  return {{one.mover(), other.mover()}};
}

Touch touch_of(const Partner& one, const Partner& other) {
  const auto [first, second] = std::minmax(one.name(), other.name());
  return {.one = first, .other = second};
}

void claim_parts(const Partner& one, const Partner& other, const std::string& field, Claims& claims) {
  for (const Partner* partner : {&one, &other})
    if (!partner->mover().empty()) claims.push_back({.field = field, .demand = takes_part(partner->mover())});
}

std::vector<double> contact_times(const Animation& animation, const Partner& body, const Partner& with,
                                  double least_impulse) {
  const Partner::Here one = body.in(animation), other = with.in(animation);
  std::vector<double> times;
  for (const ContactEvent& event : animation.events) {
    const auto [a, b] = event.bodies;
    const bool meet = (one.is(a) && other.is(b)) || (one.is(b) && other.is(a));
    if (meet && event.impulse >= least_impulse) times.push_back(event.time);
  }
  return times;
}

}  // namespace retake::terms
