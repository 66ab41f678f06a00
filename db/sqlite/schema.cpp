// The tables, one script for each version of the schema. A released script is never edited: append one.
// Realises doc/design.md, section 5.
#include "db/sqlite/schema.h"

#include <array>

namespace retake::database {
namespace {

constexpr const char* kVersion1 = R"sql(
CREATE TABLE scenario (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT UNIQUE,                          -- null: deleted, what hangs on it is being purged
  world TEXT NOT NULL,
  world_version INTEGER NOT NULL,
  title TEXT NOT NULL,
  document TEXT NOT NULL,
  created_at INTEGER NOT NULL
) STRICT;

-- What a scenario holds, kept in the transactions that change it. Gone as soon as the scenario is deleted.
CREATE TABLE stock (
  scenario INTEGER PRIMARY KEY REFERENCES scenario ON DELETE CASCADE,
  samples INTEGER NOT NULL DEFAULT 0,
  unplayed INTEGER NOT NULL DEFAULT 0 CHECK (unplayed BETWEEN 0 AND samples),
  plays INTEGER NOT NULL DEFAULT 0
) STRICT;

CREATE TABLE chain (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT UNIQUE,                          -- null: deleted with its scenario
  scenario INTEGER NOT NULL REFERENCES scenario ON DELETE CASCADE,
  position INTEGER NOT NULL,               -- ChainRecord::index
  seed INTEGER NOT NULL,
  method TEXT NOT NULL,
  ratios TEXT NOT NULL,
  settings TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'paused', 'finished', 'failed')),
  stop_samples INTEGER,
  stop_iterations INTEGER,
  stop_seconds REAL,
  iteration INTEGER NOT NULL,
  accepted INTEGER NOT NULL,
  samples INTEGER NOT NULL,
  simulations INTEGER NOT NULL,
  failed_simulations INTEGER NOT NULL,
  simulated_seconds REAL NOT NULL,
  run_seconds REAL NOT NULL,
  iterations_per_second REAL NOT NULL,
  first_sample_iteration INTEGER,
  first_sample_seconds REAL,
  ended_by TEXT NOT NULL,
  error TEXT NOT NULL,
  created_at INTEGER NOT NULL
) STRICT;
CREATE INDEX chain_by_scenario ON chain (scenario);
CREATE INDEX chain_by_scenario_state ON chain (scenario, state);
CREATE INDEX chain_by_state ON chain (state);

