// Table of jobs.
//
// Owns the jobs, and the request of each. Takes new jobs, stored jobs, and deletions.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/domain/job.h"

namespace lightmill {

class JobTable {
 public:
  JobTable(const CoordinatorLimits& limits, std::uint64_t next_id) : limits_(limits), next_id_(next_id) {}

  Job* find(JobId id) const;
  Job& at(JobId id) const { return *jobs_.at(id); }
  Result<Job*> get(JobId id) const;  ///< NOT_FOUND
  const std::map<JobId, std::unique_ptr<Job>>& all() const { return jobs_; }
  std::optional<JobId> of_request(const std::string& request_id) const;

  Job& add(const JobSpec& spec, const MethodNotes& notes, const Event& event);
  Job& restore(StoredState::StoredJob stored, Time now);
  void remove(JobId id, const Event& event);

  /// RESOURCE_EXHAUSTED if there are too many jobs or bytes of their scenes, of all or of this owner.
  Status check_room(const JobSpec& spec) const;
  /// Checks the film of `spec` against the farm's limit. INVALID_ARGUMENT if this film alone may exceed it.
  /// RESOURCE_EXHAUSTED if it may do so together with the films of all active jobs and the largest film of an ended
  /// job, which must have room when it is read. RESOURCE_EXHAUSTED, too, if the owner's films may exceed their limit.
  /// `instead_of`: the job whose spec it replaces, if any.
  Status check_footprint(const JobSpec& spec, const Job* instead_of) const;

 private:
  const CoordinatorLimits& limits_;
  std::uint64_t next_id_;
  std::map<JobId, std::unique_ptr<Job>> jobs_;
  std::unordered_map<std::string, JobId> by_request_;
};

}  // namespace lightmill
