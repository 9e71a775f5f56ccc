-- A database of format 6 as the program of that format wrote it; see ADatabaseOfThePreviousFormatIsMigratedAndKept.
SET statement_timeout = 0;
SET lock_timeout = 0;
SET idle_in_transaction_session_timeout = 0;
SET client_encoding = 'UTF8';
SET standard_conforming_strings = on;
SELECT pg_catalog.set_config('search_path', '', false);
SET check_function_bodies = false;
SET xmloption = content;
SET client_min_messages = warning;
SET row_security = off;
CREATE SCHEMA lightmill;
CREATE FUNCTION lightmill.fence(mine bigint) RETURNS void
    LANGUAGE plpgsql
    AS $$
BEGIN
  PERFORM 1 FROM turn WHERE epoch = mine FOR KEY SHARE;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'epoch % is over', mine USING ERRCODE = 'LM001';
  END IF;
END $$;
CREATE FUNCTION lightmill.take_lease(mine text, my_name text, seconds double precision, OUT new_epoch bigint, OUT held_by text) RETURNS record
    LANGUAGE plpgsql
    AS $$
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
CREATE FUNCTION lightmill.take_turn(mine bigint, number bigint) RETURNS void
    LANGUAGE plpgsql
    AS $$
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
SET default_tablespace = '';
SET default_table_access_method = heap;
CREATE TABLE lightmill.actions (
    number bigint NOT NULL,
    unix_ms bigint NOT NULL,
    who text NOT NULL,
    proof text NOT NULL,
    token text NOT NULL,
    peer text NOT NULL,
    what text NOT NULL,
    job bigint NOT NULL,
    about text NOT NULL,
    outcome bigint NOT NULL,
    message text NOT NULL
);
CREATE TABLE lightmill.asset_pieces (
    asset bigint NOT NULL,
    "position" bigint NOT NULL,
    bytes bytea NOT NULL
);
ALTER TABLE ONLY lightmill.asset_pieces ALTER COLUMN bytes SET STORAGE EXTERNAL;
CREATE TABLE lightmill.assets (
    id bigint NOT NULL,
    digest bytea,
    size_bytes bigint NOT NULL,
    stored timestamp with time zone NOT NULL
);
ALTER TABLE lightmill.assets ALTER COLUMN id ADD GENERATED ALWAYS AS IDENTITY (
    SEQUENCE NAME lightmill.assets_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1
);
CREATE TABLE lightmill.job_assets (
    job bigint NOT NULL,
    "position" bigint NOT NULL,
    digest bytea NOT NULL
);
CREATE TABLE lightmill.job_errors (
    job bigint NOT NULL,
    samples double precision NOT NULL,
    worker_seconds double precision NOT NULL,
    rel_mse double precision NOT NULL,
    half_width double precision NOT NULL
);
CREATE TABLE lightmill.job_layers (
    job bigint NOT NULL,
    "position" bigint NOT NULL,
    name text NOT NULL,
    channels bigint NOT NULL,
    kind text NOT NULL
);
CREATE TABLE lightmill.job_settings (
    job bigint NOT NULL,
    scene bytea NOT NULL,
    width bigint NOT NULL,
    height bigint NOT NULL,
    crop_x bigint NOT NULL,
    crop_y bigint NOT NULL,
    crop_width bigint NOT NULL,
    crop_height bigint NOT NULL,
    seed bigint NOT NULL,
    max_bounces bigint NOT NULL,
    renderer_version text NOT NULL,
    meters bigint NOT NULL,
    method text NOT NULL,
    method_chosen bigint NOT NULL,
    method_reasons text NOT NULL,
    method_notices text NOT NULL,
    method_candidates text NOT NULL,
    allocation bytea NOT NULL
);
CREATE TABLE lightmill.jobs (
    id bigint NOT NULL,
    request_id text NOT NULL,
    name text NOT NULL,
    owner text NOT NULL,
    host text NOT NULL,
    parent bigint NOT NULL,
    priority bigint NOT NULL,
    goal_samples bigint NOT NULL,
    goal_seconds double precision NOT NULL,
    goal_error double precision NOT NULL,
    goal_adaptive bigint NOT NULL,
    state text NOT NULL,
    reason text NOT NULL,
    reached text NOT NULL,
    fingerprint_class text NOT NULL,
    active_seconds double precision NOT NULL,
    worker_seconds double precision NOT NULL,
    results_merged bigint NOT NULL,
    results_duplicate bigint NOT NULL,
    leases_lost bigint NOT NULL,
    copies_leased bigint NOT NULL,
    non_finite bigint NOT NULL,
    submitted_unix_ms bigint NOT NULL,
    finished_unix_ms bigint NOT NULL,
    verify_share double precision NOT NULL,
    results_verified bigint NOT NULL,
    nodes_dropped bigint NOT NULL,
    allow_mixed bigint NOT NULL,
    checksum bytea NOT NULL
)
WITH (fillfactor='50');
CREATE TABLE lightmill.lease (
    instance text NOT NULL,
    holder text NOT NULL,
    expires timestamp with time zone NOT NULL
)
WITH (fillfactor='50');
CREATE TABLE lightmill.meta (
    format bigint NOT NULL
);
CREATE TABLE lightmill.nodes (
    job bigint NOT NULL,
    tile bigint NOT NULL,
    level bigint NOT NULL,
    range_index bigint NOT NULL,
    non_finite bigint NOT NULL,
    hash bytea NOT NULL,
    samples bytea NOT NULL
)
WITH (autovacuum_vacuum_scale_factor='0.05', toast.autovacuum_vacuum_scale_factor='0.05');
ALTER TABLE ONLY lightmill.nodes ALTER COLUMN samples SET STORAGE EXTERNAL;
CREATE TABLE lightmill.quarantine (
    worker text NOT NULL,
    machine text NOT NULL,
    reason text NOT NULL,
    since_unix_ms bigint NOT NULL
);
CREATE TABLE lightmill.results (
    job bigint NOT NULL,
    tile bigint NOT NULL,
    level bigint NOT NULL,
    range_index bigint NOT NULL,
    hash bytea NOT NULL,
    worker text NOT NULL,
    machine text NOT NULL,
    verification bigint NOT NULL,
    fingerprint_class text NOT NULL,
    checksum bigint NOT NULL
);
CREATE TABLE lightmill.tokens (
    id text NOT NULL,
    name text NOT NULL,
    roles text NOT NULL,
    hash bytea NOT NULL,
    made_by text NOT NULL,
    made_unix_s bigint NOT NULL,
    until_unix_s bigint NOT NULL
);
CREATE TABLE lightmill.turn (
    epoch bigint NOT NULL,
    commits bigint NOT NULL,
    highest_job bigint NOT NULL
)
WITH (fillfactor='50');
CREATE TABLE lightmill.verification_secret (
    secret bytea NOT NULL
);
INSERT INTO lightmill.actions VALUES (7, 1700000000123, 'ada', 'certificate', '', '[::1]:4711', 'CancelJob', 5, '', 0, '');
INSERT INTO lightmill.asset_pieces VALUES (1, 0, '\x616e206173736574');
INSERT INTO lightmill.assets OVERRIDING SYSTEM VALUE VALUES (1, '\xed30e78885a006305ad12c0ad1b686eaf2f1e53e0d0943af5c365eefba3bd3b2', 8, '2026-11-25 18:03:51.463519+00');
INSERT INTO lightmill.job_assets VALUES (1, 0, '\x3fc4ccfe745870e2c0d99f71f30ff0656c8dedd41cc1d7d3d376b0dbe685e2f3');
INSERT INTO lightmill.job_assets VALUES (1, 1, '\x7692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed');
INSERT INTO lightmill.job_assets VALUES (2, 0, '\x3fc4ccfe745870e2c0d99f71f30ff0656c8dedd41cc1d7d3d376b0dbe685e2f3');
INSERT INTO lightmill.job_assets VALUES (2, 1, '\x7692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed');
INSERT INTO lightmill.job_errors VALUES (1, 16, 1.5, 0.5, 0.25);
INSERT INTO lightmill.job_errors VALUES (1, 24.5, 3, 0.25, 0.125);
INSERT INTO lightmill.job_layers VALUES (1, 0, 'beauty', 3, 'summed');
INSERT INTO lightmill.job_layers VALUES (1, 1, 'albedo', 4, 'summed');
INSERT INTO lightmill.job_layers VALUES (1, 2, 'n', 3, 'first_mean');
INSERT INTO lightmill.job_layers VALUES (1, 3, 'z', 1, 'first_nearest');
INSERT INTO lightmill.job_layers VALUES (1, 4, 'i', 1, 'first_samples');
INSERT INTO lightmill.job_layers VALUES (2, 0, 'beauty', 3, 'summed');
INSERT INTO lightmill.job_layers VALUES (2, 1, 'albedo', 4, 'summed');
INSERT INTO lightmill.job_layers VALUES (2, 2, 'n', 3, 'first_mean');
INSERT INTO lightmill.job_layers VALUES (2, 3, 'z', 1, 'first_nearest');
INSERT INTO lightmill.job_layers VALUES (2, 4, 'i', 1, 'first_samples');
INSERT INTO lightmill.job_settings VALUES (1, '\x61007363656e65ff', 640, 480, 1, 2, 30, 40, -81985529216486896, 4294967295, 'core-x', 5, 'preview', 1, 'it is the only one
and fast
', 'path: the lamp''s caustics are missing
', '', '\xfe0001020000');
INSERT INTO lightmill.job_settings VALUES (2, '\x61007363656e65ff', 640, 480, 1, 2, 30, 40, -81985529216486896, 4294967295, 'core-x', 5, 'auto', 1, 'two do
', '', 'path
whitted
', '\xfe0001020000');
INSERT INTO lightmill.jobs VALUES (1, 'request-1', 'a ''quoted'' näme', 'owner', 'host.example', 101, -7, 300, 12.5, 0.0123, 1, 'paused', 'because', 'error', 'class', 0.1, 1000000000.25, 1, 2, 3, 4, 5, 1700000000123, 1700000000456, 0.125, 6, 7, 1, '\x2a933c020c86dcfb2b7be7f8169a50a9');
INSERT INTO lightmill.jobs VALUES (2, 'request-2', 'a ''quoted'' näme', 'owner', 'host.example', 102, -7, 300, 12.5, 0.0123, 1, 'paused', 'because', 'error', 'class', 0.1, 1000000000.25, 1, 2, 3, 4, 5, 1700000000123, 1700000000456, 0.125, 6, 7, 1, '\x4cdbcbcdc70966f7da10e2bcc28751b0');
INSERT INTO lightmill.lease VALUES ('8b12cf8b553af526', 'vm, process 28804', '-infinity');
INSERT INTO lightmill.meta VALUES (6);
INSERT INTO lightmill.nodes VALUES (1, 0, 1, 0, 1, '\x38862d7a549d6ca9339f1a7a0c13165c', '\x0000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040555555bf');
INSERT INTO lightmill.nodes VALUES (1, 3, 0, 4, 4, '\xe947e4958752b8a4b653506f74df1ddc', '\x6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d8058d80c');
INSERT INTO lightmill.quarantine VALUES ('liar', 'machine', 'wrong', 5);
INSERT INTO lightmill.results VALUES (1, 0, 0, 0, '\x00000000000000030000000000000004', 'worker', 'machine', 0, 'class-b', 6977271438046117709);
INSERT INTO lightmill.results VALUES (1, 0, 0, 1, '\x00000000000000010000000000000002', 'worker', 'machine', 1, '', -7582847424312677924);
INSERT INTO lightmill.results VALUES (1, 3, 0, 4, '\x00000000000000050000000000000006', 'other', 'machine', 2, '', 693025874697356232);
INSERT INTO lightmill.tokens VALUES ('00112233aabb', 'ada ''x'' näme', 'view, submit', '\x7692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed', 'root', 1, 1900000000);
INSERT INTO lightmill.turn VALUES (1, 2, 3);
INSERT INTO lightmill.verification_secret VALUES ('\x994b94016946d777103c139476e8db00f536af584fdbf96d8546a54997b2b5bc');
SELECT pg_catalog.setval('lightmill.assets_id_seq', 1, true);
ALTER TABLE ONLY lightmill.actions
    ADD CONSTRAINT actions_pkey PRIMARY KEY (number);
ALTER TABLE ONLY lightmill.asset_pieces
    ADD CONSTRAINT asset_pieces_pkey PRIMARY KEY (asset, "position");
ALTER TABLE ONLY lightmill.assets
    ADD CONSTRAINT assets_digest_key UNIQUE (digest);
ALTER TABLE ONLY lightmill.assets
    ADD CONSTRAINT assets_pkey PRIMARY KEY (id);
ALTER TABLE ONLY lightmill.job_assets
    ADD CONSTRAINT job_assets_pkey PRIMARY KEY (job, "position");
ALTER TABLE ONLY lightmill.job_errors
    ADD CONSTRAINT job_errors_pkey PRIMARY KEY (job, samples);
ALTER TABLE ONLY lightmill.job_layers
    ADD CONSTRAINT job_layers_pkey PRIMARY KEY (job, "position");
ALTER TABLE ONLY lightmill.job_settings
    ADD CONSTRAINT job_settings_pkey PRIMARY KEY (job);
ALTER TABLE ONLY lightmill.jobs
    ADD CONSTRAINT jobs_pkey PRIMARY KEY (id);
ALTER TABLE ONLY lightmill.nodes
    ADD CONSTRAINT nodes_pkey PRIMARY KEY (job, tile, level, range_index);
ALTER TABLE ONLY lightmill.quarantine
    ADD CONSTRAINT quarantine_pkey PRIMARY KEY (worker);
ALTER TABLE ONLY lightmill.results
    ADD CONSTRAINT results_pkey PRIMARY KEY (job, tile, level, range_index);
ALTER TABLE ONLY lightmill.tokens
    ADD CONSTRAINT tokens_pkey PRIMARY KEY (id);
ALTER TABLE ONLY lightmill.turn
    ADD CONSTRAINT turn_pkey PRIMARY KEY (epoch);
ALTER TABLE ONLY lightmill.asset_pieces
    ADD CONSTRAINT asset_pieces_asset_fkey FOREIGN KEY (asset) REFERENCES lightmill.assets(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.job_assets
    ADD CONSTRAINT job_assets_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.job_errors
    ADD CONSTRAINT job_errors_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.job_layers
    ADD CONSTRAINT job_layers_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.job_settings
    ADD CONSTRAINT job_settings_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.nodes
    ADD CONSTRAINT nodes_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.results
    ADD CONSTRAINT results_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
