// Golden digests: a few animations of every example of every world are the same motion, bit for bit, as when
// golden_digests.txt was written. worlds/README.md says how to renew the table.
//
// The mathematical library chooses other instructions for sin, exp and the like on processors without fused
// multiplication, and rounds the last bit differently there; so each kind of processor has rows of its own.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

constexpr const char* kTable = RETAKE_SOURCE_DIR "/tests/worlds/golden_digests.txt";
constexpr const char* kHead =
    "# kind of processor, world, its version, seed, digest and title of each example; see worlds/README.md\n";

/// What functions of the mathematical library say on a fixed grid: equal where they are rounded alike.
std::string kind_of_processor() {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  const auto add = [&](double value) {
    for (int byte = 0; byte < 8; ++byte) {
      hash ^= std::bit_cast<std::uint64_t>(value) >> (8 * byte) & 0xff;
      hash *= 1099511628211u;
    }
  };
  for (int i = 1; i <= 20000; ++i) {
    const volatile double x = 0.0137 * i;  // volatile: what runs is the library, not the compiler
    add(std::sin(x));
    add(std::cos(x));
    add(std::exp(-0.1 * x));
    add(std::log(x));
    add(std::pow(x, 1.7));
    add(std::atan2(x, 3.1));
  }
  std::ostringstream text;
  text << std::hex;
  text.width(16);
  text.fill('0');
  text << hash;
  return text.str();
}

struct Row {
  std::string kind, world;
  int version = 0;
  std::string seed, digest, title;
  std::string key() const { return kind + " " + world + " " + seed + " " + title; }
};

std::vector<Row> rows_of_table() {
  std::ifstream file(kTable);
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    Row row;
    words >> row.kind >> row.world >> row.version >> row.seed >> row.digest;
    std::getline(words >> std::ws, row.title);
    rows.push_back(row);
  }
  return rows;
}

/// The place in the table of each world's examples, by title: what their random draws begin from. So neither
/// the order of the worlds nor a new example changes a digest.
std::map<std::pair<std::string, std::string>, std::uint64_t> places_in_table() {
  std::map<std::pair<std::string, std::string>, std::uint64_t> places;
  for (const Row& row : rows_of_table())
    places.try_emplace({row.world, row.title}, places.size());
  return places;
}

/// For each example and seed: of a few draws of the prior, the one with the most contacts, played to rest. In
/// the order of the table, new examples last.
std::vector<Row> rows_of_this_build() {
  constexpr int kDraws = 5;
  const std::string kind = kind_of_processor();
  auto places = places_in_table();
  std::map<std::uint64_t, std::vector<Row>> by_place;
  for (const World* world : worlds())
    for (const json& example : world->examples()) {
      const auto scenario = Scenario::read(example);
      const std::string name(world->name());
      const std::uint64_t place = places.try_emplace({name, scenario->title()}, places.size()).first->second;
      const auto performer = scenario->make_performer();
      for (const std::uint64_t seed : {1u, 2u, 3u}) {
        RandomStream random = stream(seed, place);
        std::string liveliest = "failed";
        std::size_t most = 0;
        for (int draw = 0; draw < kDraws; ++draw) {
          const State state = draw_state(scenario->model(), random);
          const auto take = performer->perform(state);
          if (!take.complete || take.animation.events.size() < most) continue;
          most = take.animation.events.size();
          liveliest = digest(state, take.animation);
        }
        by_place[place].push_back(
            {kind, name, world->version(), std::to_string(seed), liveliest, scenario->title()});
      }
    }
  std::vector<Row> rows;
  for (const auto& [place, of_example] : by_place)
    rows.insert(rows.end(), of_example.begin(), of_example.end());
  return rows;
}

/// Motions that changed though their world's version did not rise: older stores would take this build's
/// motions for theirs.
std::vector<std::string> changed_in_silence(const std::vector<Row>& table, const std::vector<Row>& mine) {
  std::vector<std::string> faults;
  for (const Row& row : mine)
    for (const Row& before : table)
      if (before.key() == row.key() && before.digest != row.digest && before.version >= row.version)
        faults.push_back(row.key() + " moves otherwise than in version " + std::to_string(before.version) +
                         " of " + row.world + ": raise its version()");
  return faults;
}

/// Replaces the rows of this kind of processor and keeps those of others.
void renew(const std::vector<Row>& mine) {
  std::vector<Row> rows = rows_of_table();
  for (const std::string& fault : changed_in_silence(rows, mine))
    ADD_FAILURE() << fault;
  if (testing::Test::HasFailure()) return;
  std::erase_if(rows, [&](const Row& row) { return row.kind == mine.front().kind; });
  rows.insert(rows.end(), mine.begin(), mine.end());
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.kind < b.kind; });
  std::ofstream file(kTable);
  file << kHead;
  for (const Row& row : rows)
    file << row.kind << ' ' << row.world << ' ' << row.version << ' ' << row.seed << ' ' << row.digest << ' '
         << row.title << '\n';
  file.close();
  ASSERT_TRUE(file) << "cannot write " << kTable;
  std::printf("wrote %zu rows for processors of kind %s\n", mine.size(), mine.front().kind.c_str());
}

TEST(GoldenDigests, EveryExampleMovesAsItAlwaysDid) {
  const std::vector<Row> mine = rows_of_this_build();
  if (std::getenv("RETAKE_RENEW_GOLDEN")) {
    renew(mine);
    return;
  }
  std::map<std::string, Row> golden;
  std::map<std::string, int> kinds;
  for (const Row& row : rows_of_table()) {
    EXPECT_TRUE(golden.emplace(row.key(), row).second) << "twice in the table: " << row.key();
    ++kinds[row.kind];
  }
  const std::string& kind = mine.front().kind;
  std::string known;
  for (const auto& [name, count] : kinds)
    known += " " + name + " (" + std::to_string(count) + " rows)";
  ASSERT_TRUE(kinds.contains(kind))
      << "no golden digests for processors of kind " << kind << "; there are" << known
      << ". On a build that is known to be right, add rows with\n"
         "  RETAKE_RENEW_GOLDEN=1 build/release/test_worlds --gtest_filter='GoldenDigests.*'";
  for (const Row& row : mine) {
    const auto found = golden.find(row.key());
    if (found == golden.end()) {
      ADD_FAILURE() << "not in the table, which has to be renewed: " << row.key();
      continue;
    }
    EXPECT_EQ(row.digest, found->second.digest)
        << row.key() << "\nIf physics were meant to change: raise the world's version and renew the table.";
    EXPECT_EQ(row.version, found->second.version) << row.key() << ": renew the table";
  }
  EXPECT_EQ(static_cast<std::size_t>(kinds[kind]), mine.size()) << "rows of examples that are no more";
}

TEST(GoldenDigests, AreNotRenewedUnderAnUnchangedVersion) {
  const Row before{"k", "bowling", 2, "1", "aa", "A strike"};
  Row after = before;
  EXPECT_TRUE(changed_in_silence({before}, {after}).empty());
  after.digest = "bb";
  EXPECT_EQ(changed_in_silence({before}, {after}).size(), 1u);
  after.version = 1;
  EXPECT_EQ(changed_in_silence({before}, {after}).size(), 1u) << "a version never falls";
  after.version = 3;
  EXPECT_TRUE(changed_in_silence({before}, {after}).empty());
  after.version = 2;
  after.title = "Another strike";
  EXPECT_TRUE(changed_in_silence({before}, {after}).empty()) << "a new example";
}

}  // namespace
}  // namespace retake::tests
