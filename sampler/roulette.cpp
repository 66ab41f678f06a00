// See roulette.h.
#include "sampler/roulette.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sampler/check.h"

namespace retake {
namespace {

// Chosen: a cell has as many simulations more, of what its checkpoint has on the whole.
constexpr double kSmoothing = 4;
constexpr double kLeast = 0.02;     // chosen: nothing weighs more than 50 times what it would
constexpr double kSureShare = 0.3;  // chosen: of the most promising, what survives for sure

}  // namespace

Roulette::Roulette(std::size_t checkpoints, std::size_t bins)
    : bins_(bins), cells_(checkpoints * bins), survivals_(checkpoints * bins, 1) {}

void Roulette::learn(const std::vector<Visit>& visits, double weight, double seconds) {
  CHECK(!is_frozen_);
  for (const Visit& visit : visits) {
    Cell& cell = cells_.at(visit.checkpoint * bins_ + visit.bin);
    cell.square += weight * weight;
    cell.seconds += seconds - visit.seconds;
    ++cell.count;
  }
}

void Roulette::freeze() {
  for (std::size_t first = 0; first < cells_.size(); first += bins_) {
    Cell all;
    for (std::size_t bin = 0; bin < bins_; ++bin) {
      all.square += cells_[first + bin].square;
      all.seconds += cells_[first + bin].seconds;
      all.count += cells_[first + bin].count;
    }
    double most = 0;
    for (std::size_t bin = 0; bin < bins_ && all.square > 0 && all.seconds > 0; ++bin) {
      const Cell& cell = cells_[first + bin];
      const double square = cell.square + kSmoothing * all.square / all.count;
      const double seconds = cell.seconds + kSmoothing * all.seconds / all.count;
      survivals_[first + bin] = std::sqrt(square / seconds);
      most = std::max(most, survivals_[first + bin]);
    }
    for (std::size_t bin = 0; bin < bins_ && most > 0; ++bin)
      survivals_[first + bin] = std::clamp(survivals_[first + bin] / (kSureShare * most), kLeast, 1.0);
  }
  cells_.clear();
  is_frozen_ = true;
}

double Roulette::survival(std::size_t checkpoint, std::size_t bin) const {
  return is_frozen_ ? survivals_.at(checkpoint * bins_ + bin) : 1;
}

void Roulette::write(ByteWriter& out) const {
  out.put(static_cast<std::uint8_t>(is_frozen_));
  if (is_frozen_) {
    out.put_numbers(survivals_.data(), survivals_.size());
    return;
  }
  for (const Cell& cell : cells_) {
    out.put(cell.square);
    out.put(cell.seconds);
    out.put(cell.count);
  }
}

void Roulette::read(ByteReader& in) {
  is_frozen_ = in.get<std::uint8_t>() != 0;
  if (is_frozen_) {
    Eigen::VectorXd survivals;
    in.get_numbers(survivals);
    if (static_cast<std::size_t>(survivals.size()) != survivals_.size())
      throw std::out_of_range("another number of survivals");
    survivals_.assign(survivals.begin(), survivals.end());
    for (const double survival : survivals_)
      if (!(survival > 0 && survival <= 1)) throw std::out_of_range("a survival that cannot be");
    cells_.clear();
    return;
  }
  for (Cell& cell : cells_) {
    cell.square = in.get<double>();
    cell.seconds = in.get<double>();
    cell.count = in.get<double>();
  }
}

}  // namespace retake
