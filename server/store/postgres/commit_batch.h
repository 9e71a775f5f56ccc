// The statements of a commit, and what each write becomes.
#pragma once

#include <set>
#include <span>
#include <vector>

#include "server/domain/effects.h"
#include "server/store/postgres/session.h"

namespace lightmill::postgres {

/// For Session: prepared once a connection.
std::span<const char* const> commit_statements();

/// Which jobs' settings are stored: those need not be sent again.
class StoredJobs {
 public:
  bool contains(JobId job) const;
  void insert(JobId job) { changes_[job] = true; }
  void erase(JobId job) { changes_[job] = false; }
  /// The changes since the last keep() or forget() hold, or don't.
  void keep();
  void forget() { changes_.clear(); }

 private:
  std::set<JobId> stored_;
  std::map<JobId, bool> changes_;
};

/// Stores `ops` as the transaction `number` of the epoch. ALREADY_EXISTS with kStoredAlready if that one is stored.
Status send_commit(Session& session, std::uint64_t epoch, std::uint64_t number, std::span<const StoreOp> ops,
                   StoredJobs& jobs);

}  // namespace lightmill::postgres
