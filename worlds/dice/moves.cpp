// See moves.h.
#include "worlds/dice/moves.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "worlds/dice/die_kernels.h"

namespace retake::dice {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class DiceGuide final : public Guide {
 public:
  explicit DiceGuide(Known known) : known_(std::move(known)) {
    kernels_ = make_die_kernels(known_);
    order_ = order_of_places();
  }
  DiceGuide(const DiceGuide&) = delete;
  DiceGuide& operator=(const DiceGuide&) = delete;

  /// Dice that are to be brought to their places one by one are out of the way until then, behind the start.
  void begin(const Model& model, State& state, RandomStream& random) const override {
    do
      model.draw(random, state);
    while (!model.in_support(state));
    for (std::size_t die = 0; die < known_.dice(); ++die)
      put_behind(die, state);
  }

  void extend(const Model& model, const Simulated& kept, std::uint64_t vain_tries, State& candidate,
              RandomStream& random) const override {
    if (!kept.run || !tumble(kept).complete) return begin(model, candidate, random);
    const std::size_t die = first_off(kept).value_or(random.index(known_.dice()));
    // Chosen: how far a die may be [m] if a little of its launch or a few touches are to bring it there.
    constexpr double kNear = 0.01;
    constexpr std::uint64_t kPatience = 150, kThrows = 1000;
    const double missed = off(kept, die);
    const std::uint64_t patience = missed > kNear ? kThrows : kPatience;
    if (vain_tries > 0 && vain_tries % patience == 0)
      return give_up(die, missed > kNear || random.bernoulli(0.2), candidate, random);
    if (random.bernoulli(0.25)) return redraw_end(kept, die, candidate, random);
    // A throw's end answers to the smallest of steps, but remains somewhere near.
    const double size = missed > kNear ? 1 : std::pow(10, -4 * random.uniform());
    walk_launch(*known_.model, die, size, candidate, random);
  }

  /// Of the dice in their order the first that is not as far from its wish as before decides; small steps
  /// would lead nowhere.
  bool keeps(const Simulated& kept, const Simulated& candidate) const override {
    constexpr double kProgress = 0.85;  // chosen
    if (!tumble(kept).complete || is_given_up(kept.state, candidate.state)) return true;
    for (const std::size_t die : order_) {
      const double before = off(kept, die), after = off(candidate, die);
      if (before != after) return after <= kProgress * before;
    }
    return !first_off(kept) && candidate.score.log_constraint > kept.score.log_constraint;
  }

  /// A die that is to be brought to its place is of no use if it meets another one.
  std::unique_ptr<Watch> watch(const Simulated& kept, const State& candidate,
                               RandomStream& random) const override {
    if (!kept.run || !tumble(kept).complete || is_given_up(kept.state, candidate)) return nullptr;
    const std::optional<std::size_t> die = first_off(kept);
    if (!die) return nullptr;
    if (die_thrown_anew(*known_.model, kept.state, candidate))
      return watch_throw(known_, *die, false, candidate, random);
    return watch_meetings(*die, random);
  }

  const ScoredKernelTable& kernels() const override { return kernels_; }
  const ScoredKernelTable& soft_kernels() const override { return soft_kernels_; }
  std::uint64_t sweep() const override { return 20 * known_.dice(); }  // chosen

  /// Whether some die, on average over what is seen of its throw, is elsewhere. How it turns is left out.
  bool differ(const Model&, const Simulated& a, const Simulated& b) const override {
    constexpr double kElsewhere = 0.004;  // [m] chosen: a quarter of a usual die's side
    constexpr double kSeen = 0.6;         // [s] from its launch on; chosen: then most dice rest
    constexpr int kLooks = 18;            // chosen: 30 a second
    const Placement placement_a = known_.model->read(a.state).placement;
    const Placement placement_b = known_.model->read(b.state).placement;
    for (std::size_t die = 0; die < known_.dice(); ++die) {
      const DiePath &path_a = *tumble(a).paths[die], &path_b = *tumble(b).paths[die];
      double apart = 0;
      for (int look = 0; look < kLooks; ++look) {
        const std::int64_t steps = known_.steps(kSeen * look / kLooks);
        const Vector3d at_a = placement_a.point(path_a.at(path_a.launch_step + steps).position);
        const Vector3d at_b = placement_b.point(path_b.at(path_b.launch_step + steps).position);
        apart += (at_a - at_b).norm() / kLooks;
      }
      if (apart > kElsewhere) return true;
    }
    return false;
  }

  bool reads_runs() const override { return true; }
  bool places() const override {
    return known_.model->settings().random_paint &&
           std::any_of(known_.wishes.begin(), known_.wishes.end(),
                       [](const EndWish& wish) { return wish.face; });
  }
  bool place(const Simulated& drawn, State& candidate, RandomStream& random) const override {
    for (std::size_t die = 0; die < known_.dice(); ++die)
      if (miss(drawn, die, 1 + 1e-9) > 0) return false;
    for (std::size_t die = 0; die < known_.dice(); ++die) {
      double& paint = at(candidate, known_.model->paint(die));
      const auto& face = known_.wishes[die].face;
      if (!face) {
        paint = static_cast<double>(kPaints) * random.uniform();
        continue;
      }
      const auto painted = std::min(static_cast<std::size_t>(paint), kPaints - 1);
      const double up = drawn.score.measures[known_.measures.top_face + die];
      const auto fitting = paints_that_show(*face, painted, static_cast<int>(up), false);
      paint = static_cast<double>(fitting[random.index(fitting.size())]) + random.uniform();
    }
    return true;
  }

