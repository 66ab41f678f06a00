// See measures.h.
#include "server/chains/measures.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "sampler/check.h"

namespace retake {

using nlohmann::json;

json finite(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

json measure_json(Measure::Kind kind, double value) {
  if (std::isnan(value)) return nullptr;
  switch (kind) {
    case Measure::Kind::flag:
      return value != 0;
    case Measure::Kind::integer_set:
      return members_of(value);
    case Measure::Kind::integer:
      CHECK(value == std::floor(value), value);
      return static_cast<std::int64_t>(value);
    case Measure::Kind::number:
      break;
  }
  return finite(value);
}

json measures_json(const std::vector<Measure>& measures, std::span<const double> values) {
  json view = json::object();
  for (std::size_t i = 0; i < measures.size(); ++i) {
    json value = measure_json(measures[i].kind, values[i]);
    if (measures[i].list.empty())
      view[measures[i].name] = std::move(value);
    else
      view[measures[i].list].push_back(std::move(value));
  }
  return view;
}

}  // namespace retake
