// Views: measures of every kind as JSON, in samples and in traces.
#include "server/views.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/stub_world.h"

namespace retake {
namespace {

using nlohmann::json;

const std::vector<Measure> kMeasures = {{.name = "miss"},
                                        {.name = "strike", .kind = Measure::Kind::flag},
                                        {.name = "fallen", .kind = Measure::Kind::integer_set}};

TEST(Views, MeasuresAreNumbersBooleansAndLists) {
  const auto view = [](std::vector<double> values) { return measures_json(kMeasures, values); };
  EXPECT_EQ(view({0.5, 1, set_of(std::vector<int>{10, 2, 7})}),
            json({{"miss", 0.5}, {"strike", true}, {"fallen", {2, 7, 10}}}));
  EXPECT_EQ(view({-2, 0, set_of({})}), json({{"miss", -2.0}, {"strike", false}, {"fallen", json::array()}}));
  EXPECT_EQ(view({kAbsent, kAbsent, kAbsent}),
            json({{"miss", nullptr}, {"strike", nullptr}, {"fallen", nullptr}}));
  EXPECT_EQ(view({std::numeric_limits<double>::infinity(), 0, 0})["miss"], nullptr);
}

TEST(Views, ATraceHasTheSameJsonAtEveryPoint) {
  const auto scenario = tests::read_stub_scenario({{"world", "stub"}, {"constraints", json::array()}});
  const auto performer = scenario->make_performer();
  Chain chain(scenario->target(Ratios::exact), {.seed = 3, .method = Method::rejection});
  Trace trace(scenario->measures().size());
  for (int i = 0; i < 200; ++i) {
    chain.step(*performer);
    trace.record(chain);
  }
  const json view = trace_json(trace, scenario->measures(), 1000);
  int none = 0;
  ASSERT_EQ(view["x"].size(), 200u);
  for (std::size_t i = 0; i < 200; ++i) {
    const double x = view["x"][i];
    EXPECT_EQ(view["past_the_middle"][i], json(x > 5));
    const json passed = x > 3 ? json({1, 2, 3}) : x > 2 ? json({1, 2}) : x > 1 ? json({1}) : json(nullptr);
    EXPECT_EQ(view["passed"][i], passed) << x;
    none += passed.is_null();
  }
  EXPECT_GT(none, 0);
}

}  // namespace
}  // namespace retake
