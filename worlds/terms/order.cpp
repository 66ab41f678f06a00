// The term `order`: events happen one after the other. Paper, section 3.2.
#include <algorithm>
#include <limits>
#include <utility>

#include "worlds/terms/fields.h"
#include "worlds/words.h"

namespace retake::terms {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostEvents = 32;  // chosen: more than any scene needs

std::string touch_in_words(const std::string& body, const std::string& with) {
  if (body == kAnyBody) return with == kAnyBody ? "there is a contact" : body_in_words(with) + " is touched";
  return body_in_words(body) + " touches " + (with == kAnyBody ? "something" : body_in_words(with));
}

std::string event_in_words(const Parameters& event) {
  const std::string kind = event.choice("kind"), body = event.text("body"), with = event.text("with");
  if (kind == "rest") return body_in_words(body) + " comes to rest";
  if (kind == "fall") return body_in_words(body) + " falls";
  return touch_in_words(body, with);
}

/// The first time that something happens to a body.
struct Event {
  enum class Kind { contact, rest, fall };
  Kind kind;
  std::string body;
  Partner one{}, other{};  ///< of a contact
};

OrderClaim::Event claimed(const Event& event) {
  if (event.kind == Event::Kind::rest) return {.name = body_in_words(event.body) + " comes to rest"};
  if (event.kind == Event::Kind::fall) return {.name = body_in_words(event.body) + " falls"};
  const Touch touch = touch_of(event.one, event.other);
  return {.name = touch_in_words(touch.one, touch.other), .touch = touch};
}

/// When something first happened to any body, as far as an animation tells.
struct Told {
  double time = kNever;   ///< [s] when it happened; kNever: it has not
  double until = kNever;  ///< [s] until when it would be known to have happened
};

class Order final : public Term {
 public:
  Order(std::vector<Event> events, double log_lambda) : events_(std::move(events)), log_lambda_(log_lambda) {
    for (const Event& event : events_)
      reads_frames_ |= event.kind == Event::Kind::contact;
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> all = {{.name = "out_of_order",
                                 .kind = Measure::Kind::integer,
                                 .summary = "How many events are not before the next one"}};
    for (std::size_t i = 1; i <= events_.size(); ++i)
      all.push_back({.name = "event_times_" + std::to_string(i),
                     .list = "event_times",
                     .unit = "s",
                     .summary = "When each event happens"});
    return all;
  }
  bool reads_frames() const override { return reads_frames_; }

  /// log p_c = -n log lambda: n events are not before the next one of the list.
  TermScore score(const Animation& animation, std::span<double> values) const override {
    int broken = 0;
    Told before;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const Told now{.time = time_of(events_[i], animation)};
      if (i > 0) broken += is_before(before, now) ? 0 : 1;
      values[i + 1] = now.time < kNever ? now.time : kAbsent;
      before = now;
    }
    values[0] = broken;
    return {.log_density = log_density(broken), .satisfied = broken == 0};
  }

  double least_when_satisfied() const override { return 0; }
  /// All of them happen, each before the next.
  Claims claims() const override {
    Claims all;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const Event& event = events_[i];
      const std::string place = append_pointer("/events", i);
      if (event.kind == Event::Kind::contact)
        claim_parts(event.one, event.other, place, all);
      else
        all.push_back({.field = place, .demand = takes_part(event.body)});
      if (event.kind == Event::Kind::fall) all.push_back({.field = place, .demand = falls(event.body, true)});
      if (i > 0)
        all.push_back({.field = place,
                       .demand = OrderClaim{.before = claimed(events_[i - 1]), .after = claimed(event)}});
    }
    return all;
  }
  std::vector<std::pair<std::string, std::string>> meetings() const override {
    std::vector<std::pair<std::string, std::string>> all;
    for (const Event& event : events_)
      if (event.kind == Event::Kind::contact)
        for (auto& pair : meeting(event.one, event.other))
          all.push_back(std::move(pair));
    return all;
  }

  /// What happened stays; what has not, though it would be known, comes later.
  double upper_bound(const Animation& so_far) const override {
    int broken = 0;
    Told before;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const Told now{.time = time_of(events_[i], so_far), .until = told_until(events_[i].kind, so_far)};
      const bool is_after = before.time < kNever ? before.time >= now.time : before.until >= now.time;
      if (i > 0 && now.time < kNever && is_after) ++broken;
      before = now;
    }
    return log_density(broken);
  }

 private:
  static bool is_before(const Told& one, const Told& other) {
    return one.time < other.time && other.time < kNever;
  }

  static double time_of(const Event& event, const Animation& animation) {
    if (event.kind == Event::Kind::contact) {
      const std::vector<double> times = contact_times(animation, event.one, event.other, 0);
      return times.empty() ? kNever : times.front();
    }
    const Track* track = find_track(animation, event.body);
    if (!track) return kNever;
    return (event.kind == Event::Kind::rest ? track->settled : track->fell).value_or(kNever);
  }

  /// Rests and falls are told in order of time, contacts with the frames.
  static double told_until(Event::Kind kind, const Animation& so_far) {
    if (kind == Event::Kind::contact) return so_far.frames > 0 ? so_far.duration() : -kNever;
    double latest = -kNever;
    for (const Track& track : so_far.tracks)
      latest = std::max(latest, (kind == Event::Kind::rest ? track.settled : track.fell).value_or(-kNever));
    return latest;
  }

  double log_density(int broken) const { return broken == 0 ? 0 : -broken * log_lambda_; }

  std::vector<Event> events_;
  double log_lambda_;
  bool reads_frames_ = false;
};

