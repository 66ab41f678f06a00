// See views.h.
#include "server/api/views.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "sampler/check.h"
#include "server/chains/measures.h"

namespace retake {
namespace {

using nlohmann::json;

const char* kind_name(Measure::Kind kind) {
  switch (kind) {
    case Measure::Kind::flag:
      return "flag";
    case Measure::Kind::integer_set:
      return "set";
    case Measure::Kind::integer:
      return "integer";
    case Measure::Kind::number:
      break;
  }
  return "number";
}

json meaning_json(const Measure& measure) {
  json view = {{"name", measure.name},
               {"kind", kind_name(measure.kind)},
               {"unit", measure.unit},
               {"summary", measure.summary}};
  if (!measure.list.empty()) view.update({{"name", measure.list}, {"kind", "list"}, {"of", view["kind"]}});
  return view;
}

/// "height_3_12" is one of "height_#_#".
std::string family_of(const std::string& name) {
  std::string family;
  for (const char character : name) {
    const bool is_digit = character >= '0' && character <= '9';
    if (!is_digit)
      family += character;
    else if (family.empty() || family.back() != '#')
      family += '#';
  }
  return family;
}

json stop_json(const StopRule& stop) {
  json rule = json::object();
  visit_limits(
      [&](const char* name, const auto& limit) {
        if (limit) rule[name] = *limit;
      },
      stop);
  return rule;
}

json optional_number(const std::optional<double>& value) {
  return value ? finite(*value) : json(nullptr);
}

json parsed(const std::string& text) {
  return text.empty() ? json::object() : json::parse(text);
}

}  // namespace

json measures_json(const std::vector<Measure>& measures) {
  json all = json::array();
  for (std::size_t i = 0; i < measures.size(); ++i) {
    const bool is_told = i > 0 && !measures[i].list.empty() && measures[i - 1].list == measures[i].list;
    if (!is_told) all.push_back(meaning_json(measures[i]));
  }
  return all;
}

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Method method : kMethods)
    names.emplace_back(to_string(method));
  return names;
}

std::vector<std::string> ratios_names() {
  std::vector<std::string> names;
  for (const Ratios ratios : kRatios)
    names.emplace_back(to_string(ratios));
  return names;
}

json world_json(const World& world) {
  json constraints = json::array();
  for (const TermKind& kind : world.term_kinds()) {
    json schema = kind.parameters.schema();
    schema["properties"]["kind"] = {{"const", kind.kind}};
    json required = json::array({"kind"});
    if (schema.contains("required"))
      for (const json& name : schema["required"])
        required.push_back(name);
    schema["required"] = std::move(required);
    constraints.push_back({{"kind", kind.kind}, {"summary", kind.summary}, {"schema", std::move(schema)}});
  }
  const auto plain = Scenario::read({{"world", world.name()}, {"constraints", json::array()}}, {&world});
  return {{"name", world.name()},
          {"version", world.version()},
          {"summary", world.summary()},
          {"try", world.attempt()},
          {"default_method", to_string(world.default_method())},
          {"saves", {{"stops_early", world.savings().stops_early}, {"resumes", world.savings().resumes}}},
          {"methods", method_names()},
          {"model", world.model_parameters().schema()},
          {"measures", measures_json(plain->measures())},
          {"constraints", std::move(constraints)},
          {"examples", world.examples()}};
}

json scenario_json(const ScenarioRecord& record) {
  json view = parsed(record.document);
  view["id"] = record.id;
  view["wishes"] = wishes_of(view);
  view["created_at"] = timestamp(record.created_at);
  view["samples"] = record.samples;
  view["chains"] = {{"running", record.running},
                    {"paused", record.paused},
                    {"finished", record.finished},
                    {"failed", record.failed}};
  view["odds"] = odds_json(record.odds);
  view["difficulty"] = difficulty_json(record.pilot);
  return view;
}

json odds_json(const OddsTally& tally) {
  const auto known = odds(tally);
  if (!known) return nullptr;
  return {{"probability", known->probability}, {"low", known->low},    {"high", known->high},
          {"basis", to_string(tally.basis)},   {"draws", tally.draws}, {"hits", tally.hits}};
}

