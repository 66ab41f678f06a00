// See chain.h.
#include "sampler/chain.h"

#include <stdexcept>
#include <utility>

#include "sampler/check.h"
#include "sampler/methods.h"
#include "sampler/walk.h"

namespace retake {
namespace {

constexpr std::uint32_t kCheckpointVersion = 4;

}  // namespace

Chain::Chain(std::shared_ptr<const Target> target, const ChainSettings& settings)
    : target_(std::move(target)),
      settings_(std::make_unique<const ChainSettings>(settings)),
      counts_(std::make_unique<ChainCounts>()) {
  for (std::string& name : kernel_names(*target_, settings_->method))
    counts_->kernels.push_back({.name = std::move(name)});
  walk_ = make_walk(*target_, *settings_, *counts_);
  if (settings_->lesson.empty()) return;
  try {
    ByteReader in(settings_->lesson);
    if (in.get<std::uint8_t>() != static_cast<std::uint8_t>(settings_->method))
      throw std::out_of_range("it belongs to another method");
    walk_->begin_from(in);
    if (!in.at_end()) throw std::out_of_range("there is more than a lesson");
  } catch (const std::out_of_range& fault) {
    throw std::runtime_error(std::string("lesson cannot be read: ") + fault.what());
  }
}

Chain::~Chain() = default;
Chain::Chain(Chain&&) noexcept = default;
Chain& Chain::operator=(Chain&&) noexcept = default;

bool Chain::step(Simulator& simulator) {
  if (counts_->iteration == 0) walk_->start(simulator);
  ++counts_->iteration;
  check_context().iteration = counts_->iteration;
  return walk_->step(simulator);
}

std::size_t Chain::walkers() const {
  return walk_->walkers().size();
}

std::size_t Chain::walker() const {
  return walk_->walker();
}

std::uint64_t Chain::ended_weight() const {
  return walk_->ended_weight();
}

const Stay& Chain::stay(std::size_t walker) const {
  return walk_->walkers()[walker].stay;
}

std::optional<Lesson> Chain::lesson() const {
  ByteWriter out;
  out.put(static_cast<std::uint8_t>(settings_->method));
  const std::optional<LessonKind> kind = walk_->teach(out);
  if (!kind) return std::nullopt;
  return Lesson{.kind = *kind, .bytes = out.take()};
}

// --- Checkpoint -------------------------------------------------------------------------------
// version, seed, index, method; counts; what the method needs.

std::string Chain::checkpoint() const {
  const ChainCounts& counts = *counts_;
  ByteWriter out;
  out.put(kCheckpointVersion);
  out.put(settings_->seed);
  out.put(settings_->index);
  out.put(static_cast<std::uint8_t>(settings_->method));
  visit_counters(counts, [&](const char*, auto value) { out.put(value); });
  out.put(static_cast<std::uint32_t>(counts.kernels.size()));
  for (const KernelCounter& kernel : counts.kernels) {
    out.put(kernel.proposed);
    out.put(kernel.accepted);
  }
  out.put(static_cast<std::uint8_t>(counts.is_learning));
  out.put(static_cast<std::uint8_t>(counts.odds.basis));
  out.put(counts.odds.draws);
  out.put(counts.odds.hits);
  out.put(counts.odds.sum);
  out.put(counts.odds.squares);
  out.put(counts.odds.largest);
  out.put(static_cast<std::uint32_t>(counts.rungs.size()));
  for (const RungCounter& rung : counts.rungs) {
    out.put(rung.beta);
    out.put(rung.proposed);
    out.put(rung.accepted);
  }
  walk_->write(out);
  return out.take();
}

Chain::Chain(std::shared_ptr<const Target> target, const ChainSettings& settings, std::string_view checkpoint)
    : Chain(std::move(target), settings) {
  try {
    ChainCounts& counts = *counts_;
    ByteReader in(checkpoint);
    if (in.get<std::uint32_t>() != kCheckpointVersion) throw std::out_of_range("unknown version");
    if (in.get<std::uint64_t>() != settings.seed || in.get<std::uint32_t>() != settings.index ||
        in.get<std::uint8_t>() != static_cast<std::uint8_t>(settings.method))
      throw std::out_of_range("it belongs to a chain with other settings");
    visit_counters(counts, [&]<typename Value>(const char*, Value& value) { value = in.get<Value>(); });
    if (in.get<std::uint32_t>() != counts.kernels.size()) throw std::out_of_range("other kernels");
    for (KernelCounter& kernel : counts.kernels) {
      kernel.proposed = in.get<std::uint64_t>();
      kernel.accepted = in.get<std::uint64_t>();
    }
    counts.is_learning = in.get<std::uint8_t>() != 0;
    const auto basis = in.get<std::uint8_t>();
    if (basis > static_cast<std::uint8_t>(OddsBasis::learned)) throw std::out_of_range("unknown odds");
    counts.odds.basis = static_cast<OddsBasis>(basis);
    counts.odds.draws = in.get<std::uint64_t>();
    counts.odds.hits = in.get<std::uint64_t>();
    counts.odds.sum = in.get<double>();
    counts.odds.squares = in.get<double>();
    counts.odds.largest = in.get<double>();
    counts.rungs.clear();
    for (auto rungs = in.get<std::uint32_t>(); rungs > 0; --rungs) {
      const auto beta = in.get<double>();
      const auto proposed = in.get<std::uint64_t>();
      counts.rungs.push_back({beta, proposed, in.get<std::uint64_t>()});
    }
    walk_->read(in);
    if (!in.at_end()) throw std::out_of_range("there is more than a checkpoint");
  } catch (const std::out_of_range& fault) {
    throw std::runtime_error(std::string("chain checkpoint cannot be read: ") + fault.what());
  }
}

}  // namespace retake
