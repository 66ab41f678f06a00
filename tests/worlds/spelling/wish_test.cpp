// The wishes of the world `spelling`: documents and their faults, scores, bounds, and what they show.
#include "worlds/spelling/wish.h"

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

using spelling::BinPattern;
using spelling::Wish;

json document(const json& constraints, const json& model = {{"columns", 7}, {"rows", 5}}) {
  return {{"world", "spelling"}, {"model", model}, {"constraints", constraints}};
}
json spell(const std::string& text) {
  return {{"kind", "spell"}, {"text", text}};
}
std::multimap<std::string, std::string> faults_of_document(const json& constraints,
                                                           const json& model = {{"columns", 7},
                                                                                {"rows", 5}}) {
  return faults_of([&] { Scenario::read(document(constraints, model)); });
}

// --- Documents ------------------------------------------------------------------------------------

TEST(SpellingWish, AModelHasAsManyBallsAsItsLargestWishDesignates) {
  const auto balls = [](const json& constraints, const json& model) {
    return Scenario::read(document(constraints, model))->document().at("model").at("balls").get<int>();
  };
  const json small = {{"columns", 7}, {"rows", 5}}, large = {{"columns", 40}, {"rows", 7}};
  EXPECT_EQ(balls(json::array({spell("HI")}), small), 10);
  EXPECT_EQ(balls(json::array({spell("HOMEMADE")}), large), 85);
  EXPECT_EQ(balls({spell("HI"), spell("hi")}, small), 10);
  EXPECT_EQ(balls(json::array(), small), 10);
  EXPECT_EQ(balls(json::array(), {{"columns", 2}, {"rows", 1}}), 2);
  EXPECT_EQ(balls(json::array({spell("HI")}), {{"columns", 7}, {"rows", 5}, {"balls", 12}}), 12);
}

TEST(SpellingWish, ABoxWithoutASizeHasRoomForTheText) {
  const auto model_of = [](const json& constraints, const json& model) {
    return Scenario::read(document(constraints, model))->document().at("model");
  };
  const auto size = [&](const json& constraints, const json& model = json::object()) {
    const json fitted = model_of(constraints, model);
    return std::pair(fitted.at("columns").get<int>(), fitted.at("rows").get<int>());
  };
  using Size = std::pair<int, int>;
  EXPECT_EQ(size(json::array()), Size(7, 5));
  EXPECT_EQ(size(json::array({spell("HI")})), Size(7, 5));
  EXPECT_EQ(size(json::array({spell("ACM")})), Size(15, 7));
  EXPECT_EQ(size(json::array({spell("acm")})), Size(15, 7));
  EXPECT_EQ(size({spell("ACM"), spell("acm")}), Size(15, 7));
  EXPECT_EQ(size(json::array({spell("HOMEMADE")})).second, 7);
  EXPECT_EQ(model_of(json::array({spell("ACM")}), json::object()).at("balls"), 30);
  // Whoever says a size means it.
  EXPECT_EQ(size(json::array({spell("ACM")}), {{"columns", 20}, {"rows", 6}}), Size(20, 6));
  for (const json& model : {json({{"columns", 7}}), json({{"rows", 5}})})
    EXPECT_EQ(pointers(faults_of_document(json::array({spell("ACM")}), model)),
              (std::vector<std::string>{"/constraints/0/text"}))
        << model;
}

TEST(SpellingWish, ABoxWithoutASizeIsThatOfTheWishedBins) {
  const auto bins = [](const std::vector<std::string>& rows) {
    return json{{"kind", "bins"}, {"rows", rows}};
  };
  const auto model_of = [](const json& constraints) {
    return Scenario::read(document(constraints, json::object()))->document().at("model");
  };
  for (int columns = 1; columns <= spelling::kMostColumns; columns += 3)
    for (int rows = 1; rows <= spelling::kMostRows; rows += 2) {
      std::vector<std::string> lines(static_cast<std::size_t>(rows),
                                     std::string(static_cast<std::size_t>(columns), '.'));
      lines.back().back() = '#';
      const json model = model_of(json::array({bins(lines)}));
      EXPECT_EQ(model.at("columns"), columns);
      EXPECT_EQ(model.at("rows"), rows);
      EXPECT_EQ(model.at("balls"), 1);
    }
  // Whoever says a size means it, and one that no box has is refused where it is.
  EXPECT_EQ(pointers(faults_of_document(json::array({bins({"##"})}), {{"columns", 3}})),
            (std::vector<std::string>{"/constraints/0/rows", "/constraints/0/rows/0"}));
  EXPECT_EQ(pointers(faults_of_document(json::array({bins({"##", "#"})}), json::object())),
            (std::vector<std::string>{"/constraints/0/rows/1"}));
  EXPECT_FALSE(faults_of_document(json::array({bins({std::string(41, '#')})}), json::object()).empty());
  // A text beside them is laid out in their box.
  const std::vector<std::string> hi = {".#.#.###.", ".###..#..", ".#.#.###."};
  EXPECT_EQ(model_of(json::array({bins(hi)})).at("columns"), 9);
  EXPECT_EQ(pointers(faults_of_document(json::array({spell("WWWW"), bins({"##"})}), json::object())),
            (std::vector<std::string>{"/constraints/0/text"}));
}

