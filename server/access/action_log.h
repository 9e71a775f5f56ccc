// Action log: calls that changed something, workers that connected, and refusals.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

// Actions of the coordinator itself. Other actions have the name of their RPC.
inline constexpr std::string_view kStart = "Start";
/// Like kStart, when the previous coordinator did not record its stop: it was killed, or lost its lease.
inline constexpr std::string_view kTakeOver = "TakeOver";
inline constexpr std::string_view kStop = "Stop";
/// The coordinator deletes a job that ended long ago.
inline constexpr std::string_view kExpire = "ExpireJob";
/// The coordinator puts a worker into quarantine. The same name as the RPC of operators.
inline constexpr std::string_view kQuarantine = "QuarantineWorker";
/// A user logs in on the page.
inline constexpr std::string_view kLogin = "Login";
/// A worker connects.
inline constexpr std::string_view kWorkAction = "Work";

struct Action {
  std::uint64_t number = 0;  ///< counts up from 1 for the life of the store
  std::int64_t unix_ms = 0;
  std::string caller;  ///< a name; empty for unknown callers and for the coordinator itself
  Proof proof = Proof::none;
  std::string token;      ///< id of the token, if one was used
  std::string peer;       ///< ADDRESS:PORT of the caller, or the coordinator's own host
  std::string operation;  ///< name of the RPC, or one of the names above
  std::uint64_t job = 0;  ///< 0: none
  std::string about;      ///< name of the job, worker or token
  StatusCode outcome = StatusCode::kOk;
  std::string message;      ///< reason of a refusal
  std::string change = {};  ///< what it changed, in words: "priority 0 -> 10"
  friend bool operator==(const Action&, const Action&) = default;
};

struct ActionLogLimits {
  std::size_t entries = 50'000;  ///< changes; refusals and connecting workers have a quarter each
  std::int64_t days = 400;       ///< older entries are dropped
};

/// Filter of a query. The default selects everything.
struct ActionFilter {
  std::uint64_t job = 0;  ///< only this job
  std::string caller;
  std::int64_t since_unix_ms = 0;
  std::uint64_t before = 0;  ///< only lower numbers; 0: from the newest
};

struct ActionPage {
  std::vector<Action> actions;  ///< newest first
  std::uint64_t next = 0;       ///< ActionFilter::before of the next page; 0: this is the last one
};

/// All kept actions, in memory. Not thread-safe. The caller stores the changes.
class ActionLog {
 public:
  ActionLog(const ActionLogLimits& limits, std::vector<Action> stored);

  struct Change {
    std::optional<Action> added;
    std::vector<std::uint64_t> dropped;  ///< numbers
  };
  /// Numbers and keeps an action, and drops old ones. A worker that connects again within an hour, from the same host
  /// and with the same identity, is not recorded. Texts of callers are shortened and made printable.
  Change add(Action action);

  /// Limit of entries that one query looks at. This takes tenths of a millisecond for any filter.
  static constexpr std::size_t kMaxScanned = 4'096;
  /// Returns at most `most` actions that pass the filter (`most` is at least 1). If the limit above ends the search,
  /// the page is shorter and has a successor.
  ActionPage find(const ActionFilter& filter, std::size_t most) const;
  /// Whether the log says that a coordinator is active, or was killed while active.
  bool coordinator_is_active() const { return at_work_; }

 private:
  enum Kind { kChange, kRefusal, kWorker, kKinds };
  static Kind kind_of(const Action& action);
  void note(const Action& action);
  void drop_oldest(Kind kind, Change& change);

  const ActionLogLimits limits_;
  std::map<std::uint64_t, Action> entries_;
  std::deque<std::uint64_t> by_kind_[kKinds];       ///< numbers, ascending
  std::map<std::string, std::uint64_t> last_came_;  ///< by the worker's name
  std::uint64_t next_ = 1;
  bool at_work_ = false;
};

/// A peer of gRPC, "ipv4:10.0.0.7:4711", as ADDRESS:PORT: without the scheme, and "[::1]:4711" without escapes.
std::string peer_text(std::string_view peer);

}  // namespace lightmill
