// Tables and functions of the schema `lightmill`, format 10.
#pragma once

namespace lightmill::postgres {

/// In the table `meta`.
inline constexpr int kFormat = 10;

// One row with a checksum (summary.h). Each commit replaces it.
inline constexpr const char* kSummaryTable = R"sql(
CREATE TABLE summary (
  epoch BIGINT NOT NULL,
  commits BIGINT NOT NULL,
  highest_job BIGINT NOT NULL,
  sums BYTEA NOT NULL, -- over all rows (server/store/row_sums.h): lost and old rows are noticed
  checksum BIGINT NOT NULL
) WITH (fillfactor = 50);
)sql";

// `current_epoch` has one row. A commit updates its number of commits, which locks the row (not its key) until the
// commit ends. So commits of one epoch follow each other, and a repeated commit is noticed. A new epoch changes the
// key, so it begins between two commits. Other writers share the key.
// Small rows have one form (server/store/records.h). A job's specification, up to several MB, is written once or twice,
// its progress with every commit. Unsigned 64-bit numbers keep their bits. Pixels and assets do not compress.
inline constexpr const char* kSchema = R"sql(
CREATE TABLE meta (format BIGINT NOT NULL);
INSERT INTO meta VALUES (10);

CREATE TABLE current_epoch (
  epoch BIGINT PRIMARY KEY,
  commits BIGINT NOT NULL,
  highest_job BIGINT NOT NULL -- ids are never reused, even after deletes
) WITH (fillfactor = 50);
INSERT INTO current_epoch VALUES (0, 0, 0);

CREATE TABLE lease (
  instance TEXT NOT NULL, -- of the active coordinator; part of its connections' application_name
  holder TEXT NOT NULL,   -- the coordinator's name for people
  expires TIMESTAMPTZ NOT NULL
) WITH (fillfactor = 50);
INSERT INTO lease VALUES ('', '', '-infinity');

-- Begins the commit with this number in the caller's epoch.
CREATE FUNCTION begin_commit(mine BIGINT, number BIGINT) RETURNS VOID LANGUAGE plpgsql AS $$
DECLARE
  last RECORD;
BEGIN
  UPDATE current_epoch SET commits = number WHERE epoch = mine AND commits = number - 1;
  IF NOT FOUND THEN
    SELECT epoch, commits INTO last FROM current_epoch;
    IF last.epoch = mine AND last.commits = number THEN
      RAISE EXCEPTION 'commit % of epoch % is stored', number, mine USING ERRCODE = 'LM002';
    END IF;
    RAISE EXCEPTION 'this is epoch %, commit %, not epoch %, commit %', last.epoch, last.commits, mine, number - 1
      USING ERRCODE = 'LM001';
  END IF;
END $$;

-- Fails if the caller's epoch is over. Otherwise it lasts until this transaction ends.
CREATE FUNCTION fence(mine BIGINT) RETURNS VOID LANGUAGE plpgsql AS $$
BEGIN
  PERFORM 1 FROM current_epoch WHERE epoch = mine FOR KEY SHARE;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'epoch % is over', mine USING ERRCODE = 'LM001';
  END IF;
END $$;

-- Begins an epoch. new_epoch is 0 if another coordinator is active. Ends the connections of the previous coordinator,
-- with their open transactions.
CREATE FUNCTION take_lease(mine TEXT, my_name TEXT, seconds DOUBLE PRECISION, OUT new_epoch BIGINT, OUT held_by TEXT)
LANGUAGE plpgsql AS $$
DECLARE
  old RECORD;
BEGIN
  -- A read without a lock comes first, so a standby coordinator locks nothing.
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
  UPDATE current_epoch SET epoch = epoch + 1, commits = 0 RETURNING epoch INTO new_epoch;
  UPDATE lease SET instance = mine, holder = my_name, expires = clock_timestamp() + make_interval(secs => seconds);
END $$;

CREATE TABLE jobs (
  id BIGINT PRIMARY KEY,
  message BYTEA NOT NULL,
  checksum BIGINT NOT NULL
) WITH (fillfactor = 50);

CREATE TABLE job_specs (
  job BIGINT PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
  message BYTEA NOT NULL,
  checksum BIGINT NOT NULL
);

CREATE TABLE job_progress (
  job BIGINT PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
  message BYTEA NOT NULL,
  checksum BIGINT NOT NULL
) WITH (fillfactor = 50);

-- Films. A row is a node of a tile's forest. `hash` is row_hash_of(node), 16 bytes, high word first.
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

-- The origin of each merged result.
CREATE TABLE results (
  job BIGINT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  tile BIGINT NOT NULL,
  level BIGINT NOT NULL,
  range_index BIGINT NOT NULL,
  hash BYTEA NOT NULL,
  worker BYTEA NOT NULL,
  machine BYTEA NOT NULL,
  audit BIGINT NOT NULL, -- 1: another worker has to render it again; 2: one did, with the same bits
  fingerprint_class BYTEA NOT NULL, -- set for jobs that mix fingerprint classes
  checksum BIGINT NOT NULL, -- of the row; its two lowest bits are `audit`
  PRIMARY KEY (job, tile, level, range_index)
);

-- Assets. Uploads in progress have no digest.
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

CREATE TABLE tokens (
  id BYTEA PRIMARY KEY,
  message BYTEA NOT NULL,
  checksum BIGINT NOT NULL
);

CREATE TABLE actions (
  number BIGINT PRIMARY KEY,
  message BYTEA NOT NULL,
  checksum BIGINT NOT NULL
);

CREATE TABLE quarantine (
  worker BYTEA PRIMARY KEY,
  message BYTEA NOT NULL,
  checksum BIGINT NOT NULL
);

-- One row: the secret that selects results for audits. A random UUID has 122 bits of cryptographic quality.
CREATE TABLE audit_secret (
  secret BYTEA NOT NULL,
  checksum BYTEA NOT NULL -- SHA-256 of it
);
INSERT INTO audit_secret SELECT drawn, sha256(drawn) FROM (
  SELECT sha256(convert_to(
    gen_random_uuid()::text || gen_random_uuid()::text || gen_random_uuid()::text, 'UTF8'))) AS d (drawn);
)sql";

}  // namespace lightmill::postgres
