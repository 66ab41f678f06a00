// See fields.h.
#include "worlds/terms/fields.h"

#include <utility>

namespace retake::terms {

Parameter body_field(const Setting& setting, std::string summary) {
  Parameter field{
      .name = "body", .kind = Parameter::Kind::text, .longest = kLongestName, .summary = std::move(summary)};
  if (!setting.only_body.empty()) {
    field.default_value = setting.only_body;
    field.source = "the only one, unless the model has more";
  }
  return field;
}

std::function<void(nlohmann::json&, const Parameters&, std::string_view, std::vector<Fault>&)> fit_body(
    const Setting& setting) {
  return [setting](nlohmann::json& term, const Parameters& model, std::string_view pointer,
                   std::vector<Fault>& faults) {
    if (term.contains("body")) return;
    const Roster roster = setting.roster(model);
    if (roster.movers.size() == 1)
      term["body"] = roster.movers[0].name;
    else if (!setting.only_body.empty())
      faults.push_back({append_pointer(pointer, "body"), "is required where there are several"});
  };
}

Parameter partner_field(std::string name, std::string summary) {
  return {.name = std::move(name),
          .kind = Parameter::Kind::text,
          .default_value = kAnyBody,
          .longest = kLongestName,
          .summary = std::move(summary),
          .source = "every contact counts"};
}

Parameter number_field(std::string name, double low, double high, std::string unit, std::string summary) {
  return {.name = std::move(name),
          .minimum = low,
          .maximum = high,
          .unit = std::move(unit),
          .summary = std::move(summary)};
}

Parameter sd_field(std::string name, double value, std::string unit, std::string source) {
  Parameter field = number_field(std::move(name), 1e-6, 1000, std::move(unit),
                                 "Softness: standard deviation of the miss under p_c");
  field.default_value = value;
  field.source = std::move(source);
  return field;
}

Parameter tolerance_field(std::string name, double value, std::string unit, std::string source) {
  Parameter field =
      number_field(std::move(name), 0, 1000, std::move(unit), "Satisfied if the miss is at most this");
  field.default_value = value;
  field.above_minimum = true;
  field.source = std::move(source);
  return field;
}

}  // namespace retake::terms
