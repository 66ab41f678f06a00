// The term `contact_at`: contacts at given times or on a beat, such as a bounce choreographed to music.
// Paper, sections 1 and 3.2.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "worlds/terms/fields.h"
#include "worlds/words.h"

namespace retake::terms {
namespace {

/// Which contacts count, and how far they may be off.
struct Contacts {
  Partner body, with;
  double least_impulse;  ///< [N s]
  double sd, tolerance;  ///< [s]

  std::vector<double> times(const Animation& animation) const {
    return contact_times(animation, body, with, least_impulse);
  }
  std::vector<std::pair<std::string, std::string>> meetings() const { return meeting(body, with); }
  Touch touch() const { return touch_of(body, with); }
  /// That there is a contact at all.
  Claims claims() const {
    Claims all;
    claim_parts(body, with, "", all);
    return all;
  }
};

std::vector<Measure> contact_measures(std::string miss) {
  return {{.name = "beat_miss", .unit = "s", .summary = std::move(miss)},
          {.name = "contacts", .kind = Measure::Kind::integer, .summary = "How many contacts count"}};
}

/// The distance of a time to the nearest of some [s]; infinity if there is none.
double nearest(const std::vector<double>& times, double time) {
  double least = std::numeric_limits<double>::infinity();
  for (const double each : times)
    least = std::min(least, std::abs(each - time));
  return least;
}

/// Every time of a list has a contact; contacts elsewhere are free.
class ContactsAtTimes final : public Term {
 public:
  ContactsAtTimes(Contacts contacts, std::vector<double> times)
      : contacts_(std::move(contacts)), times_(std::move(times)) {}

  std::vector<Measure> measures() const override {
    return contact_measures("By how much the time is missed that is missed most");
  }
  bool reads_frames() const override { return true; }

  /// A time without any contact is missed by as much as a contact could miss it.
  TermScore score(const Animation& animation, std::span<double> values) const override {
    const std::vector<double> contacts = contacts_.times(animation);
    TermScore score;
    double worst = 0;
    for (const double time : times_) {
      const double none = std::max(time, std::abs(animation.duration() - time));
      const double miss = std::min(nearest(contacts, time), none);
      worst = std::max(worst, miss);
      score.log_density += log_gaussian(miss, contacts_.sd);
    }
    values[0] = worst;
    values[1] = static_cast<double>(contacts.size());
    score.satisfied = !contacts.empty() && worst <= contacts_.tolerance;
    return score;
  }

  double least_when_satisfied() const override {
    return static_cast<double>(times_.size()) * log_gaussian(contacts_.tolerance, contacts_.sd);
  }

  Claims claims() const override {
    Claims all = contacts_.claims();
    for (std::size_t i = 0; i < times_.size(); ++i)
      all.push_back({.field = append_pointer("/times", i),
                     .demand = TouchClaim{.touch = contacts_.touch(),
                                          .least_impulse = contacts_.least_impulse,
                                          .from = times_[i] - contacts_.tolerance,
                                          .to = times_[i] + contacts_.tolerance}});
    return all;
  }

  std::vector<std::pair<std::string, std::string>> meetings() const override { return contacts_.meetings(); }

  /// What is to come is later than what is known.
  double upper_bound(const Animation& so_far) const override {
    if (so_far.frames == 0) return 0;
    const std::vector<double> contacts = contacts_.times(so_far);
    double bound = 0;
    for (const double time : times_)
      bound += log_gaussian(std::min(nearest(contacts, time), std::max(so_far.duration() - time, 0.0)),
                            contacts_.sd);
    return bound;
  }

 private:
  Contacts contacts_;
  std::vector<double> times_;  ///< [s]
};

/// Every contact falls on a beat, and there are enough of them.
class ContactsOnBeat final : public Term {
 public:
  struct Beat {
    double period;            ///< [s]
    bool from_first_contact;  ///< else from the offset
    double offset;            ///< [s]
    std::size_t fewest;       ///< contacts
  };
  ContactsOnBeat(Contacts contacts, const Beat& beat) : contacts_(std::move(contacts)), beat_(beat) {}

  std::vector<Measure> measures() const override {
    return contact_measures("By how much the contact misses its beat that misses most");
  }
  bool reads_frames() const override { return true; }

  TermScore score(const Animation& animation, std::span<double> values) const override {
    const std::vector<double> contacts = contacts_.times(animation);
    const Misses misses = judge(contacts);
    values[0] = contacts.empty() ? kAbsent : misses.worst;
    values[1] = static_cast<double>(contacts.size());
    // A contact that is lacking counts as one between two beats.
    double log_density = misses.log_density;
    for (std::size_t i = contacts.size(); i < beat_.fewest; ++i)
      log_density += log_gaussian(beat_.period / 2, contacts_.sd);
    return {.log_density = log_density,
            .satisfied = contacts.size() >= beat_.fewest && misses.worst <= contacts_.tolerance};
  }

  Claims claims() const override {
    Claims all = contacts_.claims();
    all.push_back({.field = "/bpm",
                   .demand = BeatClaim{
                       .touch = contacts_.touch(),
                       .least_impulse = contacts_.least_impulse,
                       .period = beat_.period,
                       .tolerance = contacts_.tolerance,
                       .offset = beat_.from_first_contact ? std::nullopt : std::optional(beat_.offset)}});
    return all;
  }

  std::vector<std::pair<std::string, std::string>> meetings() const override {
    if (beat_.fewest == 0) return {};
    return contacts_.meetings();
  }

