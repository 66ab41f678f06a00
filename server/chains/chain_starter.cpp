// See chain_starter.h.
#include "server/chains/chain_starter.h"

#include <algorithm>
#include <utility>

#include "server/chains/identifiers.h"

namespace retake {

ChainStarter::Started ChainStarter::start(std::string_view scenario, const ChainWish& wish,
                                          std::uint64_t most_live) {
  const std::lock_guard lock(mutex_);
  check_lesson(scenario, wish);
  const std::uint64_t seed = wish.seed ? *wish.seed : random_seed();
  Started started;
  std::vector<ChainRecord> fresh, there;
  std::vector<std::uint64_t> taken;
  for (std::uint32_t index = 0; index < wish.count; ++index) {
    ChainRecord record;
    record.scenario = scenario;
    record.index = index;
    record.seed = seed;
    record.method = wish.method;
    record.ratios = wish.ratios;
    if (wish.seed) {
      if (auto same = store_.same_chain(record, wish.lesson)) {
        started.chains.push_back(*same);
        there.push_back(std::move(*same));
        continue;
      }
    }
    record.id = random_identifier();
    record.created_at = now_milliseconds();
    record.stop = wish.stop;
    record.lesson =
        wish.lesson ? *wish.lesson : store_.next_lesson(scenario, wish.method, wish.ratios, taken);
    taken.push_back(record.lesson);
    started.chains.push_back(record);
    fresh.push_back(std::move(record));
  }
  started.created = fresh.size();
  const auto to_go_on = std::ranges::count_if(there, [&](const ChainRecord& record) {
    const bool is_live = record.state == ChainState::queued || record.state == ChainState::running;
    return !is_live && Runner::may_go_on(record, wish.stop);
  });
  const std::size_t to_run = fresh.size() + static_cast<std::size_t>(to_go_on);
  if (to_run > 0 && runner_.counters().live_chains + to_run > most_live)
    throw TooManyChains("more than " + std::to_string(most_live) + " chains would run");

  runner_.add(fresh);
  for (ChainRecord& record : started.chains) {
    const bool is_fresh = std::any_of(fresh.begin(), fresh.end(),
                                      [&](const ChainRecord& other) { return other.id == record.id; });
    const auto now = is_fresh ? runner_.chain(record.id) : runner_.go_on(record.id, wish.stop);
    if (now) record = *now;
  }
  return started;
}

void ChainStarter::check_lesson(std::string_view scenario, const ChainWish& wish) const {
  if (wish.lesson.value_or(0) == 0) return;
  const std::vector<LessonRecord> lessons = store_.lessons(scenario);
  const auto named = std::find_if(lessons.begin(), lessons.end(),
                                  [&](const LessonRecord& lesson) { return lesson.number == *wish.lesson; });
  if (named == lessons.end())
    throw UnknownLesson("this scenario has no lesson " + std::to_string(*wish.lesson));
  if (named->method != wish.method || named->ratios != wish.ratios)
    throw UnknownLesson("lesson " + std::to_string(named->number) + " is of method " + named->method +
                        " with ratios " + named->ratios);
  if (named->version != kLessonVersion)
    throw UnknownLesson("lesson " + std::to_string(named->number) +
                        " was learned by another version of Retake; begin anew with 0");
}

}  // namespace retake
