// See painting.h.
#include "worlds/dice/painting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sampler/check.h"
#include "worlds/dice/placement.h"

namespace retake::dice {
namespace {

constexpr int kFaces = 6;

}  // namespace

bool FaceWish::is_wish() const {
  return sum || std::any_of(faces.begin(), faces.end(), [](const auto& face) { return face.has_value(); });
}

Painting::Painting(std::shared_ptr<const DiceModel> model, FaceWish wish, const EndMeasures& measures)
    : model_(std::move(model)), wish_(std::move(wish)), measures_(measures) {
  CHECK(model_->settings().random_paint && wish_.faces.size() == model_->settings().dice, wish_.faces.size());
  // From the last die on.
  const auto sums = static_cast<std::size_t>(wish_.sum.value_or(0)) + 1;
  ways_.assign(wish_.faces.size() + 1, std::vector<double>(sums, 0.0));
  ways_.back()[0] = 1;
  for (std::size_t die = wish_.faces.size(); die-- > 0;)
    for (std::size_t rest = 0; rest < sums; ++rest)
      for (int face = 1; face <= kFaces; ++face)
        if (may_show(die, face))
          ways_[die][rest] += ways(die + 1, wish_.sum ? static_cast<int>(rest) - face : 0);
  log_weight_ = std::log(ways(0, wish_.sum.value_or(0))) -
                static_cast<double>(wish_.faces.size()) * std::log(static_cast<double>(kFaces));
}

double Painting::ways(std::size_t die, int rest) const {
  return rest < 0 ? 0 : ways_[die][static_cast<std::size_t>(rest)];
}

double Painting::place(const State& drawn, const Score& score, State& candidate, RandomStream& random) const {
  if (log_weight_ == -std::numeric_limits<double>::infinity()) return log_weight_;
  int rest = wish_.sum.value_or(0);
  for (std::size_t die = 0; die < wish_.faces.size(); ++die) {
    // A face by the ways that it leaves to the others.
    double mark = random.uniform() * ways(die, rest);
    int chosen = 0;
    for (int face = 1; face <= kFaces && mark >= 0; ++face) {
      const double left = may_show(die, face) ? ways(die + 1, wish_.sum ? rest - face : 0) : 0;
      if (left == 0) continue;
      chosen = face;
      mark -= left;
    }
    CHECK(chosen > 0, die, rest);
    if (wish_.sum) rest -= chosen;
    const double up = score.measures[measures_.top_face + die];
    if (std::isnan(up)) continue;  // it leans, and satisfies no wish of a face
    double& paint = at(candidate, model_->paint(die));
    const auto painted = std::min(static_cast<std::size_t>(at(drawn, model_->paint(die))), kPaints - 1);
    const auto fitting = paints_that_show(chosen, painted, static_cast<int>(up), false);
    paint = static_cast<double>(fitting[random.index(fitting.size())]) + random.uniform();
  }
  return log_weight_;
}

}  // namespace retake::dice
