// See total.h.
#include "worlds/dice/total.h"

#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>

#include "worlds/dice/placement.h"
#include "worlds/dice/view.h"

namespace retake::dice {
namespace {

constexpr int kHighest = 6;

class Total final : public Term {
 public:
  Total(int sum, double log_lambda, std::size_t dice) : sum_(sum), log_lambda_(log_lambda), dice_(dice) {}

  std::vector<Measure> measures() const override {
    return {{.name = "total",
             .kind = Measure::Kind::integer,
             .summary = "What the dice show together; none if one leans"}};
  }

  /// A leaning die shows nothing, and misses by as much as a die can show.
  TermScore score(const Animation& animation, std::span<double> values) const override {
    int total = 0, leaning = 0;
    for (const Track& track : animation.tracks) {
      const int face = top_face(track.rest.rotation);
      total += face;
      leaning += face == 0 ? 1 : 0;
    }
    values[0] = leaning == 0 ? total : kAbsent;
    const int miss =
        leaning == 0 ? std::abs(total - sum_) : std::max(std::abs(total - sum_), kHighest * leaning);
    return {.log_density = -log_lambda_ * miss, .satisfied = miss == 0};
  }
  double least_when_satisfied() const override { return 0; }
  Claims claims() const override {
    SumClaim sum{.whats = {}, .least = 1, .most = kHighest, .sum = sum_};
    for (const Roster::Mover& die : roster(dice_).movers)
      sum.whats.push_back(shows(die.name, {}).what);
    return {{.field = "/sum", .demand = NumberClaim{.what = "total", .values = {sum_}}},
            {.field = "/sum", .demand = std::move(sum)}};
  }
  int sum() const { return sum_; }

 private:
  int sum_;
  double log_lambda_;
  std::size_t dice_;
};

}  // namespace

std::optional<int> total_of(const Term& term) {
  const auto* total = dynamic_cast<const Total*>(&term);
  return total ? std::optional(total->sum()) : std::nullopt;
}

TermKind total_term() {
  return {
      .kind = "total",
      .summary = "The faces on top of all dice add up to a sum",
      .parameters = ParameterTable({
          {.name = "sum",
           .kind = Parameter::Kind::integer,
           .minimum = 1,
           .maximum = 36,
           .summary = "What the dice shall show together"},
          {.name = "log_lambda",
           .default_value = 2,
           .minimum = 0,
           .maximum = 100,
           .summary = "How much log p_c falls for each pip that is missing or too many",
           .source = "chosen: a face next to the wanted one is e^-2 as dense"},
      }),
      .make = [](const Parameters& parameters, const Parameters& model, std::string_view pointer,
                 std::vector<Fault>& faults) -> std::unique_ptr<const Term> {
        const std::int64_t sum = parameters.integer("sum"), dice = model.integer("dice");
        if (sum < dice || sum > kHighest * dice) {
          faults.push_back({append_pointer(pointer, "sum"), "must be from " + std::to_string(dice) + " to " +
                                                                std::to_string(kHighest * dice) +
                                                                ", which so many dice can show, got " +
                                                                std::to_string(sum)});
          return nullptr;
        }
        return std::make_unique<const Total>(static_cast<int>(sum), parameters.number("log_lambda"),
                                             static_cast<std::size_t>(dice));
      },
      .sentence =
          [](const Parameters& term, const Parameters&) {
            return "the dice show " + std::to_string(term.integer("sum")) + " together";
          },
  };
}

}  // namespace retake::dice