  /// Those that happened stay.
  double upper_bound(const Animation& so_far) const override {
    if (so_far.frames == 0) return 0;
    return judge(contacts_.times(so_far)).log_density;
  }

 private:
  struct Misses {
    double log_density = 0;
    double worst = 0;  ///< [s]
  };
  Misses judge(const std::vector<double>& contacts) const {
    Misses misses;
    const double first = beat_.from_first_contact && !contacts.empty() ? contacts.front() : beat_.offset;
    for (const double time : contacts) {
      const double miss = std::abs(std::remainder(time - first, beat_.period));
      misses.worst = std::max(misses.worst, miss);
      misses.log_density += log_gaussian(miss, contacts_.sd);
    }
    return misses;
  }

  Contacts contacts_;
  Beat beat_;
};

std::unique_ptr<const Term> make(const Setting& setting, const Parameters& term, const Parameters& model,
                                 std::string_view pointer, std::vector<Fault>& faults) {
  const Roster roster = setting.roster(model);
  Contacts contacts{.body = Partner::read(roster, term.text("body"), append_pointer(pointer, "body"), faults),
                    .with = Partner::read(roster, term.text("with"), append_pointer(pointer, "with"), faults),
                    .least_impulse = term.number("least_impulse"),
                    .sd = term.number("sd"),
                    .tolerance = term.number("tolerance")};
  std::vector<double> times = term.number_list("times");
  const double bpm = term.number("bpm");
  if (times.empty() == (bpm == 0))
    faults.push_back({append_pointer(pointer, times.empty() ? "times" : "bpm"),
                      times.empty() ? "is required unless there is a bpm" : "is one too many beside times"});
  if (term.choice("from") == "first_contact" && term.number("offset") != 0)
    faults.push_back({append_pointer(pointer, "offset"), "needs beats that are counted from the start"});
  if (!times.empty()) return std::make_unique<const ContactsAtTimes>(std::move(contacts), std::move(times));
  return std::make_unique<const ContactsOnBeat>(
      std::move(contacts),
      ContactsOnBeat::Beat{.period = 60 / bpm,
                           .from_first_contact = term.choice("from") == "first_contact",
                           .offset = term.number("offset"),
                           .fewest = static_cast<std::size_t>(term.integer("contacts"))});
}

/// Between whom a contact is: " of pin 1 and the ball", "" if between any.
std::string partners_in_words(const Parameters& term) {
  std::vector<std::string> named;
  for (const char* field : {"body", "with"})
    if (const std::string name = term.text(field); name != kAnyBody) named.push_back(body_in_words(name));
  return named.empty() ? "" : " of " + list_in_words(named);
}

std::string sentence(const Parameters& term, const Parameters&) {
  const std::string within = ", within " + seconds_in_words(term.number("tolerance"));
  std::vector<std::string> times;
  for (const double time : term.number_list("times"))
    times.push_back(in_words(time) + " s");
  if (times.empty())
    return "every contact" + partners_in_words(term) + " is on the beat, " + in_words(term.number("bpm")) +
           " a minute" + within;
  return "there is a contact" + partners_in_words(term) + " at " + list_in_words(times) + within;
}

}  // namespace

TermKind contact_at_term(const Setting& setting) {
  constexpr double kSoftness = 0.03;  // [s]
  const std::string source = "chosen: two frames; people hardly notice less";
  ParameterTable fields(
      {partner_field("body", "Whose contacts count: a body, or any"),
       partner_field("with", "With what: a body, or any"),
       {.name = "times",
        .kind = Parameter::Kind::number_list,
        .default_value = nlohmann::json::array(),
        .minimum = 0,
        .maximum = 3600,
        .most = 64,
        .unit = "s",
        .summary = "Each of these has a contact nearby; contacts at other times are free",
        .source = "none: `bpm` says when"},
       {.name = "bpm",
        .default_value = 0,
        .minimum = 0,
        .maximum = 1200,
        .unit = "1/min",
        .summary = "Every contact falls on one of so many beats a minute; 0: `times` say when",
        .source = "none"},
       {.name = "from",
        .kind = Parameter::Kind::choice,
        .default_value = "first_contact",
        .choices = {"first_contact", "start"},
        .summary = "Where beats are counted from: the first contact or the start",
        .source = "chosen: music can be moved to the first hit"},
       {.name = "offset",
        .default_value = 0,
        .minimum = -60,
        .maximum = 60,
        .unit = "s",
        .summary = "When the first beat is, of beats that are counted from the start",
        .source = "none"},
       {.name = "contacts",
        .kind = Parameter::Kind::integer,
        .default_value = 2,
        .minimum = 1,
        .maximum = 1000,
        .summary = "At least so many contacts on the beat",
        .source = "chosen: the first one alone keeps no time"},
       {.name = "least_impulse",
        .default_value = 0,
        .minimum = 0,
        .maximum = 1000,
        .unit = "N s",
        .summary = "Softer contacts do not count",
        .source = "every contact counts"},
       sd_field("sd", kSoftness, "s", source),
       tolerance_field("tolerance", kSoftness, "s", source)});
  return {.kind = "contact_at",
          .summary = "Contacts at given times, or on the beat of music",
          .parameters = std::move(fields),
          .make = [setting](auto&&... rest) { return make(setting, rest...); },
          .sentence = sentence};
}

}  // namespace retake::terms
