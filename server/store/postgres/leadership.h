// Leader election: one coordinator may write, in its own epoch, while it renews its lease.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/store/commit_chain.h"
#include "server/store/postgres/session.h"

namespace lightmill::postgres {

/// Holds and renews the lease on a database. Gives it back at the end.
///
/// The lease only detects that a coordinator is gone. A coordinator can be deposed when it was stopped or cut off for
/// longer than the lease. It can do no harm, because every transaction checks the epoch. Thread-safe.
class Leadership {
 public:
  struct Options {
    std::string url;
    std::chrono::milliseconds lease;  ///< PostgresOptions::lease
    /// Creates no tables and does not wait. NOT_FOUND if there are none, FAILED_PRECONDITION if a coordinator is
    /// active.
    bool read_only = false;
    /// File of the commit chain. A standby coordinator writes it too. Empty: no chain.
    std::filesystem::path chain = {};
    bool accept_loss = false;
    /// Waits for the given time. False if the coordinator is to stop.
    std::function<bool(std::chrono::milliseconds)> wait;
    /// Called once from another thread when another coordinator has taken over.
    std::function<void(const Status&)> on_deposed;
  };

  /// Creates missing tables, and waits until no other coordinator holds the lease. FAILED_PRECONDITION if the tables
  /// have another format. CANCELLED if the coordinator is to stop while it waits.
  static Result<std::unique_ptr<Leadership>> take(Options options);
  ~Leadership();
  Leadership(const Leadership&) = delete;
  Leadership& operator=(const Leadership&) = delete;

  std::uint64_t epoch() const { return epoch_; }
  /// Records that this commit of the epoch is stored. Call it before the acknowledgement.
  Status record_commit(std::uint64_t number, std::uint64_t highest_job);
  /// OK, with a warning, if the operator accepts this loss. Otherwise FAILED_PRECONDITION with a remedy.
  Status check_accepted(const Status& loss) const;
  /// The highest job id ever used, according to the commit chain.
  std::uint64_t highest_job() const { return highest_job_; }
  /// Begins the next epoch.
  Status take_again();
  /// Where other sessions of this coordinator connect.
  Target target() const;
  /// Adds meaning and advice to an error, if it says that the epoch is over.
  Status explain(Status failure) const;

 private:
  explicit Leadership(Options options);
  Status stand_by();
  /// Ends the lease of a killed coordinator: one without connections in several checks in a row.
  Status end_lease_of_gone(Session& session);
  /// Compares the database with the commit chain, and updates the chain. FAILED_PRECONDITION if the database is behind.
  Status verify_chain(Session& session);
  /// Takes the lease if it is free or ours, and returns "". Otherwise returns its holder's name.
  Result<std::string> try_to_take(Session& session);
  void keep_renewing();
  bool renew();

  const Options options_;
  const std::string instance_;  ///< 16 random hex digits
  std::atomic<std::uint64_t> epoch_ = 0;
  std::optional<CommitChain> chain_;
  std::array<std::uint8_t, 16> store_{};  ///< the store's id, for the commit chain
  std::uint64_t highest_job_ = 0;
  std::string seen_;           ///< the active instance, once it was seen with a connection
  int checks_without_it_ = 0;  ///< in a row since then
  Session session_;            ///< used by the renewing thread while it runs
  Mutex mutex_;
  CondVar changed_;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread renewing_;
};

}  // namespace lightmill::postgres
