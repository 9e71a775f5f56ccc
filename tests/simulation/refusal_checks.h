// Checks of the coordinator's decisions on refusals.
//
// A job fails for refusals only if two identities refuse it. One is enough if no other identity is connected that may
// render it. The same holds for workers that are lost with it. LossChecks knows whether they were.
// An identity that refused a job does not get it again from this coordinator.
#pragma once

#include <map>
#include <set>
#include <string>

#include "server/domain/effects.h"
#include "tests/simulation/stream.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class ServerSide;
class WorkerSide;

class RefusalChecks {
 public:
  RefusalChecks(World& world, const ServerSide& server, const WorkerSide& workers)
      : world_(world), server_(server), workers_(workers) {}

  void server_starts();
  void hello_came(const Stream& stream);
  void refusal_came(const Stream& stream, const WorkerRefusal& refusal);
  /// Like Checks::check_effects.
  void check(const Effects& effects);

 private:
  const std::string& identity_of(std::size_t worker) const;
  /// Identities of the workers that the reason names as lost.
  std::set<std::string> lost_in(const std::string& reason) const;
  /// The coordinator has handled a refusal.
  void note_heard(const Note& note);
  void check_failed(const JobRecord& job);
  void check_granted(SessionId to, JobId job);

  World& world_;
  const ServerSide& server_;
  const WorkerSide& workers_;
  struct Refusals {
    std::map<std::string, std::string> came;  ///< by worker: identities that claim that no worker can render the job
    std::set<std::string> heard;              ///< identities whose refusal the coordinator handled
    std::set<std::string> left;               ///< workers that left it to others
  };
  std::map<JobId, Refusals> refusals_;
  std::map<std::string, std::string> identities_;  ///< by worker name
};

}  // namespace lightmill::simulation
