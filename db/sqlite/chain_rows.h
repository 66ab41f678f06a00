// The rows of chains, their checkpoints and traces, and what a chain's progress writes.
// Realises doc/design.md, section 5: samples and checkpoint in one transaction. Must be called within one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/page.h"
#include "db/records.h"
#include "db/sqlite/connection.h"

namespace retake::database {

/// Each of these throws Damaged where one chain or its checkpoint is asked for, and leaves damaged ones, and
/// damaged stretches of a trace, out of lists.
std::optional<ChainRecord> load_chain(Connection& connection, std::string_view id);
/// See Store::same_chain.
std::optional<ChainRecord> load_same_chain(Connection& connection, const ChainRecord& like,
                                           std::optional<std::uint64_t> lesson);
std::vector<ChainRecord> load_chains(Connection& connection, std::string_view scenario);
Page<ChainRecord> load_chains(Connection& connection, std::string_view scenario, std::size_t limit,
                              std::string_view cursor);
std::vector<ChainRecord> load_chains_in_states(Connection& connection, const std::vector<ChainState>& states);
std::string load_checkpoint(Connection& connection, std::string_view chain);
std::vector<std::string> load_trace(Connection& connection, std::string_view chain);

/// False: the chain's scenario does not exist. Throws: DatabaseError if there is a chain of this id.
bool insert_chain(Connection& connection, const ChainRecord& record);
void update_chain_state(Connection& connection, std::string_view id, ChainState state,
                        std::string_view ended_by, std::string_view error);
void update_chain_stop(Connection& connection, std::string_view id, const StopRule& stop);
/// Chains that would be taken up but are damaged have failed, so that nothing waits for them. They stay
/// damaged.
void set_damaged_chains_aside(Connection& connection);
struct Written {
  std::uint64_t samples = 0;   ///< that the scenario holds then; 0 if the chain is gone
  bool shelves_moved = false;  ///< older samples changed their shelf
};
/// Writes all of it.
Written write_progress(Connection& connection, const ChainProgress& progress);

}  // namespace retake::database
