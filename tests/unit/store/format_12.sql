-- A store of format 12 as the program of that format wrote it; see AStoreOfThePreviousFormatIsConvertedAndKept.
PRAGMA application_id = 1280133452;
PRAGMA user_version = 12;
BEGIN TRANSACTION;
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
INSERT INTO "actions" VALUES(7,1700000000123,'ada','certificate','','[::1]:4711','CancelJob',5,'',0,'');
CREATE TABLE job_assets (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  digest BLOB NOT NULL,
  PRIMARY KEY (job, position)
) WITHOUT ROWID;
INSERT INTO "job_assets" VALUES(1,0,X'3FC4CCFE745870E2C0D99F71F30FF0656C8DEDD41CC1D7D3D376B0DBE685E2F3');
INSERT INTO "job_assets" VALUES(1,1,X'7692C3AD3540BB803C020B3AEE66CD8887123234EA0C6E7143C0ADD73FF431ED');
INSERT INTO "job_assets" VALUES(2,0,X'3FC4CCFE745870E2C0D99F71F30FF0656C8DEDD41CC1D7D3D376B0DBE685E2F3');
INSERT INTO "job_assets" VALUES(2,1,X'7692C3AD3540BB803C020B3AEE66CD8887123234EA0C6E7143C0ADD73FF431ED');
CREATE TABLE job_errors (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  samples REAL NOT NULL,
  worker_seconds REAL NOT NULL,
  rel_mse REAL NOT NULL,
  half_width REAL NOT NULL,
  PRIMARY KEY (job, samples)
) WITHOUT ROWID;
INSERT INTO "job_errors" VALUES(1,16.0,1.5,0.5,0.25);
INSERT INTO "job_errors" VALUES(1,24.5,3.0,0.25,0.125);
CREATE TABLE job_layers (
  job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  channels INTEGER NOT NULL,
  kind TEXT NOT NULL,
  PRIMARY KEY (job, position)
) WITHOUT ROWID;
INSERT INTO "job_layers" VALUES(1,0,'beauty',3,'summed');
INSERT INTO "job_layers" VALUES(1,1,'albedo',4,'summed');
INSERT INTO "job_layers" VALUES(1,2,'n',3,'first_mean');
INSERT INTO "job_layers" VALUES(1,3,'z',1,'first_nearest');
INSERT INTO "job_layers" VALUES(1,4,'i',1,'first_samples');
INSERT INTO "job_layers" VALUES(2,0,'beauty',3,'summed');
INSERT INTO "job_layers" VALUES(2,1,'albedo',4,'summed');
INSERT INTO "job_layers" VALUES(2,2,'n',3,'first_mean');
INSERT INTO "job_layers" VALUES(2,3,'z',1,'first_nearest');
INSERT INTO "job_layers" VALUES(2,4,'i',1,'first_samples');
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
INSERT INTO "job_settings" VALUES(1,X'61007363656E65FF',640,480,1,2,30,40,-81985529216486896,'preview',4294967295,'core-x',5,1,'it is the only one
and fast
','path: the lamp''s caustics are missing
','',X'FE0001020000');
INSERT INTO "job_settings" VALUES(2,X'61007363656E65FF',640,480,1,2,30,40,-81985529216486896,'auto',4294967295,'core-x',5,1,'two do
','','path
whitted
',X'FE0001020000');
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
INSERT INTO "jobs" VALUES(1,'request-1','a ''quoted'' näme','owner','host.example',101,-7,300,12.5,'paused','because','class',0.1,1000000000.25,1,2,3,4,5,1700000000123,1700000000456,0.0123,'error',1,0.125,6,7,1,X'2A933C020C86DCFB2B7BE7F8169A50A9');
INSERT INTO "jobs" VALUES(2,'request-2','a ''quoted'' näme','owner','host.example',102,-7,300,12.5,'paused','because','class',0.1,1000000000.25,1,2,3,4,5,1700000000123,1700000000456,0.0123,'error',1,0.125,6,7,1,X'4CDBCBCDC70966F7DA10E2BCC28751B0');
CREATE TABLE meta (
  key TEXT PRIMARY KEY,
  value INTEGER NOT NULL
) WITHOUT ROWID;
INSERT INTO "meta" VALUES('epoch',2);
INSERT INTO "meta" VALUES('format',12);
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
INSERT INTO "nodes" VALUES(1,1,0,1,0,1,X'38862D7A549D6CA9339F1A7A0C13165C',X'0000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040000020400000204000002040555555BF');
INSERT INTO "nodes" VALUES(2,1,3,0,4,4,X'E947E4958752B8A4B653506F74DF1DDC',X'6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D6042A28D8058D80C');
CREATE TABLE quarantine (
  worker TEXT PRIMARY KEY,
  machine TEXT NOT NULL,
  reason TEXT NOT NULL,
  since_unix_ms INTEGER NOT NULL
) WITHOUT ROWID;
INSERT INTO "quarantine" VALUES('liar','machine','wrong',5);
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
INSERT INTO "results" VALUES(1,0,0,0,X'00000000000000030000000000000004','worker','machine',0,'class-b',6977271438046117709);
INSERT INTO "results" VALUES(1,0,0,1,X'00000000000000010000000000000002','worker','machine',1,'',-7582847424312677924);
INSERT INTO "results" VALUES(1,3,0,4,X'00000000000000050000000000000006','other','machine',2,'',693025874697356232);
CREATE TABLE tokens (
  id TEXT PRIMARY KEY,
  name TEXT NOT NULL,
  roles TEXT NOT NULL,
  hash BLOB NOT NULL,
  made_by TEXT NOT NULL,
  made_unix_s INTEGER NOT NULL,
  until_unix_s INTEGER NOT NULL
) WITHOUT ROWID;
INSERT INTO "tokens" VALUES('00112233aabb','ada ''x'' näme','view, submit',X'7692C3AD3540BB803C020B3AEE66CD8887123234EA0C6E7143C0ADD73FF431ED','root',1,1900000000);
CREATE TABLE verification_secret (secret BLOB NOT NULL);
INSERT INTO "verification_secret" VALUES(X'D099FF1169DD9F1C64C049DE5BEB283F90307F0979E30EBC7DE9DB4549024986');
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('jobs',3);
COMMIT;
