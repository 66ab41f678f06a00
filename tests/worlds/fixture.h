// What the tests of worlds/ share: reading documents, and judging their faults.
#pragma once

#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "worlds/scenario.h"

namespace retake::tests {

using nlohmann::json;

/// Every fault that `read` throws, as pointer to detail; empty if it throws none.
template <typename Read>
std::multimap<std::string, std::string> faults_of(Read&& read) {
  std::multimap<std::string, std::string> faults;
  try {
    read();
  } catch (const InvalidRequest& invalid) {
    for (const Fault& fault : invalid.faults())
      faults.emplace(fault.pointer, fault.detail);
  }
  return faults;
}

inline std::vector<std::string> pointers(const std::multimap<std::string, std::string>& faults) {
  std::vector<std::string> all;
  for (const auto& [pointer, detail] : faults)
    all.push_back(pointer);
  return all;
}

inline std::shared_ptr<const Scenario> read_scenario(std::string_view text) {
  return Scenario::read(json::parse(text));
}

/// Equal bit for bit, so that NaNs compare too.
inline bool identical(const double* left, const double* right, std::size_t count) {
  return count == 0 || std::memcmp(left, right, count * sizeof(double)) == 0;
}
inline bool identical(const State& left, const State& right) {
  return left.size() == right.size() &&
         identical(left.data(), right.data(), static_cast<std::size_t>(left.size()));
}
inline bool identical(const Score& left, const Score& right) {
  return identical(&left.log_constraint, &right.log_constraint, 1) && left.satisfied == right.satisfied &&
         left.measures.size() == right.measures.size() &&
         identical(left.measures.data(), right.measures.data(), left.measures.size());
}

/// A draw from the prior, within its support.
inline State draw_state(const Model& model, RandomStream& random) {
  State state;
  do
    model.draw(random, state);
  while (!std::isfinite(model.log_prior(state)));
  return state;
}

}  // namespace retake::tests
