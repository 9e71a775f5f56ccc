// The tables of the store's file, format 12.
#pragma once

namespace lightmill::sqlite {

/// "LMIL": what PRAGMA application_id says of our files.
inline constexpr int kApplicationId = 0x4C4D494C;

// AUTOINCREMENT keeps the highest id ever used, also after deletes. Settings are written once per job, and again if its
// method was still to be chosen; the row in `jobs` changes with every commit and stays small. Numbers of 64 bits
// without sign are stored by their bits.
inline constexpr const char* kSchema = R"sql(
CREATE TABLE meta (
  key TEXT PRIMARY KEY,
  value INTEGER NOT NULL
) WITHOUT ROWID;
INSERT INTO meta VALUES ('format', 12), ('epoch', 0);

CREATE TABLE jobs (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  request_id TEXT NOT NULL,
  name TEXT NOT NULL,
  owner TEXT NOT NULL,
  host TEXT NOT NULL,
  parent INTEGER NOT NULL,
  priority INTEGER NOT NULL,
  goal_samples INTEGER NOT NULL,
  goal_seconds REAL NOT NULL,
  state TEXT NOT NULL,
  reason TEXT NOT NULL,
  fingerprint_class TEXT NOT NULL,
  active_seconds REAL NOT NULL,
  worker_seconds REAL NOT NULL,
  results_merged INTEGER NOT NULL,
  results_duplicate INTEGER NOT NULL,
  leases_lost INTEGER NOT NULL,
  copies_leased INTEGER NOT NULL,
  non_finite INTEGER NOT NULL,
  submitted_unix_ms INTEGER NOT NULL,
  finished_unix_ms INTEGER NOT NULL,
  goal_error REAL NOT NULL,
  reached TEXT NOT NULL,
  goal_adaptive INTEGER NOT NULL,
  verify_share REAL NOT NULL,
  results_verified INTEGER NOT NULL,
  nodes_dropped INTEGER NOT NULL,
  allow_mixed INTEGER NOT NULL,
  checksum BLOB NOT NULL -- of all that is stored of the job but what counts up
);

-- How a job's error fell; samples are per pixel.
CREATE TABLE job_errors (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  samples REAL NOT NULL,
  worker_seconds REAL NOT NULL,
  rel_mse REAL NOT NULL,
  half_width REAL NOT NULL,
  PRIMARY KEY (job, samples)
) WITHOUT ROWID;

CREATE TABLE job_settings (
  job INTEGER PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
  scene BLOB NOT NULL,
  width INTEGER NOT NULL,
  height INTEGER NOT NULL,
  crop_x INTEGER NOT NULL,
  crop_y INTEGER NOT NULL,
  crop_width INTEGER NOT NULL,
  crop_height INTEGER NOT NULL,
  seed INTEGER NOT NULL,
  method TEXT NOT NULL,
  max_bounces INTEGER NOT NULL,
  renderer_version TEXT NOT NULL,
  meters INTEGER NOT NULL,
  method_chosen INTEGER NOT NULL,
  method_reasons TEXT NOT NULL,
  method_notices TEXT NOT NULL,
  method_candidates TEXT NOT NULL,
  allocation BLOB NOT NULL -- a byte a tile, signed: what it gets is 2^this of the mean; empty: all the same
);

CREATE TABLE job_assets (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  digest BLOB NOT NULL,
  PRIMARY KEY (job, position)
) WITHOUT ROWID;

CREATE TABLE job_layers (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  channels INTEGER NOT NULL,
  kind TEXT NOT NULL,
  PRIMARY KEY (job, position)
) WITHOUT ROWID;

-- The films: each row one node of a tile's forest; hash is hash_of(node), 16 bytes, high word first.
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

-- Who computed every merged result.
CREATE TABLE results (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  tile INTEGER NOT NULL,
  level INTEGER NOT NULL,
  range_index INTEGER NOT NULL,
  hash BLOB NOT NULL,
  worker TEXT NOT NULL,
  machine TEXT NOT NULL,
  verification INTEGER NOT NULL, -- 1: to be rendered again on another machine; 2: was, with the same bits
  fingerprint_class TEXT NOT NULL, -- of jobs that allow mixed ones
  checksum INTEGER NOT NULL, -- of the row but `verification`; never 0
  PRIMARY KEY (job, tile, level, range_index)
) WITHOUT ROWID;

-- Who gets in by a token; hash is the SHA-256 of its text.
CREATE TABLE tokens (
  id TEXT PRIMARY KEY,
  name TEXT NOT NULL,
  roles TEXT NOT NULL,
  hash BLOB NOT NULL,
  made_by TEXT NOT NULL,
  made_unix_s INTEGER NOT NULL,
  until_unix_s INTEGER NOT NULL
) WITHOUT ROWID;

-- Who did what, and what was refused: an outcome is a gRPC status code.
CREATE TABLE actions (
  number INTEGER PRIMARY KEY,
  unix_ms INTEGER NOT NULL,
  who TEXT NOT NULL,
  proof TEXT NOT NULL,
  token TEXT NOT NULL,
  peer TEXT NOT NULL,
  what TEXT NOT NULL,
  job INTEGER NOT NULL,
  about TEXT NOT NULL,
  outcome INTEGER NOT NULL,
  message TEXT NOT NULL
);
-- Who gets nothing to render.
CREATE TABLE quarantine (
  worker TEXT PRIMARY KEY,
  machine TEXT NOT NULL,
  reason TEXT NOT NULL,
  since_unix_ms INTEGER NOT NULL
) WITHOUT ROWID;

-- One row: what decides which results are verified.
CREATE TABLE verification_secret (secret BLOB NOT NULL);
INSERT INTO verification_secret VALUES (randomblob(32));
)sql";

}  // namespace lightmill::sqlite
