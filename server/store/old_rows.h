// Rows of the previous formats (12 of SQLite, 6 of PostgreSQL), for the migration (server/store/migration.h).
//
// They had one column per value, names for enumerators, and one checksum over all rows of a job.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/store/row_values.h"

namespace lightmill::stored::old {

/// DATA_LOSS if the name is unknown.
Result<JobState> state_named(std::string_view name);
Result<GoalLimit> limit_named(std::string_view name);
Result<Proof> proof_named(std::string_view name);
Result<LayerKind> layer_kind_named(std::string_view name, std::uint64_t job);

/// Allocation of a job whose settings are known, one byte per tile. DATA_LOSS if the number of tiles differs or a share
/// is invalid.
Result<Allocation> allocation_in(std::string_view bytes, const JobRecord& job);
/// Texts, one per line.
std::vector<std::string> lines_in(std::string_view text);
/// Names with commas between them. DATA_LOSS if a role of the token is unknown.
Result<Roles> roles_in(std::string_view text, std::string_view token);

/// Checksum of a result's row, without its audit state.
std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by);

/// Finds jobs whose rows differ from what was written.
class JobCheck {
 public:
  void expect(JobId job, std::string_view checksum) { expected_[job] = checksum; }
  /// Returns the value. A row without a valid value makes its job damaged.
  template <class T>
  T sound(JobId job, Result<T> value) {
    if (!value.ok()) {
      mark_damaged(job, value.status());
    }
    return value.ok() ? *std::move(value) : T{};
  }
  void mark_damaged(JobId job, const Status& why) { damaged_.try_emplace(job, message_of(why)); }
  /// Moves damaged jobs from `jobs` to `damaged_jobs`, and logs them. A job without a checksum is damaged.
  void finish(StoredState& state);

 private:
  std::map<JobId, std::string> expected_;
  std::map<JobId, std::string> damaged_;  ///< with the reason
};

/// Records a token, or an entry of the farm's log, that cannot be read.
void leave_out(std::string what, const Status& why, StoredState& state);

}  // namespace lightmill::stored::old
