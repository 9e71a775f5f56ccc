// The jobs that a client has seen on its farm. After a reconnection another farm may answer, with other jobs of the
// same numbers.
#pragma once

#include <map>
#include <string>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// Recognises jobs by the id of their request and the time of their submission. Both survive restarts, takeovers and
/// restored backups. Thread-safe.
class KnownJobs {
 public:
  /// `address`: the farm's, for messages.
  explicit KnownJobs(std::string address) : address_(std::move(address)) {}

  bool has(std::uint64_t id) const;
  /// Remembers the job. ABORTED if it is not the job that had this number before.
  Status meet(const v1::Job& job);
  /// Checks the farm's answer to a question about a job. If a known job is not found, it is gone: ABORTED.
  Status about(std::uint64_t id, const Status& answer) const;

 private:
  struct Identity {
    std::string trace_id;
    std::int64_t submitted_unix_ms = 0;
    bool operator==(const Identity&) const = default;
  };
  const std::string address_;
  mutable Mutex mutex_;
  std::map<std::uint64_t, Identity> jobs_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill::cli
