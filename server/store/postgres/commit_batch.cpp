#include "server/store/postgres/commit_batch.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "server/store/row_writer.h"

namespace lightmill::postgres {
namespace {

/// PostgreSQL limits a value to 1 GiB.
constexpr std::size_t kMaxNodeBytes = std::size_t{512} << 20;

enum Sql : int {
  kBegin,
  kCommit,
  kBeginCommit,
  kHighestJob,
  kPutSummary,
  kRows  ///< the first of stored::RowStatement
};

// PostgreSQL may evaluate the conditions in any order, so the shift must always be valid.
constexpr const char* kWithin =
    "job = $1 AND tile = $2 AND level <= $3 AND range_index >> ($3 - LEAST(GREATEST(level, 0), $3))::integer = $4";

std::vector<std::string> make_statements() {
  std::vector<std::string> statements(kRows);
  statements[kBegin] = "BEGIN";
  statements[kCommit] = "COMMIT";
  statements[kBeginCommit] = "SELECT begin_commit($1, $2)";
  statements[kHighestJob] = "UPDATE current_epoch SET highest_job = $1 WHERE highest_job < $1";
  statements[kPutSummary] = "UPDATE summary SET epoch = $1, commits = $2, highest_job = $3, sums = $4, checksum = $5";
  std::ranges::move(stored::row_statements(kWithin), std::back_inserter(statements));
  return statements;
}

const std::vector<std::string>& statements() {
  static const std::vector<std::string> all = make_statements();
  return all;
}

Status check_sizes(std::span<const StoreOp> ops) {
  for (const StoreOp& op : ops) {
    const auto* put = std::get_if<PutNode>(&op);
    if (put != nullptr && put->node->values.size() * sizeof(float) > kMaxNodeBytes) {
      return internal_error("job {}: a node of tile {} has {} bytes, more than the {} that can be stored",
                            put->job.value, put->tile.value, put->node->values.size() * sizeof(float), kMaxNodeBytes);
    }
  }
  return ok_status();
}

}  // namespace

std::span<const char* const> commit_statements() {
  static const std::vector<const char*> texts = [] {
    std::vector<const char*> all;
    std::ranges::transform(statements(), std::back_inserter(all), &std::string::c_str);
    return all;
  }();
  return texts;
}

Status send_commit(Session& session, Summary& after, std::span<const StoreOp> ops, stored::StoredSpecs& specs) {
  LM_RETURN_IF_ERROR(check_sizes(ops));
  LM_RETURN_IF_ERROR(session.begin_batch());
  session.add(kBegin);
  session.add(kBeginCommit, Parameters(after.epoch, after.commits));
  for (const StoreOp& op : ops) {
    LM_RETURN_IF_ERROR(stored::write_rows(op, specs, after.sums, [&](int statement, const auto&... values) {
      session.add(kRows + statement, Parameters(values...));
      return ok_status();
    }));
  }
  LM_RETURN_IF_ERROR(session.read_batch([&](int statement, const stored::Row& row) {
    if (statement >= kRows) {
      stored::count_row(statement - kRows, row, after.sums);
    }
  }));
  const std::string sums = after.sums.bytes();
  session.add(kHighestJob, Parameters(after.highest_job));
  session.add(kPutSummary,
              Parameters(after.epoch, after.commits, after.highest_job, as_byte_view(sums), checksum_of(after)));
  session.add(kCommit);
  return session.finish_batch();
}

Status send_writes(Session& session, std::span<const StoreOp> ops, stored::StoredSpecs& specs) {
  stored::RowSums unused;
  for (const StoreOp& op : ops) {
    LM_RETURN_IF_ERROR(stored::write_rows(op, specs, unused, [&](int statement, const auto&... values) {
      return session.query(statements()[static_cast<std::size_t>(kRows + statement)].c_str(), Parameters(values...))
          .status();
    }));
  }
  return ok_status();
}

}  // namespace lightmill::postgres
