-- A database of format 8 as the program of that format wrote it; see ADatabaseOfFormat8IsMigratedAndKept.
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
CREATE TABLE lightmill.actions (
    number bigint NOT NULL,
    message bytea NOT NULL,
    checksum bigint NOT NULL
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
CREATE TABLE lightmill.audit_secret (
    secret bytea NOT NULL,
    checksum bytea NOT NULL
);
CREATE TABLE lightmill.job_progress (
    job bigint NOT NULL,
    message bytea NOT NULL,
    checksum bigint NOT NULL
)
WITH (fillfactor='50');
CREATE TABLE lightmill.job_specs (
    job bigint NOT NULL,
    message bytea NOT NULL,
    checksum bigint NOT NULL
);
CREATE TABLE lightmill.jobs (
    id bigint NOT NULL,
    message bytea NOT NULL,
    checksum bigint NOT NULL
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
    worker bytea NOT NULL,
    message bytea NOT NULL,
    checksum bigint NOT NULL
);
CREATE TABLE lightmill.results (
    job bigint NOT NULL,
    tile bigint NOT NULL,
    level bigint NOT NULL,
    range_index bigint NOT NULL,
    hash bytea NOT NULL,
    worker bytea NOT NULL,
    machine bytea NOT NULL,
    audit bigint NOT NULL,
    fingerprint_class bytea NOT NULL,
    checksum bigint NOT NULL
);
CREATE TABLE lightmill.summary (
    epoch bigint NOT NULL,
    commits bigint NOT NULL,
    highest_job bigint NOT NULL,
    keys bytea NOT NULL,
    checksum bigint NOT NULL
)
WITH (fillfactor='50');
CREATE TABLE lightmill.tokens (
    id bytea NOT NULL,
    message bytea NOT NULL,
    checksum bigint NOT NULL
);
CREATE TABLE lightmill.turn (
    epoch bigint NOT NULL,
    commits bigint NOT NULL,
    highest_job bigint NOT NULL
)
WITH (fillfactor='50');
INSERT INTO lightmill.actions VALUES (7, '\x08fbd095ffbc31120361646118022a0a5b3a3a315d3a34373131320943616e63656c4a6f623805', 2725924920151800568);
INSERT INTO lightmill.asset_pieces VALUES (1, 0, '\x616e206173736574');
INSERT INTO lightmill.assets OVERRIDING SYSTEM VALUE VALUES (1, '\xed30e78885a006305ad12c0ad1b686eaf2f1e53e0d0943af5c365eefba3bd3b2', 8, '2026-11-25 18:03:51.463519+00');
INSERT INTO lightmill.audit_secret VALUES ('\x994b94016946d777103c139476e8db00f536af584fdbf96d8546a54997b2b5bc', '\xf23444dab771a231cfdfedd0a874be45584c653ebc6e30be5dd722981a41fb4c');
INSERT INTO lightmill.job_progress VALUES (1, '\x099a9999999999b93f110000200065cdcd411a0e0801100218032004280530063807', 4019410235633841771);
INSERT INTO lightmill.job_progress VALUES (2, '\x099a9999999999b93f110000200065cdcd411a0e0801100218032004280530063807', 3590448043198879722);
INSERT INTO lightmill.job_specs VALUES (1, '\x0aa2020a09726571756573742d311294020a1061202771756f74656427206ec3a46d6512056f776e65721a0c686f73742e6578616d706c65206528f9ffffffffffffffff01321708ac02110000000000002940198d28ed0dbe30893f20013ab9010a0861007363656e65ff12203fc4ccfe745870e2c0d99f71f30ff0656c8dedd41cc1d7d3d376b0dbe685e2f312207692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed18800520e0032a0808011002181e2028320c0a0662656175747910031801320c0a06616c6265646f1004180132070a016e1003180232070a017a1001180332070a0169100118043890e4d0b287d3aeeefe0142077072657669657748ffffffff0f5206636f72652d78580541000000000000c03f4801124708011212697420697320746865206f6e6c79206f6e651208616e6420666173741a25706174683a20746865206c616d70277320636175737469637320617265206d697373696e671a06fe0001020000', -5468994642000132751);
INSERT INTO lightmill.job_specs VALUES (2, '\x0a9f020a09726571756573742d321291020a1061202771756f74656427206ec3a46d6512056f776e65721a0c686f73742e6578616d706c65206628f9ffffffffffffffff01321708ac02110000000000002940198d28ed0dbe30893f20013ab6010a0861007363656e65ff12203fc4ccfe745870e2c0d99f71f30ff0656c8dedd41cc1d7d3d376b0dbe685e2f312207692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed18800520e0032a0808011002181e2028320c0a0662656175747910031801320c0a06616c6265646f1004180132070a016e1003180232070a017a1001180332070a0169100118043890e4d0b287d3aeeefe0142046175746f48ffffffff0f5206636f72652d78580541000000000000c03f480112190801120674776f20646f2204706174682207776869747465641a06fe0001020000', 7618890045419859821);
INSERT INTO lightmill.jobs VALUES (1, '\x0a1708ac02110000000000002940198d28ed0dbe30893f200110f9ffffffffffffffff01180322076265636175736528033205636c61737338fbd095ffbc3140c8d395ffbc314a2609000000000000304011000000000000f83f1a1209000000000000e03f11000000000000d03f4a260900000000008038401100000000000008401a1209000000000000d03f11000000000000c03f', -8309603390973740882);
INSERT INTO lightmill.jobs VALUES (2, '\x0a1708ac02110000000000002940198d28ed0dbe30893f200110f9ffffffffffffffff01180322076265636175736528033205636c61737338fbd095ffbc3140c8d395ffbc31', 2395504067401204034);
INSERT INTO lightmill.lease VALUES ('0041b91f14cad2dd', 'vm, process 10261', '-infinity');
INSERT INTO lightmill.meta VALUES (8);
INSERT INTO lightmill.nodes VALUES (1, 0, 1, 0, 1, '\x38862d7a549d6ca9339f1a7a0c13165c', '\x0000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040555555bf');
INSERT INTO lightmill.nodes VALUES (1, 3, 0, 4, 4, '\xe947e4958752b8a4b653506f74df1ddc', '\x6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d6042a28d8058d80c');
INSERT INTO lightmill.quarantine VALUES ('\x6c696172', '\x0a076d616368696e65120577726f6e671805', -2197699786411178856);
INSERT INTO lightmill.results VALUES (1, 0, 0, 0, '\x00000000000000030000000000000004', '\x776f726b6572', '\x6d616368696e65', 0, '\x636c6173732d62', 3829115423992908060);
INSERT INTO lightmill.results VALUES (1, 0, 0, 1, '\x00000000000000010000000000000002', '\x776f726b6572', '\x6d616368696e65', 1, '\x', -5638709439906050083);
INSERT INTO lightmill.results VALUES (1, 3, 0, 4, '\x00000000000000050000000000000006', '\x6f74686572', '\x6d616368696e65', 0, '\x', -1644392591434564092);
INSERT INTO lightmill.summary VALUES (1, 0, 3, '\xde9dd2be9c87a421a428821382b91d9ab19da120d50d5672b7a7fd749e528457511bf32e26d892b68e6297e0ea83e4da', -4067936652035319979);
INSERT INTO lightmill.tokens VALUES ('\x303031313232333361616262', '\x0a0d61646120277827206ec3a46d65120c766965772c207375626d69741a207692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed2204726f6f7428013080e6fe8907', -8851465271702907077);
INSERT INTO lightmill.turn VALUES (2, 0, 3);
SELECT pg_catalog.setval('lightmill.assets_id_seq', 2, true);
ALTER TABLE ONLY lightmill.actions
    ADD CONSTRAINT actions_pkey PRIMARY KEY (number);
ALTER TABLE ONLY lightmill.asset_pieces
    ADD CONSTRAINT asset_pieces_pkey PRIMARY KEY (asset, "position");
ALTER TABLE ONLY lightmill.assets
    ADD CONSTRAINT assets_digest_key UNIQUE (digest);
ALTER TABLE ONLY lightmill.assets
    ADD CONSTRAINT assets_pkey PRIMARY KEY (id);
ALTER TABLE ONLY lightmill.job_progress
    ADD CONSTRAINT job_progress_pkey PRIMARY KEY (job);
ALTER TABLE ONLY lightmill.job_specs
    ADD CONSTRAINT job_specs_pkey PRIMARY KEY (job);
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
ALTER TABLE ONLY lightmill.job_progress
    ADD CONSTRAINT job_progress_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.job_specs
    ADD CONSTRAINT job_specs_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.nodes
    ADD CONSTRAINT nodes_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
ALTER TABLE ONLY lightmill.results
    ADD CONSTRAINT results_job_fkey FOREIGN KEY (job) REFERENCES lightmill.jobs(id) ON DELETE CASCADE;
