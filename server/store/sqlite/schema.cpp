#include "server/store/sqlite/schema.h"

#include "server/store/migration.h"
#include "server/store/sqlite/sqlite_store.h"

namespace lightmill::sqlite {
namespace {

/// AUTOINCREMENT keeps the highest id ever used, even after deletes. Small rows have one form (server/store/records.h).
/// A job's specification can be several MB large, and is written once or twice. Its progress is small, and changes with
/// every commit. Unsigned 64-bit numbers keep their bits.
constexpr const char* kSchema = R"sql(
-- One row: the store's id, the secret that selects results for audits, and the state of the last commit. `hash` is a
-- running hash of all commits.
CREATE TABLE store (
  id BLOB NOT NULL,
  secret BLOB NOT NULL,
  epoch INTEGER NOT NULL,
  commits INTEGER NOT NULL,
  hash BLOB NOT NULL,
  sums BLOB NOT NULL, -- over all rows (server/store/row_sums.h): lost and old rows are noticed
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

/// An exclusive lock on the file avoids shared memory. secure_delete (on in Debian) would overwrite every dropped node.
/// Large pages and rare checkpoints suit short-lived rows of 100 KB.
constexpr const char* kSettings = R"sql(
PRAGMA locking_mode = EXCLUSIVE;
PRAGMA journal_mode = WAL;
PRAGMA synchronous = FULL;
PRAGMA secure_delete = OFF;
PRAGMA foreign_keys = ON;
PRAGMA wal_autocheckpoint = 4096;
PRAGMA journal_size_limit = 134217728;
PRAGMA cache_size = -32768;
PRAGMA temp_store = MEMORY;
)sql";

}  // namespace

Status prepare_file(Database& database, const std::filesystem::path& file, bool is_new, bool may_be_new,
                    const JournalScan& journal, const Beginning& first) {
  if (is_new) {
    LM_RETURN_IF_ERROR(database.execute("PRAGMA page_size = 16384; PRAGMA auto_vacuum = INCREMENTAL;"));
  }
  LM_RETURN_IF_ERROR(database.execute(kSettings));
  LM_ASSIGN_OR_RETURN(const std::int64_t application, database.number("PRAGMA application_id"));
  LM_ASSIGN_OR_RETURN(const std::int64_t version, database.number("PRAGMA user_version"));
  LM_ASSIGN_OR_RETURN(const std::int64_t tables, database.number("SELECT count(*) FROM sqlite_schema"));
  if (tables == 0 && version == 0 && may_be_new) {
    LM_RETURN_IF_ERROR(
        database.execute(fmt::format("BEGIN IMMEDIATE; PRAGMA application_id = {}; PRAGMA user_version = {}; {}",
                                     kApplicationId, kSqliteFormatVersion, kSchema)));
    LM_RETURN_IF_ERROR(create_store_row(database, first));
    return database.execute("COMMIT");
  }
  if (tables == 0 && version == 0) {
    return failed_precondition("{} is empty, but commits were acknowledged.{} {}", file.string(), problem_of(journal),
                               kLossAdvice);
  }
  if (application != kApplicationId) {
    return failed_precondition("{} is not a Lightmill store (application id {:#x}): choose another folder with --data",
                               file.string(), application);
  }
  return version >= kSameRowsVersion && version < kSqliteFormatVersion
             ? ok_status()
             : check_store_format(file.string(), version, kSqliteFormatVersion, "another folder with --data");
}

}  // namespace lightmill::sqlite