CREATE TABLE chain_kernel (
  chain INTEGER NOT NULL REFERENCES chain ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  proposed INTEGER NOT NULL,
  accepted INTEGER NOT NULL,
  PRIMARY KEY (chain, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE checkpoint (
  chain INTEGER PRIMARY KEY REFERENCES chain ON DELETE CASCADE,
  bytes BLOB NOT NULL
) STRICT;

CREATE TABLE trace_block (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  chain INTEGER NOT NULL REFERENCES chain ON DELETE CASCADE,
  bytes BLOB NOT NULL
) STRICT;
CREATE INDEX trace_block_by_chain ON trace_block (chain);

CREATE TABLE sample (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  scenario INTEGER NOT NULL REFERENCES scenario ON DELETE CASCADE,
  chain INTEGER NOT NULL REFERENCES chain ON DELETE CASCADE,
  iteration INTEGER NOT NULL,
  replica INTEGER NOT NULL,
  weight INTEGER NOT NULL,
  log_prior REAL NOT NULL,
  log_constraint REAL NOT NULL,
  log_target REAL NOT NULL GENERATED ALWAYS AS (log_prior + log_constraint) VIRTUAL,
  duration REAL NOT NULL,
  measures TEXT NOT NULL,
  digest TEXT NOT NULL,
  plays INTEGER NOT NULL DEFAULT 0,
  created_at INTEGER NOT NULL,
  UNIQUE (chain, iteration, replica)
) STRICT;
CREATE INDEX sample_by_scenario ON sample (scenario);
CREATE INDEX sample_by_log_target ON sample (scenario, log_target);
CREATE INDEX sample_by_plays ON sample (scenario, plays);
CREATE INDEX sample_by_weight ON sample (chain, iteration, replica, weight);

-- Apart from the samples, so that listings read no blobs.
CREATE TABLE sample_blob (
  sample INTEGER PRIMARY KEY REFERENCES sample ON DELETE CASCADE,
  state BLOB NOT NULL,
  animation BLOB NOT NULL
) STRICT;

CREATE TABLE player (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  scenario INTEGER NOT NULL REFERENCES scenario ON DELETE CASCADE,
  name TEXT NOT NULL,
  seen INTEGER NOT NULL DEFAULT 0,         -- how many samples the player has seen
  UNIQUE (scenario, name)
) STRICT;

CREATE TABLE play (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  sample INTEGER NOT NULL REFERENCES sample ON DELETE CASCADE,
  player TEXT NOT NULL,                    -- empty: played without a player
  repeat INTEGER NOT NULL,
  remaining INTEGER NOT NULL,
  created_at INTEGER NOT NULL
) STRICT;
CREATE INDEX play_by_sample ON play (sample);

CREATE TABLE seen (
  player INTEGER NOT NULL REFERENCES player ON DELETE CASCADE,
  sample INTEGER NOT NULL REFERENCES sample ON DELETE CASCADE,
  last_play INTEGER NOT NULL,
  PRIMARY KEY (player, sample)
) STRICT, WITHOUT ROWID;
CREATE INDEX seen_by_age ON seen (player, last_play);
CREATE INDEX seen_by_sample ON seen (sample);

CREATE TABLE idempotency (
  scenario INTEGER NOT NULL REFERENCES scenario ON DELETE CASCADE,
  key TEXT NOT NULL,
  play INTEGER NOT NULL REFERENCES play ON DELETE CASCADE,
  PRIMARY KEY (scenario, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX idempotency_by_play ON idempotency (play);

-- One row that the writer changes when plays must reach the disk.
CREATE TABLE flush (
  row INTEGER PRIMARY KEY CHECK (row = 1),
  count INTEGER NOT NULL
) STRICT;
INSERT INTO flush (row, count) VALUES (1, 0);
)sql";

constexpr const char* kVersion2 = R"sql(
ALTER TABLE scenario ADD COLUMN pilot_draws INTEGER;  -- null: there was no pilot yet
ALTER TABLE scenario ADD COLUMN pilot_hits INTEGER;
ALTER TABLE scenario ADD COLUMN pilot_seconds REAL;
CREATE INDEX scenario_by_pilot ON scenario (pilot_draws);

ALTER TABLE chain ADD COLUMN stop_ess INTEGER;
ALTER TABLE chain ADD COLUMN is_learning INTEGER NOT NULL DEFAULT 0;
ALTER TABLE chain ADD COLUMN skipped_seconds REAL NOT NULL DEFAULT 0;
ALTER TABLE chain ADD COLUMN effective_samples REAL;
ALTER TABLE chain ADD COLUMN odds_basis TEXT NOT NULL DEFAULT '';  -- empty: nothing was tallied
ALTER TABLE chain ADD COLUMN odds_draws INTEGER NOT NULL DEFAULT 0;
ALTER TABLE chain ADD COLUMN odds_hits INTEGER NOT NULL DEFAULT 0;
ALTER TABLE chain ADD COLUMN odds_sum REAL NOT NULL DEFAULT 0;
ALTER TABLE chain ADD COLUMN odds_squares REAL NOT NULL DEFAULT 0;
ALTER TABLE chain ADD COLUMN odds_largest REAL NOT NULL DEFAULT 0;

-- The ladder of a chain, from the prior up.
CREATE TABLE chain_rung (
  chain INTEGER NOT NULL REFERENCES chain ON DELETE CASCADE,
  position INTEGER NOT NULL,
  beta REAL NOT NULL,
  proposed INTEGER NOT NULL,               -- swaps with the next rung
  accepted INTEGER NOT NULL,
  PRIMARY KEY (chain, position)
) STRICT, WITHOUT ROWID;
)sql";

// Plays follow the weights. What chances an older sample has does not depend on what it is.
constexpr const char* kVersion3 = R"sql(
ALTER TABLE sample ADD COLUMN shelf INTEGER NOT NULL DEFAULT 0;   -- 0 even, 1 rest, 2 learning, 3 apart
ALTER TABLE sample ADD COLUMN chance REAL NOT NULL DEFAULT 0.5;   -- even if chance * stock.door < weight
ALTER TABLE sample ADD COLUMN pass REAL NOT NULL DEFAULT 0;       -- when it comes up without a player
UPDATE sample SET
  shelf = CASE WHEN (SELECT ratios FROM chain WHERE chain.row = sample.chain) = 'paper' THEN 3
               WHEN weight = 0 THEN 2 ELSE 0 END,
  chance = (abs(random() % 1000000007) + 0.5) / 1000000008.0,
  pass = (abs(random() % 1000000007) + 0.5) / 1000000008.0 / max(weight, 1);
DROP INDEX sample_by_plays;
CREATE INDEX sample_by_shelf ON sample (scenario, shelf, plays);
CREATE INDEX sample_by_pass ON sample (scenario, pass) WHERE shelf <= 1;
CREATE INDEX sample_by_heft ON sample (scenario, weight) WHERE shelf <= 1;

ALTER TABLE stock RENAME TO old_stock;
CREATE TABLE stock (
  scenario INTEGER PRIMARY KEY REFERENCES scenario ON DELETE CASCADE,
  samples INTEGER NOT NULL DEFAULT 0,
  counted INTEGER NOT NULL DEFAULT 0,           -- on the shelves even and rest
  even INTEGER NOT NULL DEFAULT 0 CHECK (even BETWEEN 0 AND counted),
  learning INTEGER NOT NULL DEFAULT 0,
  unplayed INTEGER NOT NULL DEFAULT 0 CHECK (unplayed BETWEEN 0 AND counted),
  unplayed_learning INTEGER NOT NULL DEFAULT 0 CHECK (unplayed_learning BETWEEN 0 AND learning),
  plays INTEGER NOT NULL DEFAULT 0,
  weight INTEGER NOT NULL DEFAULT 0,            -- of those that count
  door INTEGER NOT NULL DEFAULT 1,
  door_counted INTEGER NOT NULL DEFAULT 0,      -- how many counted when the door was set
  time REAL NOT NULL DEFAULT 0
) STRICT;
INSERT INTO stock (scenario, samples, counted, even, learning, unplayed, unplayed_learning, plays, weight)
  SELECT scenario, samples,
    (SELECT count(*) FROM sample WHERE sample.scenario = old_stock.scenario AND shelf <= 1),
    (SELECT count(*) FROM sample WHERE sample.scenario = old_stock.scenario AND shelf = 0),
    (SELECT count(*) FROM sample WHERE sample.scenario = old_stock.scenario AND shelf = 2),
    (SELECT count(*) FROM sample WHERE sample.scenario = old_stock.scenario AND shelf <= 1 AND plays = 0),
    (SELECT count(*) FROM sample WHERE sample.scenario = old_stock.scenario AND shelf = 2 AND plays = 0),
    plays,
    (SELECT coalesce(sum(weight), 0) FROM sample WHERE sample.scenario = old_stock.scenario AND shelf <= 1)
  FROM old_stock;
DROP TABLE old_stock;

ALTER TABLE player ADD COLUMN seen_even INTEGER NOT NULL DEFAULT 0;      -- seen: of those that count
ALTER TABLE player ADD COLUMN seen_learning INTEGER NOT NULL DEFAULT 0;
UPDATE player SET
  seen = (SELECT count(*) FROM seen JOIN sample ON sample.row = seen.sample
          WHERE seen.player = player.row AND shelf <= 1),
  seen_even = (SELECT count(*) FROM seen JOIN sample ON sample.row = seen.sample
               WHERE seen.player = player.row AND shelf = 0),
  seen_learning = (SELECT count(*) FROM seen JOIN sample ON sample.row = seen.sample
                   WHERE seen.player = player.row AND shelf = 2);
)sql";

// What was learned belongs to the scenario.
constexpr const char* kVersion4 = R"sql(
CREATE TABLE lesson (
  row INTEGER PRIMARY KEY AUTOINCREMENT,
  scenario INTEGER NOT NULL REFERENCES scenario ON DELETE CASCADE,
  number INTEGER NOT NULL CHECK (number >= 1),
  method TEXT NOT NULL,
  ratios TEXT NOT NULL,
  chain INTEGER NOT NULL REFERENCES chain ON DELETE CASCADE,  -- that learned it
  version INTEGER NOT NULL,
  kind TEXT NOT NULL CHECK (kind IN ('unfinished', 'proposal', 'place')),
  went_on INTEGER NOT NULL DEFAULT 0,      -- a chain went on from this place
  bytes BLOB NOT NULL,
  created_at INTEGER NOT NULL,
  UNIQUE (scenario, number)
) STRICT;
CREATE INDEX lesson_by_kind ON lesson (scenario, method, ratios, version, kind, went_on, number);
CREATE INDEX lesson_by_chain ON lesson (chain);
ALTER TABLE chain ADD COLUMN lesson INTEGER NOT NULL DEFAULT 0;  -- its number; 0: it learns by itself
ALTER TABLE chain ADD COLUMN stop_counted INTEGER;
ALTER TABLE chain ADD COLUMN counted INTEGER NOT NULL DEFAULT 0;  -- samples of a weight above 0
UPDATE chain SET counted = (SELECT count(*) FROM sample WHERE sample.chain = chain.row AND weight > 0);
CREATE INDEX chain_by_seed ON chain (scenario, seed);
)sql";

