#include "server/store/postgres/commit_batch.h"

#include "common/base/check.h"
#include "server/store/row_values.h"

namespace lightmill::postgres {
namespace {

using stored::bytes_of;
using stored::view_of;

/// PostgreSQL limits a value to 1 GiB.
constexpr std::size_t kMostNodeBytes = std::size_t{512} << 20;

/// In the order of kStatements.
enum Sql : int {
  kBegin,
  kCommit,
  kTakeTurn,
  kHighestJob,
  kPutSummary,
  kPutNode,
  kDropNode,
  kPutResult,
  kPutVerified,
  kDropResults,
  kDropResultRow,
  kPutRecord,  ///< the first of one per table (stored::Table)
  kDropRecord = kPutRecord + static_cast<int>(stored::kTableCount),
  kSqlCount = kDropRecord + static_cast<int>(stored::kTableCount)
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

/// Converts writes to calls of `Sink::add(statement, parameters)`.
template <class Sink>
class Sender {
 public:
  Sender(Sink& sink, stored::StoredSpecs& specs, stored::RowKeys& keys) : sink_(sink), specs_(specs), keys_(keys) {}

  template <class Op>
  void operator()(const Op& op) {
    for (const stored::RowChange& change : stored::changes_of(op, specs_)) {
      change.message ? keys_.put(change.table, change.key) : keys_.drop(change.table, change.key);
      if (stored::info_of(change.table).numbered) {
        send(change, change.key.number);
      } else {
        send(change, as_byte_view(change.key.name));
      }
    }
  }
  void operator()(const PutNode& op) {
    const std::array<std::uint8_t, 16> hash = bytes_of(stored::row_hash_of(op.job, op.tile, *op.node));
    sink_.add(kPutNode, Parameters(op.job.value, op.tile.value, op.node->range.level, op.node->range.index,
                                   op.node->non_finite, view_of(hash), view_of(op.node->values)));
  }
  void operator()(const DropNode& op) { add_key(kDropNode, op.key); }
  void operator()(const PutResult& op) {
    const std::array<std::uint8_t, 16> hash = bytes_of(op.hash);
    const stored::Audit audit = op.to_verify ? stored::Audit::wanted : stored::Audit::none;
    sink_.add(kPutResult,
              Parameters(op.key.job.value, op.key.tile.value, op.key.range.level, op.key.range.index, view_of(hash),
                         as_byte_view(op.by.worker), as_byte_view(op.by.identity), static_cast<int>(audit),
                         as_byte_view(op.by.fingerprint_class), stored::checksum_of(op.key, op.hash, op.by, audit)));
  }
  void operator()(const PutVerified& op) { add_key(kPutVerified, op.key); }
  void operator()(const DropResults& op) { add_key(kDropResults, op.key); }
  void operator()(const DropResultRow& op) {
    sink_.add(kDropResultRow, Parameters(op.job.value, op.tile, op.level, op.index));
  }

 private:
  void send(const stored::RowChange& change, const auto& key) {
    const int table = static_cast<int>(change.table);
    if (change.message) {
      sink_.add(kPutRecord + table, Parameters(key, as_byte_view(*change.message),
                                               stored::checksum_of(change.table, change.key, *change.message)));
    } else {
      sink_.add(kDropRecord + table, Parameters(key));
    }
  }
  void add_key(Sql statement, const NodeKey& key) {
    sink_.add(statement, Parameters(key.job.value, key.tile.value, key.range.level, key.range.index));
  }

  Sink& sink_;
  stored::StoredSpecs& specs_;
  stored::RowKeys& keys_;
};

/// Runs each statement at once, unprepared.
class OneByOne {
 public:
  explicit OneByOne(Session& session) : session_(session) {}
  void add(int statement, const Parameters& parameters) {
    if (status_.ok()) {
      status_ = session_.query(kStatements[static_cast<std::size_t>(statement)], parameters).status();
    }
  }
  const Status& status() const { return status_; }

 private:
  Session& session_;
  Status status_;
};

template <class Sink>
void add_writes(Sink& sink, std::span<const StoreOp> ops, stored::StoredSpecs& specs, stored::RowKeys& keys) {
  Sender sender(sink, specs, keys);
  for (const StoreOp& op : ops) {
    std::visit(sender, op);
  }
}

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
  add_writes(session, ops, specs, keys);
  after.keys = keys.sums();
  session.add(kHighestJob, Parameters(after.highest_job));
  session.add(kPutSummary,
              Parameters(after.epoch, after.commits, after.highest_job, view_of(after.keys), checksum_of(after)));
  session.add(kCommit);
  return session.finish_batch();
}

Status send_writes(Session& session, std::span<const StoreOp> ops, stored::StoredSpecs& specs, stored::RowKeys& keys) {
  OneByOne sink(session);
  add_writes(sink, ops, specs, keys);
  return sink.status();
}

}  // namespace lightmill::postgres
