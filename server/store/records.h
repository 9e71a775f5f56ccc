// Small rows of the store: a key, a message (proto/lightmill/stored/v1) and a checksum of both.
//
// All databases have the same tables for them. Only this file knows what the rows mean. A database puts, drops and
// lists them. Nodes and results have tables with columns, because there are millions of them.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/domain/stored_rows.h"
#include "server/store/row_source.h"

namespace lightmill::stored {

/// In the order of reading.
enum class Table : std::uint8_t { jobs, job_specs, job_progress, tokens, actions, quarantine };
inline constexpr std::size_t kTableCount = 6;

struct TableInfo {
  const char* name;
  const char* key;  ///< name of the key column
  bool numbered;    ///< keys are numbers; otherwise bytes
};
inline constexpr std::array<TableInfo, kTableCount> kTables{{{"jobs", "id", true},
                                                             {"job_specs", "job", true},
                                                             {"job_progress", "job", true},
                                                             {"tokens", "id", false},
                                                             {"actions", "number", true},
                                                             {"quarantine", "worker", false}}};
constexpr const TableInfo& info_of(Table table) {
  return kTables[static_cast<std::size_t>(table)];
}

/// A number or a name, as the table requires.
struct Key {
  std::uint64_t number = 0;
  std::string name = {};
};

/// The key in the first column of a row.
inline Key key_in(const Row& row, const TableInfo& info) {
  return info.numbered ? Key{row.natural(0)} : Key{0, row.text(0)};
}

struct RowChange {
  Table table;
  Key key;
  std::optional<std::string> message;  ///< empty: drop the row
};

/// 64 bits of XXH3-128.
std::int64_t checksum_of(Table table, const Key& key, std::string_view message);

/// Which jobs have a stored specification. It can be several MB large, so it is not written again.
class StoredSpecs {
 public:
  bool contains(JobId job) const { return find(job) != Kept::none; }
  /// True if it must be written: it is not stored, or was stored before a pilot decided.
  bool is_missing(const JobRecord& job) const { return find(job.id) != Kept::decided; }
  void put(const JobRecord& job);
  void drop(JobId job) { changes_[job] = Kept::none; }
  /// The transaction was stored.
  void keep();
  /// The transaction was not stored.
  void forget() { changes_.clear(); }

 private:
  enum class Kept : std::uint8_t { none, undecided, decided };
  Kept find(JobId job) const;

  std::map<JobId, Kept> stored_, changes_;
};

/// The changes of a write to the small tables. None for nodes and results. A deleted job's rows go with its row in
/// `jobs`.
std::vector<RowChange> changes_of(const StoreOp& op, StoredSpecs& specs);

/// Fills a StoredState from rows that arrive table by table. A damaged row is named in the log and in the state:
/// - Job or specification: the job is removed (`damaged_jobs`).
/// - Progress: it starts again from zero.
/// - Token: it admits no user.
/// - Entry of the log: it is left out.
/// - Quarantine: the worker stays in quarantine.
class StateReader {
 public:
  /// `repairs` receives the writes that replace damaged rows.
  StateReader(StoredState& state, std::vector<StoreOp>& repairs) : state_(state), repairs_(repairs) {}
  void take(Table table, const Key& key, std::string_view message, std::int64_t checksum);
  /// Call it after the last row. Removes damaged jobs, and tells `specs` what is stored.
  void finish(StoredSpecs& specs);

 private:
  void take_job(JobId job, std::string_view message, bool sound);
  void take_spec(JobId job, std::string_view message, bool sound);
  void take_progress(JobId job, std::string_view message, bool sound);
  void take_token(const std::string& id, std::string_view message, bool sound);
  void take_action(std::uint64_t number, std::string_view message, bool sound);
  void take_quarantine(const std::string& worker, std::string_view message, bool sound);
  JobRecord* find(JobId job);
  void mark_damaged(JobId job, const std::string& why) { condemned_.try_emplace(job, why); }
  void report(std::string what);

  StoredState& state_;
  std::vector<StoreOp>& repairs_;
  std::map<JobId, std::size_t> places_;  ///< index in state_.jobs
  std::map<JobId, std::string> condemned_;
  std::map<JobId, bool> has_spec_, has_progress_;
};

}  // namespace lightmill::stored