// A chain that ends the process again and again is found out.
constexpr const char* kAttempts = R"sql(
ALTER TABLE chain ADD COLUMN attempts INTEGER NOT NULL DEFAULT 0;  -- set running so often, no progress since
)sql";

// Every cell is sealed. What no Retake can have written is not: a NULL stands in its place, and its row is
// found to be damaged.
constexpr const char* kSeals = R"sql(
ALTER TABLE scenario ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE stock ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE chain ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE chain_kernel ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE chain_rung ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE checkpoint ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE trace_block ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE lesson ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE sample ADD COLUMN seal BLOB NOT NULL DEFAULT x'';  -- its last two parts are of sample_blob
ALTER TABLE player ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE seen ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE play ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
ALTER TABLE idempotency ADD COLUMN seal BLOB NOT NULL DEFAULT x'';

UPDATE scenario SET seal = seal(id, world, iif(world_version >= 1, world_version, NULL), title,
  iif(json_valid(document), document, NULL), iif(created_at >= 0, created_at, NULL),
  iif(pilot_draws >= 0 OR pilot_draws IS NULL, pilot_draws, ''),
  iif(pilot_hits >= 0 OR pilot_hits IS NULL, pilot_hits, ''),
  iif(pilot_seconds >= 0 OR pilot_seconds IS NULL, pilot_seconds, ''));