TEST(SpellingWish, ATextThatNoBoxHasRoomForIsRefusedWithTheSizeItNeeds) {
  const std::string fault = faults_of_document(json::array({spell("INCOMPREHENSIBLE")}), json::object())
                                .find("/constraints/0/text")
                                ->second;
  const spelling::TextSize least = spelling::least_size("INCOMPREHENSIBLE");
  EXPECT_GT(least.columns, spelling::kMostColumns);
  EXPECT_EQ(fault, "needs " + std::to_string(least.columns) + " columns and " + std::to_string(least.rows) +
                       " rows, the largest box has 40 columns and 12 rows");
}

TEST(SpellingWish, EqualWishesAreEqualDocuments) {
  const json filled = Scenario::read(document(json::array({spell("hi")})))->document();
  EXPECT_EQ(filled, Scenario::read(document(json::array({spell("HI")})))->document());
  EXPECT_EQ(filled, Scenario::read({{"world", "spelling"},
                                    {"title", filled.at("title")},
                                    {"model", filled.at("model")},
                                    {"constraints", filled.at("constraints")}})
                        ->document());
  EXPECT_EQ(filled.at("constraints").at(0), json({{"kind", "spell"}, {"text", "HI"}, {"log_lambda", 5.0}}));
}

TEST(SpellingWish, LogLambdaGrowsWithTheBalls) {
  EXPECT_EQ(spelling::default_log_lambda(1), 5);
  EXPECT_EQ(spelling::default_log_lambda(10), 5);
  EXPECT_EQ(spelling::default_log_lambda(30), 7.25);
  EXPECT_EQ(spelling::default_log_lambda(85), 9.25);
  const auto given = Scenario::read(document({{{"kind", "spell"}, {"text", "HI"}, {"log_lambda", 0}}}));
  EXPECT_EQ(given->document().at("constraints").at(0).at("log_lambda"), 0);
}

TEST(SpellingWish, EveryFaultIsSaidAtItsPlace) {
  const auto faults = faults_of_document(
      {spell("ACM"),
       spell("H\xc3\xa9"),
       spell("  "),
       spell(""),
       {{"kind", "bins"}, {"rows", {"#.x....", "#"}}},
       {{"kind", "bins"}, {"rows", {".......", ".......", ".......", ".......", "......."}}},
       {{"kind", "bins"}}});
  EXPECT_EQ(pointers(faults), (std::vector<std::string>{
                                  "/constraints/0/text", "/constraints/1/text", "/constraints/2/text",
                                  "/constraints/3/text", "/constraints/4/rows", "/constraints/4/rows/0",
                                  "/constraints/4/rows/1", "/constraints/5/rows", "/constraints/6/rows"}));
  EXPECT_EQ(faults.find("/constraints/0/text")->second,
            "needs 13 columns and 3 rows, the box has 7 columns and 5 rows");
  EXPECT_NE(faults.find("/constraints/1/text")->second.find("\xc3\x89") == std::string::npos
                ? faults.find("/constraints/1/text")->second.find("\xc3\xa9")
                : 0,
            std::string::npos)
      << "the character is named";
}

TEST(SpellingWish, FaultsOfTheModelAreSaid) {
  const auto places = [](const json& model, const json& constraints = json::array()) {
    return pointers(faults_of_document(constraints, model));
  };
  using Places = std::vector<std::string>;
  EXPECT_EQ(places({{"tessellation", 3}}), Places{"/model/tessellation"});
  EXPECT_EQ(places({{"columns", 41}, {"rows", 0}}), (Places{"/model/columns", "/model/rows"}));
  EXPECT_EQ(places({{"columns", 2}, {"rows", 1}, {"balls", 3}}), Places{"/model/balls"});
  EXPECT_EQ(places({{"balls", 9}}, json::array({spell("HI")})), Places{"/constraints/0/text"});
  EXPECT_EQ(places({{"balls", "many"}, {"interval", 0}}, json::array({spell("HI")})),
            (Places{"/model/balls", "/model/interval"}));
  for (const json& model : {json(3), json::array(), json(nullptr)})
    EXPECT_EQ(places(model, json::array({spell("HI")})), Places{"/model"});
  for (const json& constraint : {json(3), json::array(), json({{"kind", 3}}), json({{"kind", "face_up"}})})
    EXPECT_EQ(places(json::object(), json::array({constraint})).size(), 1u) << constraint;
  for (const json& constraint :
       {json({{"kind", "spell"}, {"text", 3}}), json({{"kind", "bins"}, {"rows", 3}}),
        json({{"kind", "bins"}, {"rows", {3}}})})
    EXPECT_FALSE(places(json::object(), json::array({constraint})).empty()) << constraint;
}

// --- Scores ---------------------------------------------------------------------------------------

