// The tables of the store's file, format 12.
#pragma once

#include <array>

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
  goal_error REAL NOT NULL DEFAULT 0,
  reached TEXT NOT NULL DEFAULT '',
  goal_adaptive INTEGER NOT NULL DEFAULT 0,
  verify_share REAL NOT NULL DEFAULT 0.01,
  results_verified INTEGER NOT NULL DEFAULT 0,
  nodes_dropped INTEGER NOT NULL DEFAULT 0,
  allow_mixed INTEGER NOT NULL DEFAULT 0,
  checksum BLOB NOT NULL DEFAULT x'' -- of all that is stored of the job but what counts up; empty: not known yet
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
  meters INTEGER NOT NULL DEFAULT 0,
  method_chosen INTEGER NOT NULL DEFAULT 0,
  method_reasons TEXT NOT NULL DEFAULT '',
  method_notices TEXT NOT NULL DEFAULT '',
  method_candidates TEXT NOT NULL DEFAULT '',
  allocation BLOB NOT NULL DEFAULT x'' -- a byte a tile, signed: what it gets is 2^this of the mean; empty: all the same
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
  machine TEXT NOT NULL DEFAULT '',
  verification INTEGER NOT NULL DEFAULT 0, -- 1: to be rendered again on another machine; 2: was, with the same bits
  fingerprint_class TEXT NOT NULL DEFAULT '', -- of jobs that allow mixed ones
  checksum INTEGER NOT NULL DEFAULT 0, -- of the row but `verification`; 0: from a format before 12
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

/// From format 1, which knew no meters.
inline constexpr const char* kFromFormat1 = R"sql(
ALTER TABLE job_settings ADD COLUMN meters INTEGER NOT NULL DEFAULT 0;
)sql";

/// From format 2, which knew no goal in error, and told the limit that ended a job in words alone.
inline constexpr const char* kFromFormat2 = R"sql(
ALTER TABLE jobs ADD COLUMN goal_error REAL NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN reached TEXT NOT NULL DEFAULT '';
)sql";

/// From format 3, which knew nothing of how a job came by its method. Texts stand one a line.
inline constexpr const char* kFromFormat3 = R"sql(
ALTER TABLE job_settings ADD COLUMN method_chosen INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job_settings ADD COLUMN method_reasons TEXT NOT NULL DEFAULT '';
ALTER TABLE job_settings ADD COLUMN method_notices TEXT NOT NULL DEFAULT '';
)sql";

/// From format 4, which knew no history of a job's error.
inline constexpr const char* kFromFormat4 = R"sql(
CREATE TABLE job_errors (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  samples REAL NOT NULL,
  worker_seconds REAL NOT NULL,
  rel_mse REAL NOT NULL,
  half_width REAL NOT NULL,
  PRIMARY KEY (job, samples)
) WITHOUT ROWID;
)sql";

/// From format 5, which chose methods without trying them.
inline constexpr const char* kFromFormat5 = R"sql(
ALTER TABLE job_settings ADD COLUMN method_candidates TEXT NOT NULL DEFAULT '';
)sql";

/// From format 6, which gave all tiles the same.
inline constexpr const char* kFromFormat6 = R"sql(
ALTER TABLE jobs ADD COLUMN goal_adaptive INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job_settings ADD COLUMN allocation BLOB NOT NULL DEFAULT x'';
)sql";

/// From format 7, which knew no tokens.
inline constexpr const char* kFromFormat7 = R"sql(
CREATE TABLE tokens (
  id TEXT PRIMARY KEY,
  name TEXT NOT NULL,
  roles TEXT NOT NULL,
  hash BLOB NOT NULL,
  made_by TEXT NOT NULL,
  made_unix_s INTEGER NOT NULL,
  until_unix_s INTEGER NOT NULL
) WITHOUT ROWID;
)sql";

/// From format 8, which recorded nothing.
inline constexpr const char* kFromFormat8 = R"sql(
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
)sql";

/// From format 9, which verified nothing.
inline constexpr const char* kFromFormat9 = R"sql(
ALTER TABLE jobs ADD COLUMN verify_share REAL NOT NULL DEFAULT 0.01;
ALTER TABLE jobs ADD COLUMN results_verified INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN nodes_dropped INTEGER NOT NULL DEFAULT 0;
ALTER TABLE results ADD COLUMN machine TEXT NOT NULL DEFAULT '';
ALTER TABLE results ADD COLUMN verification INTEGER NOT NULL DEFAULT 0;
CREATE TABLE quarantine (
  worker TEXT PRIMARY KEY,
  machine TEXT NOT NULL,
  reason TEXT NOT NULL,
  since_unix_ms INTEGER NOT NULL
) WITHOUT ROWID;
CREATE TABLE verification_secret (secret BLOB NOT NULL);
INSERT INTO verification_secret VALUES (randomblob(32));
)sql";

/// From format 10, in which a job's results were all of one class.
inline constexpr const char* kFromFormat10 = R"sql(
ALTER TABLE jobs ADD COLUMN allow_mixed INTEGER NOT NULL DEFAULT 0;
ALTER TABLE results ADD COLUMN fingerprint_class TEXT NOT NULL DEFAULT '';
)sql";

/// From format 11, which noticed damage in nodes and assets alone.
inline constexpr const char* kFromFormat11 = R"sql(
ALTER TABLE jobs ADD COLUMN checksum BLOB NOT NULL DEFAULT x'';
ALTER TABLE results ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
)sql";

/// By the format that they lead away from, less one.
inline constexpr std::array kSteps{kFromFormat1, kFromFormat2, kFromFormat3, kFromFormat4,  kFromFormat5, kFromFormat6,
                                   kFromFormat7, kFromFormat8, kFromFormat9, kFromFormat10, kFromFormat11};

}  // namespace lightmill::sqlite
