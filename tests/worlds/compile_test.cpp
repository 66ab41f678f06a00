// What a document says decides what it costs to simulate, never what it costs to read: every number of every
// document is set to its extremes, alone and in pairs, and reading answers at once, whatever it answers.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "worlds/parameters.h"
#include "worlds/scenario.h"

namespace retake::tests {
namespace {

using nlohmann::json;

// [s] of CPU time. Measured: 0.02 s for the slowest one; under a sanitizer ten times as much. What this is to
// find takes minutes.
constexpr double kAtOnce = 1;

double thread_seconds() {
  std::timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Documents whose numbers are walked: a wish of every kind of term.
std::vector<json> documents() {
  const auto text = R"([
    {"world": "ball2d", "constraints": [{"kind": "rest_position", "x": 1}]},
    {"world": "ball2d", "constraints": [{"kind": "state_at", "time": 1, "position": [0.5, 0.2, 0], "velocity": [1, 0, 0]},
      {"kind": "inside", "box": {"low": [-1, 0, 0], "high": [1, 2, 0]}, "from": 0, "to": 1}]},
    {"world": "bowling", "constraints": [{"kind": "pins", "down": [6, 7]}]},
    {"world": "bowling", "model": {"release": "modern"}, "constraints": [
      {"kind": "rest_position", "body": "pin_1", "x": 19, "z": 0.2},
      {"kind": "contact_at", "body": "ball", "bpm": 120}]},
    {"world": "spelling", "constraints": [{"kind": "spell", "text": "HI"}]},
    {"world": "spelling", "constraints": [{"kind": "contact_at", "body": "marble_1", "times": [0.5]}]},
    {"world": "dice", "constraints": [{"kind": "rest_position", "x": 0.12, "z": 0.03}, {"kind": "face_up", "face": 6}]},
    {"world": "dice", "model": {"pose": "fixed"}, "constraints": [{"kind": "rest_position", "x": 0.12, "z": 0.03}]},
    {"world": "dice", "model": {"dice": 2}, "constraints": [
      {"kind": "rest_position", "body": "die_1", "x": 0.12, "z": 0.03},
      {"kind": "rest_position", "body": "die_2", "x": 0.12, "z": -0.03},
      {"kind": "contact_at", "body": "die_1", "times": [0.5], "from": "start"}]},
    {"world": "dice", "model": {"dice": 3}, "constraints": [{"kind": "total", "sum": 9}]}
  ])";
  std::vector<json> all;
  for (const json& document : json::parse(text)) {
    all.push_back(document);
    try {
      all.back() = Scenario::read(document)->document();  // with every field in it
      all.back().erase("world_version");
    } catch (const InvalidRequest& fault) {
      ADD_FAILURE() << document << ": " << fault.what();
    }
  }
  return all;
}

/// JSON Pointers to all numbers of the model and of the wishes.
void collect_numbers(const json& value, const std::string& pointer, std::vector<std::string>& found) {
  if (value.is_number()) found.push_back(pointer);
  if (value.is_object())
    for (const auto& [key, member] : value.items())
      collect_numbers(member, pointer + "/" + key, found);
  if (value.is_array())
    for (std::size_t i = 0; i < value.size(); ++i)
      collect_numbers(value[i], pointer + "/" + std::to_string(i), found);
}

/// The bounds that faults name, and powers of ten, which bounds mostly are.
const std::vector<double>& extremes() {
  static const std::vector<double> values = [] {
    std::vector<double> all{0, 1e-300, 1e-12, 0.95, 0.999, 2, 3, 60, 100, 240, 480, 1e12, 1e300};
    for (int power = -9; power <= 6; ++power) {
      all.push_back(std::pow(10, power));
      all.push_back(5 * std::pow(10, power));
    }
    const std::size_t count = all.size();
    for (std::size_t i = 0; i < count; ++i)
      all.push_back(-all[i]);
    return all;
  }();
  return values;
}

class Reading {
 public:
  /// Reads a document and makes what chains would walk on.
  void read(const json& document) {
    const double begin = thread_seconds();
    try {
      const auto scenario = Scenario::read(document);
      for (const Ratios ratios : kRatios)
        EXPECT_NE(scenario->target(ratios), nullptr);
      ++taken_;
    } catch (const InvalidRequest&) {
      ++refused_;
    }
    const double took = thread_seconds() - begin;
    EXPECT_LT(took, kAtOnce) << document;
    slowest_ = std::max(slowest_, took);
  }
  int taken() const { return taken_; }
  int refused() const { return refused_; }
  double slowest() const { return slowest_; }

