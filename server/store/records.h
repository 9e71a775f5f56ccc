// The store's small rows: a key, a message (proto/lightmill/stored/v1) and a checksum of both.
//
// All databases keep them in tables of this one form. Only this file knows what the rows mean: a database puts, drops
// and lists them. Nodes and results have tables with columns, because there are millions of them.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/domain/effects.h"

namespace lightmill::stored {

/// In the order in which they are read.
enum class Table : std::uint8_t { jobs, job_specs, job_progress, tokens, actions, quarantine };
inline constexpr std::size_t kTableCount = 6;

struct TableInfo {
  const char* name;
  const char* key;  ///< the column
  bool numbered;    ///< keys are numbers, else bytes
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

/// One of the two, as the table has it.
struct Key {
  std::uint64_t number = 0;
  std::string name = {};
};

struct RowChange {
  Table table;
  Key key;
  std::optional<std::string> message;  ///< the row is dropped without one
};

/// 64 bits of XXH3-128.
std::int64_t checksum_of(Table table, const Key& key, std::string_view message);

/// Which jobs have a specification in the store, so that it is not written again: it may be megabytes.
class StoredSpecs {
 public:
  bool contains(JobId job) const { return find(job) != Kept::none; }
  /// Whether it has to be written: it is not stored, or was before a pilot decided.
  bool is_missing(const JobRecord& job) const { return find(job.id) != Kept::decided; }
  void put(const JobRecord& job);
  void drop(JobId job) { changes_[job] = Kept::none; }
  /// The transaction is stored.
  void keep();
  /// The transaction is not stored.
  void forget() { changes_.clear(); }

 private:
  enum class Kept : std::uint8_t { none, undecided, decided };
  Kept find(JobId job) const;

  std::map<JobId, Kept> stored_, changes_;
};

/// What a write changes in these tables. A deleted job's rows go with the one in `jobs`. Empty for nodes and results.
std::vector<RowChange> changes_of(const StoreOp& op, StoredSpecs& specs);

/// Which rows there are, so that one that vanishes is missed. Not thread-safe.
class RowKeys {
 public:
  /// A sum over each table's keys: XXH3 of each, joined by exclusive or.
  using Sums = std::array<std::uint64_t, kTableCount>;

  void put(Table table, const Key& key) { change(table, key, true); }
  /// A job's row takes its others along.
  void drop(Table table, const Key& key);
  const Sums& sums() const { return sums_; }
  /// The transaction is stored.
  void keep();
  /// The transaction is not stored.
  void forget();

 private:
  void change(Table table, const Key& key, bool there);

  std::array<std::set<std::uint64_t>, kTableCount> hashes_;
  std::vector<std::pair<Table, std::uint64_t>> changes_;  ///< since the last keep(), each of which turns around
  Sums sums_{}, kept_{};
};

/// Fills a StoredState from rows that come table by table.
///
/// A row that is not what was written is named in the log and in the state. A job goes with its row or its
/// specification
/// (`damaged_jobs`); its progress begins anew; a token lets nobody in; an entry of the log is left out; a worker stays
/// in quarantine.
class StateReader {
 public:
  /// `repairs` get what is to be written in place of damaged rows.
  StateReader(StoredState& state, std::vector<StoreOp>& repairs) : state_(state), repairs_(repairs) {}
  void take(Table table, const Key& key, std::string_view message, std::int64_t checksum);
  /// After the last row: takes damaged jobs out. Tells `specs` what is stored.
  void finish(StoredSpecs& specs);

 private:
  void take_job(JobId job, std::string_view message, bool sound);
  void take_spec(JobId job, std::string_view message, bool sound);
  void take_progress(JobId job, std::string_view message, bool sound);
  void take_token(const std::string& id, std::string_view message, bool sound);
  void take_action(std::uint64_t number, std::string_view message, bool sound);
  void take_quarantine(const std::string& worker, std::string_view message, bool sound);
  JobRecord* find(JobId job);
  void condemn(JobId job, const std::string& why) { condemned_.try_emplace(job, why); }
  void report(std::string what);

  StoredState& state_;
  std::vector<StoreOp>& repairs_;
  std::map<JobId, std::size_t> places_;  ///< in state_.jobs
  std::map<JobId, std::string> condemned_;
  std::map<JobId, bool> has_spec_, has_progress_;
};

}  // namespace lightmill::stored
