// Who did what: the actions that changed something, the workers that came, and what was refused.
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

// What a coordinator does by itself; else an action is named as its RPC is.
inline constexpr std::string_view kStart = "Start";
/// As kStart, where the coordinator before has not said that it stops: it was killed, or lost its lease.
inline constexpr std::string_view kTakeOver = "TakeOver";
inline constexpr std::string_view kStop = "Stop";
/// A job that ended long ago is deleted.
inline constexpr std::string_view kExpire = "ExpireJob";
/// Somebody logs in on the page.
inline constexpr std::string_view kLogin = "Login";
/// A worker comes.
inline constexpr std::string_view kWorkAction = "Work";

struct Action {
  std::uint64_t number = 0;  ///< counts up from 1 as long as the store lasts
  std::int64_t unix_ms = 0;
  std::string who;  ///< a name; empty of somebody unknown, and of the coordinator itself
  Proof proof = Proof::none;
  std::string token;      ///< its id, if that was shown
  std::string peer;       ///< ADDRESS:PORT that the call came from; of the coordinator's own, its host
  std::string what;       ///< an RPC's name, or one of those above
  std::uint64_t job = 0;  ///< 0: none
  std::string about;      ///< the worker or token
  StatusCode outcome = StatusCode::kOk;
  std::string message;  ///< why it was refused
  friend bool operator==(const Action&, const Action&) = default;
};

struct ActionLogLimits {
  std::size_t entries = 50'000;  ///< of changes; of refusals, and of workers that come, a quarter each
  std::int64_t days = 400;       ///< older ones go
};

/// What the caller wants to see; all by default.
struct ActionFilter {
  std::uint64_t job = 0;  ///< of this one
  std::string who;
  std::int64_t since_unix_ms = 0;
  std::uint64_t before = 0;  ///< numbers below; 0: from the newest
};

struct ActionPage {
  std::vector<Action> actions;  ///< newest first
  std::uint64_t next = 0;       ///< ActionFilter::before of the next page; 0: there is none
};

/// All that is kept, in memory. Not thread-safe. Storing what changes is the caller's.
class ActionLog {
 public:
  ActionLog(const ActionLogLimits& limits, std::vector<Action> stored);

  struct Change {
    std::optional<Action> added;
    std::vector<std::uint64_t> dropped;  ///< numbers
  };
  /// Numbers the action and keeps it; older ones go for it. A worker that has come within the hour before, from the
  /// same place and as the same, is not recorded again. Texts from elsewhere are cut and made printable.
  Change add(Action action);

  /// So many entries are looked at for one page, which takes tenths of a millisecond whatever is sought.
  static constexpr std::size_t kLookedAt = 4'096;
  /// At most `most` that fit the filter (at least 1), and fewer where that takes a longer look: then there is a next
  /// page.
  ActionPage find(const ActionFilter& filter, std::size_t most) const;
  /// Whether a coordinator is at work, or was killed at it, by what is recorded.
  bool somebody_is_at_work() const { return at_work_; }

 private:
  enum Kind { kChange, kRefusal, kWorker, kKinds };
  static Kind kind_of(const Action& action);
  void note(const Action& action);
  void drop_oldest(Kind kind, Change& change);

  const ActionLogLimits limits_;
  std::map<std::uint64_t, Action> entries_;
  std::deque<std::uint64_t> by_kind_[kKinds];       ///< numbers, ascending
  std::map<std::string, std::uint64_t> last_came_;  ///< by workers' names
  std::uint64_t next_ = 1;
  bool at_work_ = false;
};

/// gRPC's "ipv4:10.0.0.7:4711" as people write it: without the scheme, and "[::1]:4711" without escapes.
std::string peer_text(std::string_view peer);

}  // namespace lightmill