 private:
  int taken_ = 0, refused_ = 0;
  double slowest_ = 0;
};

TEST(Compiling, CostsWhatTheDocumentsBytesCostWhateverItsNumbersSay) {
  Reading reading;
  for (const json& document : documents()) {
    std::vector<std::string> numbers;
    collect_numbers(document, "", numbers);
    EXPECT_GE(numbers.size(), 3u) << document;
    for (const std::string& pointer : numbers)
      for (const double value : extremes()) {
        json changed = document;
        changed[json::json_pointer(pointer)] =
            value == std::round(value) && std::abs(value) < 1e9 ? json(std::llround(value)) : json(value);
        reading.read(changed);
      }
  }
  EXPECT_GT(reading.taken(), 500);
  EXPECT_GT(reading.refused(), 500);
  std::printf("%d taken, %d refused, the slowest in %.3f s\n", reading.taken(), reading.refused(),
              reading.slowest());
}

TEST(Compiling, CostsNoMoreWhereTwoNumbersAreExtreme) {
  Reading reading;
  for (const json& document : documents()) {
    if (document["world"] != "dice") continue;
    std::vector<std::string> numbers;
    collect_numbers(document, "", numbers);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      for (std::size_t k = i + 1; k < numbers.size(); ++k)
        for (const double first : {1e-9, 1e-6, 1000.0})
          for (const double second : {1e-9, 1e-6, 5.0, 1000.0}) {
            json changed = document;
            changed[json::json_pointer(numbers[i])] = first;
            changed[json::json_pointer(numbers[k])] = second;
            reading.read(changed);
          }
  }
  EXPECT_GT(reading.taken(), 100);
  std::printf("%d taken, %d refused, the slowest in %.3f s\n", reading.taken(), reading.refused(),
              reading.slowest());
}

TEST(Compiling, APlaceThatNothingReachesIsRefusedWithWhatCanBeReached) {
  const auto faults_of = [](const json& document) {
    try {
      Scenario::read(document);
    } catch (const InvalidRequest& refused) {
      return refused.faults();
    }
    return std::vector<Fault>{};
  };
  const auto die_at = [](double x, double z, double tolerance = 0.004) {
    return json{
        {"world", "dice"},
        {"constraints",
         json::array({json{{"kind", "rest_position"}, {"x", x}, {"z", z}, {"tolerance", tolerance}}})}};
  };
  auto faults = faults_of(die_at(12, 3));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].pointer, "/constraints/0/x");
  EXPECT_NE(faults[0].detail.find("centimetres? Then x is 0.12 and z 0.03"), std::string::npos)
      << faults[0].detail;
  faults = faults_of(die_at(-3, -900));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].pointer, "/constraints/0/z");
  EXPECT_EQ(faults[0].detail.find("centimetres"), std::string::npos) << "nor would those be reached";
  EXPECT_TRUE(faults_of(die_at(12, 3, 12)).empty()) << "the disc is wide";
  EXPECT_TRUE(faults_of(die_at(0.5, 0.1)).empty());
  // A die that another one hits takes its energy, and runs until the last one has.
  json hit = die_at(10, 0);
  EXPECT_EQ(faults_of(hit).size(), 1u);
  hit["model"] = {{"dice", 2}};
  hit["constraints"][0]["body"] = "die_1";
  EXPECT_TRUE(faults_of(hit).empty());
  // Who throws harder gets farther.
  json hard = die_at(12, 3);
  hard["model"] = {{"speed", 3}};
  EXPECT_TRUE(faults_of(hard).empty());
}

}  // namespace
}  // namespace retake::tests