 private:
  /// The farthest first, then those among others: what lies there already is in the way.
  std::vector<std::size_t> order_of_places() const {
    Vector2d centre = Vector2d::Zero();
    int places = 0;
    for (const EndWish& wish : known_.wishes)
      if (wish.place) {
        centre += Vector2d(wish.place->x, wish.place->z);
        ++places;
      }
    const auto urgency = [&](std::size_t die) {
      constexpr double kAmongOthers = 0.5;  // chosen: half as important as the distance
      const auto& place = known_.wishes[die].place;
      if (!place) return -1.0;
      const Vector2d at(place->x, place->z);
      return at.norm() - kAmongOthers * (at - centre / places).norm();
    };
    std::vector<std::size_t> order(known_.dice());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return urgency(a) > urgency(b); });
    return order;
  }
  /// [m] beyond so much of what is tolerated; a die that shows no face, or a wrong one that cannot be painted
  /// over, is a die's width farther.
  double miss(const Simulated& simulated, std::size_t die, double share = 0.999) const {
    constexpr double kFar = 1, kWidth = 0.02;  // [m]
    const std::vector<double>& measures = simulated.score.measures;
    const double x = measures[known_.measures.rest_x + die], z = measures[known_.measures.rest_z + die];
    if (std::isnan(x)) return kFar;
    const EndWish& wish = known_.wishes[die];
    double miss = 0;
    if (wish.place)
      miss = std::max(std::hypot(x - wish.place->x, z - wish.place->z) - share * wish.place->radius, 0.0);
    const double up = measures[known_.measures.top_face + die];
    const bool is_wrong = std::isnan(up) || (!known_.model->settings().random_paint && up != wish.face);
    return wish.face && is_wrong ? miss + kWidth : miss;
  }
  /// While dice are brought to their places they shall not meet: then each can be moved by itself.
  double off(const Simulated& simulated, std::size_t die) const {
    constexpr double kMet = 0.02;  // [m]
    const double missed = miss(simulated, die);
    return meets_since(tumble(simulated), die, 0) ? missed + kMet : missed;
  }
  std::optional<std::size_t> first_off(const Simulated& simulated) const {
    const auto found =
        std::find_if(order_.begin(), order_.end(), [&](std::size_t die) { return off(simulated, die) > 0; });
    return found == order_.end() ? std::nullopt : std::optional(*found);
  }

  /// What a die alone touches for the first time after some time becomes another table.
  void redraw_end(const Simulated& kept, std::size_t die, State& candidate, RandomStream& random) const {
    const Tumble& run = tumble(kept);
    const std::vector<FirstTouch>& touches = run.paths[die]->touches;
    if (touches.empty()) return;
    const std::int64_t first = touches.front().step, length = touches.back().step - first + 1;
    const std::int64_t from =
        first + static_cast<std::int64_t>(random.index(static_cast<std::uint64_t>(length)));
    for (const FirstTouch& touch : touches) {
      const auto index = index_in_patch(touch.place);
      if (touch.step < from || !index || others_touch(run, die, touch.place)) continue;
      set_point(*known_.model, *index, draw_control_point(known_.model->settings().table, random), candidate);
    }
  }
  static bool others_touch(const Tumble& run, std::size_t die, GridPlace place) {
    for (std::size_t other = 0; other < run.paths.size(); ++other) {
      const std::vector<FirstTouch>& touches = run.paths[other]->touches;
      if (other != die && std::any_of(touches.begin(), touches.end(),
                                      [place](const FirstTouch& touch) { return touch.place == place; }))
        return true;
    }
    return false;
  }

  /// Takes a die that nothing helps away, and another one if they may be in its way.
  void give_up(std::size_t die, bool takes_another, State& candidate, RandomStream& random) const {
    put_behind(die, candidate);
    if (!takes_another) return;
    std::vector<std::size_t> others;
    for (std::size_t other = 0; other < known_.dice(); ++other)
      if (other != die && !is_behind(other, candidate)) others.push_back(other);
    if (!others.empty()) put_behind(others[random.index(others.size())], candidate);
  }
  void put_behind(std::size_t die, State& state) const {
    const DiceModel& model = *known_.model;
    at(state, model.velocity_x(die)) = -model.settings().speed;
  }
  bool is_behind(std::size_t die, const State& state) const {
    return at(state, known_.model->velocity_x(die)) == -known_.model->settings().speed;
  }
  bool is_given_up(const State& before, const State& after) const {
    for (std::size_t die = 0; die < known_.dice(); ++die)
      if (!is_behind(die, before) && is_behind(die, after)) return true;
    return false;
  }

  Known known_;
  ScoredKernelTable kernels_, soft_kernels_;
  std::vector<std::size_t> order_;  ///< in which dice are brought to their places
};

}  // namespace

std::shared_ptr<const Guide> make_dice_guide(std::shared_ptr<const DiceModel> model,
                                             const EngineSettings& engine, std::vector<EndWish> wishes,
                                             const EndMeasures& measures) {
  return std::make_shared<const DiceGuide>(
      Known{.model = std::move(model), .engine = engine, .wishes = std::move(wishes), .measures = measures});
}

}  // namespace retake::dice