json difficulty_json(const std::optional<PilotTally>& pilot) {
  if (!pilot) return nullptr;
  const double hits = static_cast<double>(pilot->hits);
  const auto known = odds({.basis = OddsBasis::rejection,
                           .draws = pilot->draws,
                           .hits = pilot->hits,
                           .sum = hits,
                           .squares = hits,
                           .largest = hits > 0 ? 1.0 : 0.0});
  if (!known) return nullptr;
  constexpr double kCommon = 0.01;  // chosen: rejection alone then finds plenty
  const char* verdict = known->probability >= kCommon ? "common" : pilot->hits > 0 ? "rare" : "nothing-yet";
  return {{"verdict", verdict},
          {"one_in", pilot->hits > 0 ? json(static_cast<double>(pilot->draws) / hits) : json(nullptr)},
          {"at_least", 1 / known->high},
          {"draws", pilot->draws},
          {"hits", pilot->hits},
          {"seconds", pilot->seconds}};
}

json diagnostics_json(const Health& health) {
  json quantities = json::array();
  for (const QuantityHealth& quantity : health.quantities)
    quantities.push_back({{"name", quantity.name},
                          {"unit", quantity.unit},
                          {"rhat", finite(quantity.together.rhat)},
                          {"ess_bulk", finite(quantity.together.ess_bulk)},
                          {"ess_tail", finite(quantity.together.ess_tail)},
                          {"ess_within", finite(quantity.ess_within)},
                          {"ess_across", finite(quantity.ess_across)},
                          {"mean", finite(quantity.together.mean)},
                          {"sd", finite(quantity.together.sd)}});
  json effective = nullptr;
  if (health.effective)
    effective = {{"samples", health.effective->samples},
                 {"quantity", health.effective->quantity},
                 {"within", health.effective->within},
                 {"per_cpu_minute", optional_number(health.effective->per_cpu_minute)}};
  json first_sample = nullptr;
  if (health.first_sample_seconds) first_sample = {{"seconds", *health.first_sample_seconds}};
  json swaps = json::array();
  for (const SwapHealth& swap : health.swaps)
    swaps.push_back({{"chain", swap.chain},
                     {"low", swap.low},
                     {"high", swap.high},
                     {"proposed", swap.proposed},
                     {"accepted", swap.accepted}});
  const double all_seconds = health.simulated_seconds + health.skipped_seconds;
  return {{"quantities", std::move(quantities)},
          {"quantity_count", health.quantity_count},
          {"chains", health.chains},
          {"draws_per_chain", health.draws_per_chain},
          {"effective", std::move(effective)},
          {"odds", odds_json(health.odds)},
          {"first_sample", std::move(first_sample)},
          {"eta_seconds", optional_number(health.eta_seconds)},
          {"saved",
           {{"iterations", health.iterations},
            {"simulations", health.simulations},
            {"simulated_seconds", health.simulated_seconds},
            {"skipped_seconds", health.skipped_seconds},
            {"share", all_seconds > 0 ? json(health.skipped_seconds / all_seconds) : json(nullptr)}}},
          {"swaps", std::move(swaps)}};
}

json chain_json(const ChainRecord& record, const Scenario* scenario) {
  const ChainCounters& counters = record.counters;
  json kernels = json::array();
  for (const KernelCounter& kernel : counters.kernels)
    kernels.push_back({{"name", kernel.name}, {"proposed", kernel.proposed}, {"accepted", kernel.accepted}});
  json view = {{"id", record.id},
               {"scenario", record.scenario},
               {"index", record.index},
               {"seed", record.seed},
               {"method", record.method},
               {"ratios", record.ratios},
               {"lesson", record.lesson},
               {"state", to_string(record.state)},
               {"stop", stop_json(record.stop)},
               {"phase", counters.is_learning ? "exploring" : "sampling"},
               {"counted", counters.counted},
               {"effective_samples", optional_number(counters.effective_samples)},
               {"run_seconds", counters.run_seconds},
               {"iterations_per_second", counters.iterations_per_second},
               {"kernels", std::move(kernels)},
               {"first_sample", nullptr},
               {"ended_by", record.ended_by.empty() ? json(nullptr) : json(record.ended_by)},
               {"error", record.error.empty() ? json(nullptr) : json(record.error)},
               {"created_at", timestamp(record.created_at)}};
  visit_counters(counters, [&](const char* name, auto value) { view[name] = value; });
  if (counters.first_sample_iteration)
    view["first_sample"] = {{"iteration", *counters.first_sample_iteration},
                            {"seconds", counters.first_sample_seconds.value_or(0)}};
  if (scenario)
    view["guided"] = method_from(record.method) == Method::conditional &&
                     scenario->target(Ratios::exact)->guide != nullptr;
  return view;
}

