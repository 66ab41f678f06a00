// Seals: which cells of which table are sealed, and the SQL that seals them and looks at them.
// Realises doc/design.md, section 5: a damaged cell is found where its row is read. connection.h says what a
// seal is; the tables are in schema.cpp.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/sqlite/connection.h"

namespace retake::database {

/// A table with a column `seal`, and the cells that it is of. A released list is never changed but at its
/// end.
struct SealedTable {
  std::string_view name;
  std::vector<std::string_view> columns;  ///< in the order of the parts
};

const SealedTable& scenario_seal();
const SealedTable& stock_seal();
const SealedTable& chain_seal();
const SealedTable& kernel_seal();
const SealedTable& rung_seal();
const SealedTable& checkpoint_seal();
const SealedTable& trace_seal();
const SealedTable& lesson_seal();
const SealedTable& sample_seal();  ///< the last two parts, of state and animation, are of `sample_blob`
const SealedTable& player_seal();
const SealedTable& seen_seal();
const SealedTable& play_seal();
const SealedTable& key_seal();

/// "INTO …", after INSERT or REPLACE, of a row whose cells are bound in the order of the columns.
std::string insert_sealed(const SealedTable& table);
/// "c = ?1, d = ?2, seal = …": sets these cells, whatever they were, to what is bound first.
std::string set_sealed(const SealedTable& table, const std::vector<std::string_view>& columns);
/// The number of a part.
std::size_t part_of(const SealedTable& table, std::string_view column);
/// An expression: the first part that is not its cell's, NULL if all are; of all cells, or only those from
/// `first` to `last`.
std::string unsound_in(const SealedTable& table);
std::string unsound_in(const SealedTable& table, std::string_view first, std::string_view last);

/// Reads a column that holds such an expression: the cell that is damaged, if one is.
std::optional<std::string_view> read_unsound(const SealedTable& table, Query& query);

/// "sample c-4 is damaged: weight is not what was written".
std::string damage_of(std::string_view thing, std::string_view column);

}  // namespace retake::database
