// See gathered_draws.h.
#include "server/chains/gathered_draws.h"

#include <limits>

#include "db/draw_spacing.h"

namespace retake {

void GatheredDraws::add(const ChainProgress& progress) {
  for (const NewSample& sample : progress.samples) {
    const SampleRecord& record = sample.record;
    samples_[{record.iteration, record.replica}] = {.weight = record.weight,
                                                    .draw = {.iteration = record.iteration,
                                                             .log_prior = record.log_prior,
                                                             .log_constraint = record.log_constraint,
                                                             .measures = record.measures,
                                                             .state = sample.state}};
  }
  for (const WeightUpdate& update : progress.weights)
    samples_.at({update.iteration, update.replica}).weight = update.weight;
}

std::vector<DrawRecord> GatheredDraws::draws(std::size_t most, std::uint64_t from_iteration) const {
  const auto first = samples_.upper_bound({from_iteration, std::numeric_limits<std::uint32_t>::max()});
  std::uint64_t total = 0;
  for (auto place = first; place != samples_.end(); ++place)
    total += place->second.weight;
  DrawSpacing spacing(total, most);
  std::vector<DrawRecord> draws;
  for (auto place = first; place != samples_.end() && !spacing.is_done(); ++place)
    draws.insert(draws.end(), spacing.take(place->second.weight), place->second.draw);
  return draws;
}

}  // namespace retake
