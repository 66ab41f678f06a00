// The rows of samples: insert, look up, list, and draws for the diagnostics.
// Realises doc/design.md, section 5. Must be called within a transaction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/page.h"
#include "db/records.h"
#include "db/sqlite/connection.h"
#include "db/sqlite/stock_rows.h"

namespace retake::database {

/// What a sample's id says.
struct SamplePlace {
  std::string_view chain;
  std::uint64_t iteration = 0;
  std::uint32_t replica = 0;
};
/// The inverse of sample_id; empty if it could not have written the text.
std::optional<SamplePlace> parse_sample_id(std::string_view id);

/// Each of these throws Damaged where one sample is asked for, and leaves damaged ones out of lists.
std::optional<SampleRecord> load_sample(Connection& connection, std::string_view id);
SampleRecord load_sample_at(Connection& connection, std::int64_t row);
Page<SampleRecord> load_samples(Connection& connection, std::string_view scenario, SampleOrder order,
                                std::size_t limit, std::string_view cursor);
std::optional<std::string> load_state(Connection& connection, std::string_view id);
std::optional<std::string> load_animation(Connection& connection, std::string_view id);
std::vector<DrawRecord> load_draws(Connection& connection, std::string_view chain, std::size_t most,
                                   std::uint64_t from_iteration);

/// The chain that a sample is of.
struct ChainRow {
  std::int64_t row = 0;
  std::string_view id;
  bool is_apart = false;  ///< it follows another law
};
/// Puts a sample on its shelf and counts it into the stock; one that is there already takes the new weight.
/// True if an older sample changed its shelf.
bool insert_sample(Connection& connection, Stock& stock, const ChainRow& chain, const NewSample& sample);
/// True if it changed its shelf. Throws: DatabaseError if there is no such sample.
bool update_weight(Connection& connection, Stock& stock, const ChainRow& chain, const WeightUpdate& update);

/// What is damaged of a sample, state and animation included.
std::optional<std::string> find_damage(Connection& connection, std::int64_t row);
/// Takes a damaged sample out of what is handed out, and out of the stock.
void set_aside(Connection& connection, Stock& stock, std::int64_t row);

}  // namespace retake::database
