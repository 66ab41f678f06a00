// KeptRun: the run of `retake sample` that a folder keeps, so that it can go on where it was cut.
// doc/api.md, "The program". It must not know how its samples are shown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "db/store.h"
#include "server/chains/chain_run.h"
#include "worlds/scenario.h"

namespace retake {

/// A store of one scenario and one chain in the folder, there from the start of a run until it has found what
/// was asked for. Thread safety: one thread at a time.
class KeptRun {
 public:
  /// Begins anew: the folder's old run is forgotten. Throws: OutputError.
  static KeptRun begin(const std::string& folder, const Scenario& scenario, const ChainRecord& chain);
  /// The run that a folder keeps; null if it keeps none. Throws: OutputError.
  static std::unique_ptr<KeptRun> find(const std::string& folder);

  /// The chain as it was kept last, but for its stop rule.
  const ChainRecord& chain() const { return chain_; }
  /// Throws: ConfigurationError naming everything in which another run differs from this one.
  void expect_same(const Scenario& scenario, const ChainRecord& other) const;
  ChainRun::Stored stored() const;
  /// The samples found so far in the order in which they were, each with the weight it has reached.
  void each_sample(const std::function<void(const SampleRecord&)>& visit) const;
  /// See Store::draws.
  std::vector<DrawRecord> draws(std::size_t most, std::uint64_t from_iteration) const;

  /// Durable when it returns. Throws: OutputError.
  void keep(ChainProgress progress);
  /// The run has found what was asked for.
  void forget();

 private:
  KeptRun(std::string path, std::unique_ptr<Store> store, ScenarioRecord scenario, ChainRecord chain);

  std::string path_;
  std::unique_ptr<Store> store_;
  ScenarioRecord scenario_;
  ChainRecord chain_;
};

}  // namespace retake
