// WalkCases: a chain of every world and method, for tests that disturb chains.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tests/server/daemon.h"

namespace retake::test {

struct WalkCase {
  const char* name;
  json scenario;
  json chain;
  std::size_t fewest = 50;  ///< samples, fewer of which would not tell chains apart
};

inline json word_document(const std::string& text) {
  return {{"world", "spelling"}, {"constraints", {{{"kind", "spell"}, {"text", text}}}}};
}

/// Every die is to come to rest in the same disc, which is no wider than two dice need.
inline json dice_document(const json& model, double tolerance) {
  json wishes = json::array();
  for (int die = 1; die <= model.at("dice"); ++die)
    wishes.push_back({{"kind", "rest_position"},
                      {"body", "die_" + std::to_string(die)},
                      {"x", 0.12},
                      {"z", 0},
                      {"sd", tolerance},
                      {"tolerance", tolerance}});
  return {{"world", "dice"}, {"model", model}, {"constraints", wishes}};
}

inline json pins_document(const json& rack, const json& down) {
  return {{"world", "bowling"},
          {"model", {{"rack", rack}}},
          {"constraints", {{{"kind", "pins"}, {"down", down}}}}};
}

/// Chains that take a second or more, and find some hundred samples.
inline std::vector<WalkCase> walks() {
  return {
      {"metropolis", wish_document(1, 0.0005),
       json::parse(R"({"seed":11,"method":"metropolis","stop":{"iterations":2500000}})")},
      {"rejection", wish_document(1, 0.002),
       json::parse(R"({"seed":12,"method":"rejection","stop":{"iterations":2500000}})")},
      {"bowling_metropolis", pins_document({1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}),
       json::parse(R"({"seed":13,"method":"metropolis","stop":{"iterations":300}})")},
      {"bowling_rejection", pins_document({10}, {10}),
       json::parse(R"({"seed":14,"method":"rejection","stop":{"iterations":1500}})")},
      // These are cut off in every phase: exploring, a ladder for the first hits or its tuning, sampling.
      {"conditional", wish_document(1, 0.001),
       json::parse(R"({"seed":15,"method":"conditional","stop":{"iterations":500000}})")},
      {"tempering", wish_document(1, 0.002),
       json::parse(R"({"seed":16,"method":"tempering","stop":{"iterations":600000}})")},
      {"bowling_conditional", pins_document({10}, {10}),
       json::parse(R"({"seed":17,"method":"conditional","stop":{"iterations":1500}})")},
      // And this one while it builds, burns in, samples and walks a soft stretch.
      {"spelling_conditional", word_document("I"),
       json::parse(R"({"seed":18,"method":"conditional","stop":{"iterations":1500}})")},
      // Draws that are placed, and dice that may meet.
      {"dice_placed", dice_document({{"dice", 1}}, 0.02),
       json::parse(R"({"seed":19,"method":"conditional","stop":{"iterations":6000}})"), 15},
      {"dice_guided", dice_document({{"dice", 2}}, 0.02),
       json::parse(R"({"seed":20,"method":"conditional","stop":{"iterations":9000}})"), 8}};
}

}  // namespace retake::test
