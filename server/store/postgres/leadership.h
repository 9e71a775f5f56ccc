// Who may write: one coordinator at a time, in an epoch of its own, as long as it renews its lease.
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

/// The lease on a database, held and renewed while this lives; given back at its end.
///
/// It serves only to tell that a coordinator is gone. One that is deposed (it was stopped, or cut off for longer than
/// the lease) can do no harm because every transaction checks the epoch. Thread-safe.
class Leadership {
 public:
  struct Options {
    std::string url;
    std::chrono::milliseconds lease;  ///< PostgresOptions::lease
    /// No tables are made, and nobody is waited for: NOT_FOUND, FAILED_PRECONDITION.
    bool only_look = false;
    /// Where the last commit that is known of is recorded, also while this stands by; empty: nowhere.
    std::filesystem::path chain = {};
    bool accept_loss = false;
    /// Waits so long; false if the coordinator is to stop instead.
    std::function<bool(std::chrono::milliseconds)> wait;
    /// Another coordinator has taken over. Called once, from another thread.
    std::function<void(const Status&)> on_deposed;
  };

  /// Makes the tables if there are none, and waits until no other coordinator holds the lease. FAILED_PRECONDITION if
  /// the tables are of another format, CANCELLED if it is to stop while it waits.
  static Result<std::unique_ptr<Leadership>> take(Options options);
  ~Leadership();
  Leadership(const Leadership&) = delete;
  Leadership& operator=(const Leadership&) = delete;

  std::uint64_t epoch() const { return epoch_; }
  /// Records that this commit of the epoch is stored, before it is acknowledged.
  Status record_commit(std::uint64_t number, std::uint64_t highest_job);
  /// The highest job id that was ever given, as far as the record knows.
  std::uint64_t highest_job() const { return highest_job_; }
  /// Begins the next epoch.
  Status take_again();
  /// For sessions of this coordinator.
  Target target() const;
  /// The error of a transaction; that of the fence with what it means and what to do.
  Status explain(Status failure) const;

 private:
  explicit Leadership(Options options);
  Status stand_by();
  /// Ends the lease of a coordinator whose connections have been gone for several looks: it was killed.
  Status end_lease_of_gone(Session& session);
  /// Compares the database with the record, and records how far it is. FAILED_PRECONDITION if it is behind.
  Status look_at_chain(Session& session);
  /// Takes the lease if it is free or ours: then its holder's name is empty.
  Result<std::string> try_to_take(Session& session);
  void keep_renewing();
  bool renew();

  const Options options_;
  const std::string instance_;  ///< 16 random hex digits
  std::atomic<std::uint64_t> epoch_ = 0;
  std::optional<CommitChain> chain_;
  std::array<std::uint8_t, 16> store_{};  ///< the store's id, for the record
  std::uint64_t highest_job_ = 0;
  std::string seen_;          ///< the instance that was at work and connected at some look
  int looks_without_it_ = 0;  ///< in a row since then
  Session session_;           ///< the renewing thread's while it runs
  Mutex mutex_;
  CondVar changed_;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread renewing_;
};

}  // namespace lightmill::postgres