Event read_event(const Roster& roster, const Parameters& given, const std::string& pointer,
                 std::vector<Fault>& faults) {
  const std::string kind = given.choice("kind"), body = given.text("body"), with = given.text("with");
  Event event{.kind = kind == "contact" ? Event::Kind::contact
                      : kind == "rest"  ? Event::Kind::rest
                                        : Event::Kind::fall,
              .body = body};
  const std::string place = append_pointer(pointer, "body");
  if (event.kind == Event::Kind::contact) {
    event.one = Partner::read(roster, body, place, faults);
    event.other = Partner::read(roster, with, append_pointer(pointer, "with"), faults);
    return event;
  }
  if (with != kAnyBody)
    faults.push_back({append_pointer(pointer, "with"), "only contacts are with another body"});
  const Roster::Mover* mover = find_mover(roster, body, place, faults);
  if (mover && !(event.kind == Event::Kind::rest ? mover->tells_rest : mover->tells_fall))
    faults.push_back({append_pointer(pointer, "kind"), "is not told of " + body + " in this world"});
  return event;
}

std::unique_ptr<const Term> make_order(const Setting& setting, const Parameters& term,
                                       const Parameters& model, std::string_view pointer,
                                       std::vector<Fault>& faults) {
  const Roster roster = setting.roster(model);
  const std::string list = append_pointer(pointer, "events");
  std::vector<Event> events;
  for (const Parameters& given : term.object_list("events"))
    events.push_back(read_event(roster, given, append_pointer(list, events.size()), faults));
  return std::make_unique<const Order>(std::move(events), term.number("log_lambda"));
}

std::string order_sentence(const Parameters& term, const Parameters&) {
  std::string text;
  for (const Parameters& event : term.object_list("events"))
    text += (text.empty() ? "" : ", then ") + event_in_words(event);
  return text;
}

std::shared_ptr<const ParameterTable> event_fields() {
  return std::make_shared<const ParameterTable>(std::vector<Parameter>{
      {.name = "kind",
       .kind = Parameter::Kind::choice,
       .choices = {"contact", "rest", "fall"},
       .summary = "What happens: the body's first contact, that it comes to rest, or that it falls over"},
      {.name = "body",
       .kind = Parameter::Kind::text,
       .longest = kLongestName,
       .summary = "To what body it happens"},
      partner_field("with", "Of a contact: with which body, or any")});
}

}  // namespace

TermKind order_term(const Setting& setting) {
  ParameterTable fields({{.name = "events",
                          .kind = Parameter::Kind::object_list,
                          .fewest = 2,
                          .most = kMostEvents,
                          .fields = event_fields(),
                          .summary = "What happens, each before the next one"},
                         {.name = "log_lambda",
                          .default_value = 2.5,
                          .minimum = 0,
                          .maximum = 100,
                          .above_minimum = true,
                          .summary = "What an event that is not before the next one costs in log p_c",
                          .source = "chosen: what a pin costs (5.2.1)"}});
  return {.kind = "order",
          .summary = "Events happen one after the other: contacts, rests, falls",
          .parameters = std::move(fields),
          .make = [setting](auto&&... rest) { return make_order(setting, rest...); },
          .sentence = order_sentence};
}

}  // namespace retake::terms