UPDATE stock SET seal = seal(scenario, samples, counted, even, learning, unplayed, unplayed_learning, plays,
  weight, door, door_counted, time);
UPDATE chain SET seal = seal(id, scenario, iif(position >= 0, position, NULL), iif(seed >= 0, seed, NULL),
  iif(method IN ('rejection', 'metropolis', 'conditional', 'tempering'), method, NULL),
  iif(ratios IN ('exact', 'paper'), ratios, NULL),
  iif(settings = '' OR json_valid(settings), settings, NULL), iif(lesson >= 0, lesson, NULL),
  iif(created_at >= 0, created_at, NULL), state, ended_by, error,
  iif(stop_samples >= 0 OR stop_samples IS NULL, stop_samples, ''),
  iif(stop_counted >= 0 OR stop_counted IS NULL, stop_counted, ''),
  iif(stop_iterations >= 0 OR stop_iterations IS NULL, stop_iterations, ''),
  iif(stop_seconds >= 0 OR stop_seconds IS NULL, stop_seconds, ''),
  iif(stop_ess >= 0 OR stop_ess IS NULL, stop_ess, ''), iif(attempts >= 0, attempts, NULL),
  iif(iteration >= 0, iteration, NULL),
  iif(accepted >= 0, accepted, NULL), iif(samples >= 0, samples, NULL),
  iif(simulations >= 0, simulations, NULL), iif(failed_simulations >= 0, failed_simulations, NULL),
  iif(simulated_seconds >= 0, simulated_seconds, NULL), iif(skipped_seconds >= 0, skipped_seconds, NULL),
  iif(counted >= 0, counted, NULL), iif(run_seconds >= 0, run_seconds, NULL),
  iif(iterations_per_second >= 0, iterations_per_second, NULL),
  iif(first_sample_iteration >= 0 OR first_sample_iteration IS NULL, first_sample_iteration, ''),
  iif(first_sample_seconds >= 0 OR first_sample_seconds IS NULL, first_sample_seconds, ''),
  effective_samples, iif(is_learning IN (0, 1), is_learning, NULL),
  iif(odds_basis IN ('', 'ladder', 'rejection', 'learned'), odds_basis, NULL),
  iif(odds_draws >= 0, odds_draws, NULL), iif(odds_hits >= 0, odds_hits, NULL), odds_sum, odds_squares,
  odds_largest);
