// Clauses about documents: a world describes itself whole, and its examples can be read.
#include <algorithm>
#include <set>

#include "tests/worlds/contract/contract.h"
#include "tests/worlds/contract/open_scenario.h"

namespace retake::tests::clauses {
namespace {

void check_schema(const json& schema, const std::string& where, Faults& faults);

/// The type of a field, with what the type needs.
void check_type(const json& property, const std::string& where, Faults& faults) {
  const std::string type = property.at("type");
  if (type == "array" && property.contains("uniqueItems")) {
    const json& items = property.at("items");
    faults.expect(property.at("uniqueItems") == true && property.at("minItems") >= 0, where, ": no set");
    faults.expect(items.at("type") == "integer" && items.contains("minimum") && items.contains("maximum"),
                  where, ": members of a set are integers between bounds");
  } else if (type == "array") {
    faults.expect(property.at("maxItems") > 0, where, ": a list of nothing");
    check_type(property.at("items"), where + "/items", faults);
  } else if (type == "object") {
    check_schema(property, where + "/", faults);
  } else if (type == "string") {
    faults.expect(property.contains("enum") != property.contains("maxLength"), where,
                  ": either a choice or a text");
    faults.expect(property.value("maxLength", 1) > 0, where, ": a text of no length");
  } else {
    faults.expect(type == "number" || type == "integer" || type == "boolean", where, ": ", type);
  }
}

void check_schema(const json& schema, const std::string& where, Faults& faults) {
  faults.expect(schema.at("type") == "object" && schema.at("additionalProperties") == false, where,
                ": not an object without other fields");
  const json required = schema.value("required", json::array());
  for (const auto& [name, property] : schema.at("properties").items()) {
    check_type(property, where + name, faults);
    faults.expect(!property.at("description").get<std::string>().empty(), where, name, ": no summary");
    const bool is_required = std::find(required.begin(), required.end(), name) != required.end();
    const bool has_default = property.contains("default");
    faults.expect(is_required != has_default, where, name, ": either required or with a default");
    faults.expect(!has_default || property.contains("x-source"), where, name,
                  ": where does the default come from?");
  }
}

}  // namespace

void describes_itself(const World& world, int, Faults& faults) {
  faults.expect(!world.name().empty() && !world.summary().empty(), "no name or no summary");
  faults.expect(world.version() >= 1, "versions begin at 1");
  check_schema(world.model_parameters().schema(), "/model/", faults);
  faults.expect(!world.term_kinds().empty(), "nothing can be wished");
  std::set<std::string> kinds;
  for (const TermKind& kind : world.term_kinds()) {
    faults.expect(kinds.insert(kind.kind).second, kind.kind, ": two kinds of one name");
    faults.expect(!kind.summary.empty(), kind.kind, ": no summary");
    check_schema(kind.parameters.schema(), kind.kind + "/", faults);
  }
}

void reads_its_examples(const World& world, int, Faults& faults) {
  const auto check_read = [&](const json& document) {
    for (const auto& [pointer, detail] : faults_of([&] { Scenario::read(document, {&world}); }))
      faults.expect(false, document.value("title", "every default"), ": ", pointer, " ", detail);
  };
  check_read({{"world", world.name()}, {"constraints", json::array()}});
  faults.expect(!world.examples().empty(), "no examples");
  for (const json& example : world.examples())
    check_read(example);
  if (!faults.sentences().empty()) return;

  for (const OpenScenario& open : open_examples(world)) {
    const Scenario& scenario = *open.scenario;
    faults.expect(!scenario.title().empty() && scenario.title() != world.summary(),
                  "an example has no title");
    faults.expect(!scenario.document().at("constraints").empty(), scenario.title(), ": wishes nothing");
    std::set<std::string> names;
    for (const Measure& measure : scenario.measures())
      faults.expect(names.insert(measure.name).second, measure.name, ": two measures of one name");
    for (const Ratios ratios : {Ratios::exact, Ratios::paper})
      faults.expect(!scenario.target(ratios)->kernels.rows().empty(), scenario.title(), ": no proposals");
  }
}

}  // namespace retake::tests::clauses
