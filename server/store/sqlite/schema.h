// Tables of the SQLite store, format 14.
#pragma once

namespace lightmill::sqlite {

/// "LMIL": the PRAGMA application_id of our files.
inline constexpr int kApplicationId = 0x4C4D494C;

/// Id of the last job, even of a deleted one.
inline constexpr const char* kHighestJob = "SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'jobs'";

// AUTOINCREMENT keeps the highest id ever used, even after deletes. Small rows have one form (server/store/records.h).
// A job's specification can be several MB large, and is written once or twice. Its progress is small, and changes with
// every commit. Unsigned 64-bit numbers keep their bits.
inline constexpr const char* kSchema = R"sql(
-- One row: the store's id, the secret that selects results for audits, and the state of the last commit. `hash` is a
-- running hash of all commits.
CREATE TABLE store (
  id BLOB NOT NULL,
  secret BLOB NOT NULL,
  epoch INTEGER NOT NULL,
  commits INTEGER NOT NULL,
  hash BLOB NOT NULL,
  keys BLOB NOT NULL, -- a sum over the keys of each small table: a row that vanishes is missed
  checksum INTEGER NOT NULL -- of the row
);

CREATE TABLE jobs (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  message BLOB NOT NULL,
  checksum INTEGER NOT NULL
);

CREATE TABLE job_specs (
  job INTEGER PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
  message BLOB NOT NULL,
  checksum INTEGER NOT NULL
);

CREATE TABLE job_progress (
  job INTEGER PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
  message BLOB NOT NULL,
  checksum INTEGER NOT NULL
);

-- The films: each row one node of a tile's forest; hash is row_hash_of(node), 16 bytes, high word first.
CREATE TABLE nodes (
  id INTEGER PRIMARY KEY,
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  tile INTEGER NOT NULL,
  level INTEGER NOT NULL,
  range_index INTEGER NOT NULL,
  non_finite INTEGER NOT NULL,
  hash BLOB NOT NULL,
  samples BLOB NOT NULL,
  UNIQUE (job, tile, level, range_index)
);

-- The origin of each merged result.
CREATE TABLE results (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  tile INTEGER NOT NULL,
  level INTEGER NOT NULL,
  range_index INTEGER NOT NULL,
  hash BLOB NOT NULL,
  worker BLOB NOT NULL,
  machine BLOB NOT NULL,
  audit INTEGER NOT NULL, -- 1: to be rendered again by another worker; 2: was, with the same bits
  fingerprint_class BLOB NOT NULL, -- of jobs that allow mixed ones
  checksum INTEGER NOT NULL, -- of the row; its two lowest bits are `audit`
  PRIMARY KEY (job, tile, level, range_index)
) WITHOUT ROWID;

CREATE TABLE tokens (
  id BLOB PRIMARY KEY,
  message BLOB NOT NULL,
  checksum INTEGER NOT NULL
) WITHOUT ROWID;

CREATE TABLE actions (
  number INTEGER PRIMARY KEY,
  message BLOB NOT NULL,
  checksum INTEGER NOT NULL
);

CREATE TABLE quarantine (
  worker BLOB PRIMARY KEY,
  message BLOB NOT NULL,
  checksum INTEGER NOT NULL
) WITHOUT ROWID;
)sql";

}  // namespace lightmill::sqlite