UPDATE chain_kernel SET seal = seal(chain, position, name, iif(proposed >= 0, proposed, NULL),
  iif(accepted >= 0, accepted, NULL));
UPDATE chain_rung SET seal = seal(chain, position, beta, iif(proposed >= 0, proposed, NULL),
  iif(accepted >= 0, accepted, NULL));
UPDATE checkpoint SET seal = seal(chain, bytes);
UPDATE trace_block SET seal = seal(chain, bytes);
UPDATE lesson SET seal = seal(scenario, number,
  iif(method IN ('rejection', 'metropolis', 'conditional', 'tempering'), method, NULL),
  iif(ratios IN ('exact', 'paper'), ratios, NULL), chain, iif(version >= 1, version, NULL), kind,
  iif(went_on IN (0, 1), went_on, NULL), bytes, iif(created_at >= 0, created_at, NULL));
UPDATE sample SET seal = seal(scenario, chain, iif(iteration >= 0, iteration, NULL),
  iif(replica >= 0, replica, NULL), iif(weight >= 0, weight, NULL), log_prior, log_constraint,
  iif(duration >= 0, duration, NULL),
  iif(measures = '', measures, iif(json_valid(measures), iif(json_type(measures) = 'object', measures, NULL), NULL)),
  digest, iif(created_at >= 0, created_at, NULL), iif(plays >= 0, plays, NULL),
  iif(shelf BETWEEN 0 AND 3, shelf, NULL), iif(chance > 0 AND chance < 1, chance, NULL),
  iif(pass >= 0, pass, NULL),
  (SELECT state FROM sample_blob WHERE sample_blob.sample = sample.row),
  (SELECT animation FROM sample_blob WHERE sample_blob.sample = sample.row));
UPDATE player SET seal = seal(scenario, name, seen, seen_even, seen_learning);
UPDATE seen SET seal = seal(player, sample, last_play);
UPDATE play SET seal = seal(sample, player, iif(repeat IN (0, 1), repeat, NULL),
  iif(remaining >= 0, remaining, NULL), iif(created_at >= 0, created_at, NULL));
UPDATE idempotency SET seal = seal(scenario, key, play);
)sql";

std::int64_t single_integer(Connection& connection, std::string_view sql) {
  Query query(connection, sql);
  query.next();
  return query.integer();
}

}  // namespace

std::span<const std::string> migrations() {
  static const std::array<std::string, 6> scripts{kVersion1, kVersion2, kVersion3,
                                                  kVersion4, kAttempts, kSeals};
  return scripts;
}

FileState file_state(Connection& connection, std::span<const std::string> scripts) {
  try {
    const auto application = single_integer(connection, "PRAGMA application_id");
    const auto version = single_integer(connection, "PRAGMA user_version");
    if (application == 0 && version == 0) {
      const bool has_tables = single_integer(connection, "SELECT count(*) FROM sqlite_schema") != 0;
      return has_tables ? FileState::foreign : FileState::empty;
    }
    if (application != kApplicationId || version < 1) return FileState::foreign;
    const auto current = static_cast<std::int64_t>(scripts.size());
    return version > current ? FileState::newer : version < current ? FileState::older : FileState::current;
  } catch (const DatabaseError& error) {
    if (error.kind() == DatabaseError::Kind::not_a_database) return FileState::foreign;
    throw;
  }
}

void migrate(Connection& connection, std::span<const std::string> scripts) {
  // A script may rebuild a table that others refer to; the references are checked at the end instead.
  connection.execute("PRAGMA foreign_keys = OFF");
  Transaction transaction(connection, Transaction::Kind::write);
  const auto version = static_cast<std::size_t>(single_integer(connection, "PRAGMA user_version"));
  for (const auto& script : scripts.subspan(version))
    connection.execute(script);
  if (Query broken(connection, "PRAGMA foreign_key_check"); broken.next()) {
    throw DatabaseError(DatabaseError::Kind::constraint,
                        "the migration breaks references of table " + broken.text());
  }
  connection.execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  connection.execute("PRAGMA user_version = " + std::to_string(scripts.size()));
  transaction.commit();
}

}  // namespace retake::database
