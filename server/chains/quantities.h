// Quantity: one variable or measure over the draws of several chains, the table that diagnostics read.
// doc/design.md, section 3, "Diagnostics". It must not know HTTP or the store's methods.
#pragma once

#include <string>
#include <vector>

#include "db/records.h"
#include "sampler/diagnostics.h"
#include "worlds/scenario.h"

namespace retake {

struct Quantity {
  std::string name;
  std::string unit{};
  bool is_one_of_many = false;  ///< a variable, or a member of a list of measures
  ChainDraws draws;             ///< NaN where there is no value
};

/// Every variable, and every measure that is a number or a flag (as 0 or 1); a set is no quantity.
std::vector<Quantity> quantities(const Scenario& scenario,
                                 const std::vector<std::vector<DrawRecord>>& chains);

/// Those that are judged where there are very many: each that stands for itself, and of the others the 120
/// slowest by ess_rough, chosen so that HOMEMADE's 2,400 are judged in a blink. All, in their order, up to
/// that number. A quantity that never varies is not slow.
std::vector<Quantity> slowest(std::vector<Quantity> all);

}  // namespace retake