json lessons_json(const std::vector<LessonRecord>& records) {
  json views = json::array();
  for (const LessonRecord& record : records)
    views.push_back({{"number", record.number},
                     {"method", record.method},
                     {"ratios", record.ratios},
                     {"chain", record.chain},
                     {"kind", to_string(record.kind)},
                     {"usable", record.version == kLessonVersion},
                     {"created_at", timestamp(record.created_at)}});
  return {{"lessons", std::move(views)}};
}

json sample_json(const SampleRecord& record) {
  return {{"id", record.id},
          {"scenario", record.scenario},
          {"chain", record.chain},
          {"iteration", record.iteration},
          {"replica", record.replica},
          {"weight", record.weight},
          {"learning", record.weight == 0},
          {"log_prior", record.log_prior},
          {"log_constraint", record.log_constraint},
          {"duration", record.duration},
          {"measures", parsed(record.measures)},
          {"digest", record.digest},
          {"plays", record.plays},
          {"created_at", timestamp(record.created_at)}};
}

json variables_json(const Model& model, const State& state) {
  json variables = json::object();
  for (std::size_t i = 0; i < model.size(); ++i)
    variables[model.variables()[i].name] = finite(state[static_cast<Eigen::Index>(i)]);
  return variables;
}

json variable_units_json(const Model& model) {
  std::map<std::string, std::set<std::string>> families;
  for (const Variable& variable : model.variables())
    families[family_of(variable.name)].insert(variable.unit);
  json units = json::object();
  for (const Variable& variable : model.variables()) {
    const std::string family = family_of(variable.name);
    CHECK(families[family].size() == 1, family);
    if (!variable.unit.empty()) units[family] = variable.unit;
  }
  return units;
}

json trace_json(const Trace& trace, const std::vector<Measure>& all, std::size_t points) {
  std::vector<Measure> measures;
  std::copy_if(all.begin(), all.end(), std::back_inserter(measures),
               [](const Measure& measure) { return measure.list.empty(); });
  const std::size_t count = std::min(points, trace.size());
  json iteration = json::array(), log_prior = json::array(), log_constraint = json::array(),
       satisfied = json::array();
  std::vector<json> values(measures.size(), json::array());
  for (std::size_t i = 0; i < count; ++i) {
    // Evenly spread, the first and the last point included.
    const std::size_t chosen = count == 1 ? trace.size() - 1 : i * (trace.size() - 1) / (count - 1);
    const Trace::Point point = trace.point(chosen);
    iteration.push_back(point.iteration);
    log_prior.push_back(finite(point.log_prior));
    log_constraint.push_back(finite(point.log_constraint));
    satisfied.push_back(point.satisfied);
    for (std::size_t k = 0; k < measures.size(); ++k)
      values[k].push_back(measure_json(measures[k].kind, point.measures[k]));
  }
  json view = {{"iteration", std::move(iteration)},
               {"log_prior", std::move(log_prior)},
               {"log_constraint", std::move(log_constraint)},
               {"satisfied", std::move(satisfied)}};
  for (std::size_t k = 0; k < measures.size(); ++k)
    view[measures[k].name] = std::move(values[k]);
  return view;
}

std::string timestamp(std::int64_t milliseconds) {
  const auto seconds = static_cast<std::time_t>(milliseconds / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text + length, sizeof text - length, ".%03dZ", static_cast<int>(milliseconds % 1000));
  return text;
}

}  // namespace retake
