#include "server/store/postgres/commit_batch.h"

#include "server/store/row_writer.h"

namespace lightmill::postgres {
namespace {

/// PostgreSQL limits a value to 1 GiB.
constexpr std::size_t kMostNodeBytes = std::size_t{512} << 20;

/// In the order of kStatements.
enum Sql : int {
  kBegin,
  kCommit,
  kTakeTurn,
  kHighestJob,
  kPutSummary,
  kRows,  ///< the first of stored::RowStatement
  kSqlCount = kRows + static_cast<int>(stored::kRowStatementCount)
};

constexpr std::array<const char*, kSqlCount> kStatements{
    "BEGIN",
    "COMMIT",
    "SELECT take_turn($1, $2)",
    "UPDATE turn SET highest_job = $1 WHERE highest_job < $1",
    "UPDATE summary SET epoch = $1, commits = $2, highest_job = $3, keys = $4, checksum = $5",
    "INSERT INTO nodes (job, tile, level, range_index, non_finite, hash, samples) VALUES ($1, $2, $3, $4, $5, $6, $7) "
    "ON CONFLICT (job, tile, level, range_index) DO UPDATE SET non_finite = $5, hash = $6, samples = $7",
    "DELETE FROM nodes WHERE job = $1 AND tile = $2 AND level = $3 AND range_index = $4",
    "INSERT INTO results VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10) ON CONFLICT (job, tile, level, range_index) "
    "DO UPDATE SET hash = $5, worker = $6, machine = $7, audit = $8, fingerprint_class = $9, checksum = $10",
    "UPDATE results SET audit = 2, checksum = (checksum & ~3::bigint) | 2 WHERE job = $1 AND tile = $2 AND level = $3 "
    "AND range_index = $4",
    // PostgreSQL may evaluate the conditions in any order, so the shift must always be valid.
    "DELETE FROM results WHERE job = $1 AND tile = $2 AND level <= $3 AND "
    "range_index >> ($3 - LEAST(GREATEST(level, 0), $3))::integer = $4",
    "DELETE FROM results WHERE job = $1 AND tile = $2 AND level = $3 AND range_index = $4",
    "INSERT INTO jobs VALUES ($1, $2, $3) ON CONFLICT (id) DO UPDATE SET message = $2, checksum = $3",
    "INSERT INTO job_specs VALUES ($1, $2, $3) ON CONFLICT (job) DO UPDATE SET message = $2, checksum = $3",
    "INSERT INTO job_progress VALUES ($1, $2, $3) ON CONFLICT (job) DO UPDATE SET message = $2, checksum = $3",
    "INSERT INTO tokens VALUES ($1, $2, $3) ON CONFLICT (id) DO UPDATE SET message = $2, checksum = $3",
    "INSERT INTO actions VALUES ($1, $2, $3) ON CONFLICT (number) DO NOTHING",  // entries of the log never change
    "INSERT INTO quarantine VALUES ($1, $2, $3) ON CONFLICT (worker) DO UPDATE SET message = $2, checksum = $3",
    "DELETE FROM jobs WHERE id = $1",
    "DELETE FROM job_specs WHERE job = $1",
    "DELETE FROM job_progress WHERE job = $1",
    "DELETE FROM tokens WHERE id = $1",
    "DELETE FROM actions WHERE number = $1",
    "DELETE FROM quarantine WHERE worker = $1",
};

Status check_sizes(std::span<const StoreOp> ops) {
  for (const StoreOp& op : ops) {
    const auto* put = std::get_if<PutNode>(&op);
    if (put != nullptr && put->node->values.size() * sizeof(float) > kMostNodeBytes) {
      return internal_error("job {}: a node of tile {} has {} bytes, more than the {} that can be stored",
                            put->job.value, put->tile.value, put->node->values.size() * sizeof(float), kMostNodeBytes);
    }
  }
  return ok_status();
}

}  // namespace

std::span<const char* const> commit_statements() {
  return kStatements;
}

Status send_commit(Session& session, Summary after, std::span<const StoreOp> ops, stored::StoredSpecs& specs,
                   stored::RowKeys& keys) {
  LM_RETURN_IF_ERROR(check_sizes(ops));
  LM_RETURN_IF_ERROR(session.begin_batch());
  session.add(kBegin);
  session.add(kTakeTurn, Parameters(after.epoch, after.commits));
  for (const StoreOp& op : ops) {
    LM_RETURN_IF_ERROR(stored::write_rows(op, specs, keys, [&](int statement, const auto&... values) {
      session.add(kRows + statement, Parameters(values...));
      return ok_status();
    }));
  }
  after.keys = keys.sums();
  session.add(kHighestJob, Parameters(after.highest_job));
  session.add(kPutSummary, Parameters(after.epoch, after.commits, after.highest_job, stored::view_of(after.keys),
                                      checksum_of(after)));
  session.add(kCommit);
  return session.finish_batch();
}

Status send_writes(Session& session, std::span<const StoreOp> ops, stored::StoredSpecs& specs, stored::RowKeys& keys) {
  for (const StoreOp& op : ops) {
    LM_RETURN_IF_ERROR(stored::write_rows(op, specs, keys, [&](int statement, const auto&... values) {
      return session.query(kStatements[static_cast<std::size_t>(kRows + statement)], Parameters(values...)).status();
    }));
  }
  return ok_status();
}

}  // namespace lightmill::postgres