constexpr double kLogLambda = 3;

/// A wish for two bins of a box of three, and animations of balls that lie in bins of it.
struct WishOfTwo {
  std::shared_ptr<const spelling::Box> box =
      std::make_shared<const spelling::Box>(3, 1, spelling::Tessellation::one);
  Wish wish{box, spelling::pattern_of({"#.#"}), kLogLambda, "/rows", 3};

  static constexpr int kOnOthers = -1, kMoving = -2;
  Animation animation(const std::vector<int>& bins) const {
    Animation made;
    for (const int bin : bins) {
      Track& track = made.tracks.emplace_back();
      if (bin == kMoving) continue;
      const spelling::Rectangle opening = box->opening(bin < 0 ? 0 : static_cast<std::size_t>(bin));
      track.rest.position = {(opening.min_x + opening.max_x) / 2, bin < 0 ? 0.0187 : 0.007, 0};
      track.settled = 1;
    }
    return made;
  }
  struct Said {
    TermScore score;
    double filled, stray;
  };
  Said say(const std::vector<int>& bins) const {
    std::vector<double> values(wish.measures().size());
    const TermScore score = wish.score(animation(bins), values);
    return {score, values[0], values[1]};
  }
  double bound(const std::vector<int>& bins) const { return wish.upper_bound(animation(bins)); }
};

TEST(SpellingWish, CountsDesignatedBinsThatHoldExactlyOneBall) {
  const WishOfTwo of_two;
  const auto whole = of_two.say({2, 0});
  EXPECT_EQ(whole.score.log_density, 0);
  EXPECT_TRUE(whole.score.satisfied);
  EXPECT_EQ(whole.filled, 2);
  EXPECT_EQ(whole.stray, 0);
  struct Case {
    std::vector<int> bins;
    double filled, stray;
  };
  for (const auto& [bins, filled, stray] :
       {Case{{}, 0, 0}, Case{{0}, 1, 0}, Case{{0, 1}, 1, 1}, Case{{1, 1}, 0, 2}, Case{{0, 0}, 0, 2},
        Case{{0, WishOfTwo::kOnOthers}, 1, 1}}) {
    const auto said = of_two.say(bins);
    EXPECT_EQ(said.filled, filled);
    EXPECT_EQ(said.stray, stray);
    EXPECT_EQ(said.score.log_density, (filled - 2) * kLogLambda);
    EXPECT_FALSE(said.score.satisfied);
  }
  const auto too_many = of_two.say({0, 2, 1});
  EXPECT_EQ(too_many.score.log_density, 0);
  EXPECT_FALSE(too_many.score.satisfied) << "a ball lies elsewhere";
}

TEST(SpellingWish, TheBoundFallsWithEveryBallThatIsLostAndNeverBelowTheScore) {
  const WishOfTwo of_two;
  constexpr int kMoving = WishOfTwo::kMoving;
  EXPECT_EQ(of_two.bound({kMoving, kMoving}), 0);
  EXPECT_EQ(of_two.bound({kMoving}), -kLogLambda) << "too few balls";
  EXPECT_EQ(of_two.bound({kMoving, 1}), -kLogLambda) << "one lies elsewhere";
  EXPECT_EQ(of_two.bound({0, kMoving}), 0);
  EXPECT_EQ(of_two.bound({kMoving, kMoving, kMoving}), 0) << "one more than needed";
  // Every way in which three balls may come to rest, one after the other.
  for (int a = -1; a < 3; ++a)
    for (int b = -1; b < 3; ++b)
      for (int c = -1; c < 3; ++c) {
        const std::vector<int> bins = {a, b, c};
        const double score = of_two.say(bins).score.log_density;
        for (unsigned moving = 0; moving < 8; ++moving) {
          std::vector<int> so_far = bins;
          for (std::size_t i = 0; i < 3; ++i)
            if (moving >> i & 1) so_far[i] = kMoving;
          // Two balls in one bin fill none, so the bound must not count on that either.
          EXPECT_GE(of_two.bound(so_far), score) << a << b << c << " moving " << moving;
        }
        EXPECT_EQ(of_two.bound(bins), score);
      }
}

TEST(SpellingWish, ShowsTheFloorsOfTheDesignatedBins) {
  const WishOfTwo of_two;
  const std::vector<Body> markers = of_two.wish.markers({});
  ASSERT_EQ(markers.size(), 1u);
  const Mesh& mesh = std::get<Mesh>(markers[0].shape);
  std::array<int, 3> corners{};
  for (const std::uint32_t index : mesh.indices) {
    const Eigen::Vector3d place(mesh.positions[3 * index], 0.005, mesh.positions[3 * index + 2]);
    for (std::size_t bin = 0; bin < 3; ++bin)
      corners[bin] += of_two.box->opening(bin).contains(place.x(), place.z()) ? 1 : 0;
  }
  EXPECT_EQ(corners, (std::array<int, 3>{24, 0, 24})) << "eight triangles a floor";
}

}  // namespace
}  // namespace retake::tests
