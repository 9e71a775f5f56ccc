// Rows of the formats before this one, 12 of SQLite and 6 of PostgreSQL, for the step to it (server/store/migration.h).
//
// They had a column a value, names for what has names, and one checksum over all rows of a job.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "server/domain/effects.h"
#include "server/store/row_values.h"

namespace lightmill::stored::old {

/// DATA_LOSS if nothing has this name.
Result<JobState> state_named(std::string_view name);
Result<GoalLimit> limit_named(std::string_view name);
Result<Proof> proof_named(std::string_view name);
Result<LayerKind> layer_kind_named(std::string_view name, std::uint64_t job);

/// Of a job with settings, a byte a tile; DATA_LOSS if it has another number of tiles, or one no such share.
Result<Allocation> allocation_in(std::string_view bytes, const JobRecord& job);
/// Texts, one a line.
std::vector<std::string> lines_in(std::string_view text);
/// As names with commas; DATA_LOSS if one of the token's in the store is none.
Result<Roles> roles_in(std::string_view text, std::string_view token);

/// Of a result's row, but for whether it has been verified since.
std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by);

/// Finds jobs whose rows say something else than was written.
class JobCheck {
 public:
  void expect(JobId job, std::string_view checksum) { expected_[job] = checksum; }
  /// The value; one of the job's rows that means nothing condemns the job.
  template <class T>
  T sound(JobId job, Result<T> value) {
    if (!value.ok()) {
      condemn(job, value.status());
    }
    return value.ok() ? *std::move(value) : T{};
  }
  void condemn(JobId job, const Status& why) { damaged_.try_emplace(job, message_of(why)); }
  /// Takes what is damaged from `jobs` to `damaged_jobs`, and says so in the log. A job without a checksum is damaged.
  void finish(StoredState& state);

 private:
  std::map<JobId, std::string> expected_;
  std::map<JobId, std::string> damaged_;  ///< and why
};

/// A token, or an entry of the farm's log, that cannot be read.
void leave_out(std::string what, const Status& why, StoredState& state);

}  // namespace lightmill::stored::old
