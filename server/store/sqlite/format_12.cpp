#include "server/store/sqlite/format_12.h"

#include "server/store/old_rows.h"
#include "server/store/row_values.h"
#include "server/store/sqlite/schema.h"

namespace lightmill::sqlite {
namespace {

Status load_nodes_of_format_12(Database& database, StoredState::StoredJob& job, StoredState& state) {
  const JobId id = job.record.id;
  return database.for_each(
      fmt::format("SELECT tile, level, range_index, non_finite, hash, samples FROM nodes WHERE job = {}", id.value),
      [&](const stored::Row& row) {
        const NodeKey key = stored::key_of(id, {row.integer(0), row.integer(1), row.integer(2)});
        if (std::shared_ptr<const Node> node = stored::node_of(key, row.natural(3), row.view(4), row.view(5))) {
          job.nodes.emplace_back(key.tile, std::move(node));
        } else {
          state.damaged.push_back(key);
          stored::log_damage(key);
        }
      });
}

}  // namespace

Result<StoredState> load_format_12(Database& database) {
  StoredState state;
  LM_RETURN_IF_ERROR(stored::load_old_rows(database, state));
  for (StoredState::StoredJob& job : state.jobs) {
    LM_RETURN_IF_ERROR(load_nodes_of_format_12(database, job, state));
  }
  std::string secret;
  LM_RETURN_IF_ERROR(database.for_each("SELECT secret FROM verification_secret",
                                       [&](const stored::Row& row) { secret = row.text(0); }));
  LM_ASSIGN_OR_RETURN(state.secret, stored::digest_in(secret, "the secret of verification"));
  LM_ASSIGN_OR_RETURN(const std::int64_t epoch, database.number("SELECT value FROM meta WHERE key = 'epoch'"));
  state.epoch = static_cast<std::uint64_t>(epoch);
  LM_ASSIGN_OR_RETURN(const std::int64_t highest, database.number(kHighestJob));
  state.next_job_id = static_cast<std::uint64_t>(highest) + 1;
  return state;
}

}  // namespace lightmill::sqlite
