// The tables and functions in the schema `lightmill` of the database, format 6.
#pragma once

namespace lightmill::postgres {

/// Kept in the table `meta`.
inline constexpr int kFormat = 6;

// `turn` has one row. A commit counts itself there, which locks the row (not its key) until the commit's end: so
// commits of one epoch follow each other, one that comes twice is noticed, and a new epoch, which changes the key,
// begins between two. Other writers share the key. `lease` says who is at work, and until when it is believed without
// news.
//
// Settings are written once per job, and again if its method was still to be chosen; the row in `jobs` changes with
// every commit and stays small. Numbers of 64 bits without sign are stored by their bits. Pixels and assets do not
// compress, so they are stored as they are.
inline constexpr const char* kSchema = R"sql(
CREATE TABLE meta (format BIGINT NOT NULL);
INSERT INTO meta VALUES (6);

CREATE TABLE turn (
  epoch BIGINT PRIMARY KEY,
  commits BIGINT NOT NULL,
  highest_job BIGINT NOT NULL -- ids are never used again, also after deletes
) WITH (fillfactor = 50);
INSERT INTO turn VALUES (0, 0, 0);

CREATE TABLE lease (
  instance TEXT NOT NULL, -- of the coordinator at work; a part of its connections' application_name
  holder TEXT NOT NULL,   -- the same for people
  expires TIMESTAMPTZ NOT NULL
) WITH (fillfactor = 50);
INSERT INTO lease VALUES ('', '', '-infinity');

-- The transaction numbered so within the caller's epoch begins.
CREATE FUNCTION take_turn(mine BIGINT, number BIGINT) RETURNS VOID LANGUAGE plpgsql AS $$
DECLARE
  last RECORD;
BEGIN
  UPDATE turn SET commits = number WHERE epoch = mine AND commits = number - 1;
  IF NOT FOUND THEN
    SELECT epoch, commits INTO last FROM turn;
    IF last.epoch = mine AND last.commits = number THEN
      RAISE EXCEPTION 'commit % of epoch % is stored', number, mine USING ERRCODE = 'LM002';
    END IF;
    RAISE EXCEPTION 'this is epoch %, commit %, not epoch %, commit %', last.epoch, last.commits, mine, number - 1
      USING ERRCODE = 'LM001';
  END IF;
END $$;

-- What follows in this transaction is done within the caller's epoch.
CREATE FUNCTION fence(mine BIGINT) RETURNS VOID LANGUAGE plpgsql AS $$
BEGIN
  PERFORM 1 FROM turn WHERE epoch = mine FOR KEY SHARE;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'epoch % is over', mine USING ERRCODE = 'LM001';
  END IF;
END $$;

-- Begins an epoch, unless another coordinator is at work: then new_epoch is 0. What the one before has left undone is
-- ended with its connections.
CREATE FUNCTION take_lease(mine TEXT, my_name TEXT, seconds DOUBLE PRECISION, OUT new_epoch BIGINT, OUT held_by TEXT)
LANGUAGE plpgsql AS $$
DECLARE
  old RECORD;
BEGIN
  -- Who only looks locks nothing.
  SELECT instance, holder, expires <= clock_timestamp() AS expired INTO old FROM lease;
  IF old.instance = mine OR old.expired THEN
    SELECT instance, holder, expires <= clock_timestamp() AS expired INTO old FROM lease FOR UPDATE;
  END IF;
  held_by := old.holder;
  IF old.instance <> mine AND NOT old.expired THEN
    new_epoch := 0;
    RETURN;
  END IF;
  IF old.instance <> mine AND old.instance <> '' THEN
    PERFORM pg_terminate_backend(pid) FROM pg_stat_activity
      WHERE datname = current_database() AND application_name = 'lightmill-server ' || old.instance;
  END IF;
  UPDATE turn SET epoch = epoch + 1, commits = 0 RETURNING epoch INTO new_epoch;
  UPDATE lease SET instance = mine, holder = my_name, expires = clock_timestamp() + make_interval(secs => seconds);
END $$;

CREATE TABLE jobs (
  id BIGINT PRIMARY KEY,
  request_id TEXT NOT NULL,
  name TEXT NOT NULL,
  owner TEXT NOT NULL,
  host TEXT NOT NULL,
  parent BIGINT NOT NULL,
  priority BIGINT NOT NULL,
  goal_samples BIGINT NOT NULL,
  goal_seconds DOUBLE PRECISION NOT NULL,
  goal_error DOUBLE PRECISION NOT NULL,
  goal_adaptive BIGINT NOT NULL,
  state TEXT NOT NULL,
  reason TEXT NOT NULL,
  reached TEXT NOT NULL,
  fingerprint_class TEXT NOT NULL,
  active_seconds DOUBLE PRECISION NOT NULL,
  worker_seconds DOUBLE PRECISION NOT NULL,
  results_merged BIGINT NOT NULL,
  results_duplicate BIGINT NOT NULL,
  leases_lost BIGINT NOT NULL,
  copies_leased BIGINT NOT NULL,
  non_finite BIGINT NOT NULL,
  submitted_unix_ms BIGINT NOT NULL,
  finished_unix_ms BIGINT NOT NULL,
  verify_share DOUBLE PRECISION NOT NULL,
  results_verified BIGINT NOT NULL,
  nodes_dropped BIGINT NOT NULL,
  allow_mixed BIGINT NOT NULL,
  checksum BYTEA NOT NULL -- of all that is stored of the job but what counts up
) WITH (fillfactor = 50);

-- How a job's error fell; samples are per pixel.
CREATE TABLE job_errors (
  job BIGINT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  samples DOUBLE PRECISION NOT NULL,
  worker_seconds DOUBLE PRECISION NOT NULL,
  rel_mse DOUBLE PRECISION NOT NULL,
  half_width DOUBLE PRECISION NOT NULL,
  PRIMARY KEY (job, samples)
);

CREATE TABLE job_settings (
  job BIGINT PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
  scene BYTEA NOT NULL,
  width BIGINT NOT NULL,
  height BIGINT NOT NULL,
  crop_x BIGINT NOT NULL,
  crop_y BIGINT NOT NULL,
  crop_width BIGINT NOT NULL,
  crop_height BIGINT NOT NULL,
  seed BIGINT NOT NULL,
  max_bounces BIGINT NOT NULL,
  renderer_version TEXT NOT NULL,
  meters BIGINT NOT NULL,
  method TEXT NOT NULL,
  method_chosen BIGINT NOT NULL,
  method_reasons TEXT NOT NULL,
  method_notices TEXT NOT NULL,
  method_candidates TEXT NOT NULL,
  allocation BYTEA NOT NULL -- a byte a tile, signed: what it gets is 2^this of the mean; empty: all the same
);

CREATE TABLE job_assets (
  job BIGINT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position BIGINT NOT NULL,
  digest BYTEA NOT NULL,
  PRIMARY KEY (job, position)
);

CREATE TABLE job_layers (
  job BIGINT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position BIGINT NOT NULL,
  name TEXT NOT NULL,
  channels BIGINT NOT NULL,
  kind TEXT NOT NULL,
  PRIMARY KEY (job, position)
);

-- The films: each row one node of a tile's forest; hash is hash_of(node), 16 bytes, high word first. Nodes live shortly.
CREATE TABLE nodes (
  job BIGINT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  tile BIGINT NOT NULL,
  level BIGINT NOT NULL,
  range_index BIGINT NOT NULL,
  non_finite BIGINT NOT NULL,
  hash BYTEA NOT NULL,
  samples BYTEA NOT NULL,
  PRIMARY KEY (job, tile, level, range_index)
) WITH (autovacuum_vacuum_scale_factor = 0.05, toast.autovacuum_vacuum_scale_factor = 0.05);
ALTER TABLE nodes ALTER COLUMN samples SET STORAGE EXTERNAL;

-- Who computed every merged result.
CREATE TABLE results (
  job BIGINT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  tile BIGINT NOT NULL,
  level BIGINT NOT NULL,
  range_index BIGINT NOT NULL,
  hash BYTEA NOT NULL,
  worker TEXT NOT NULL,
  machine TEXT NOT NULL,
  verification BIGINT NOT NULL, -- 1: to be rendered again on another machine; 2: was, with the same bits
  fingerprint_class TEXT NOT NULL, -- of jobs that allow mixed ones
  checksum BIGINT NOT NULL, -- of the row but `verification`; never 0
  PRIMARY KEY (job, tile, level, range_index)
);

-- Assets; those without a digest are being uploaded.
CREATE TABLE assets (
  id BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  digest BYTEA UNIQUE,
  size_bytes BIGINT NOT NULL,
  stored TIMESTAMPTZ NOT NULL
);
CREATE TABLE asset_pieces (
  asset BIGINT NOT NULL REFERENCES assets (id) ON DELETE CASCADE,
  position BIGINT NOT NULL,
  bytes BYTEA NOT NULL,
  PRIMARY KEY (asset, position)
);
ALTER TABLE asset_pieces ALTER COLUMN bytes SET STORAGE EXTERNAL;

-- Who gets in by a token; hash is the SHA-256 of its text.
CREATE TABLE tokens (
  id TEXT PRIMARY KEY,
  name TEXT NOT NULL,
  roles TEXT NOT NULL,
  hash BYTEA NOT NULL,
  made_by TEXT NOT NULL,
  made_unix_s BIGINT NOT NULL,
  until_unix_s BIGINT NOT NULL
);

-- Who did what, and what was refused: an outcome is a gRPC status code.
CREATE TABLE actions (
  number BIGINT PRIMARY KEY,
  unix_ms BIGINT NOT NULL,
  who TEXT NOT NULL,
  proof TEXT NOT NULL,
  token TEXT NOT NULL,
  peer TEXT NOT NULL,
  what TEXT NOT NULL,
  job BIGINT NOT NULL,
  about TEXT NOT NULL,
  outcome BIGINT NOT NULL,
  message TEXT NOT NULL
);
-- Who gets nothing to render.
CREATE TABLE quarantine (
  worker TEXT PRIMARY KEY,
  machine TEXT NOT NULL,
  reason TEXT NOT NULL,
  since_unix_ms BIGINT NOT NULL
);

-- One row: what decides which results are verified. Random UUIDs are drawn as keys are; each has 122 random bits.
CREATE TABLE verification_secret (secret BYTEA NOT NULL);
INSERT INTO verification_secret
  SELECT sha256(convert_to(gen_random_uuid()::text || gen_random_uuid()::text || gen_random_uuid()::text, 'UTF8'));
)sql";

}  // namespace lightmill::postgres
