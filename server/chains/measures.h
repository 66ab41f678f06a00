// The measures of a sample as JSON, as samples keep them and clients see them.
// doc/design.md, section 1. It must not know chains, HTTP or the store.
#pragma once

#include <span>
#include <vector>

#include <nlohmann/json.hpp>

#include "worlds/measure.h"

namespace retake {

/// null for NaN and infinity, which JSON has not.
nlohmann::json finite(double value);

/// A number, an integer, true or false, or a list of integers in ascending order; null for NaN.
nlohmann::json measure_json(Measure::Kind kind, double value);

/// {name: value} of each measure; those of one list are an array under the list's name.
/// Requires: values.size() == measures.size().
nlohmann::json measures_json(const std::vector<Measure>& measures, std::span<const double> values);

}  // namespace retake
