// Checks of jobs with a time limit.
//
// Such a job is not done before the limit has passed since its first grant, nor before it was rendered for that time.
// Afterwards no new samples are granted, except gaps below granted ones, and the first sample of tiles without samples.
// EndChecks checks the samples of each tile.
#pragma once

#include <map>

#include "server/domain/effects.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class ServerSide;
class ClientSide;

class TimeChecks {
 public:
  TimeChecks(World& world, const ServerSide& server, const ClientSide& clients)
      : world_(world), server_(server), clients_(clients) {}

  /// Like Checks::check_effects.
  void check(const Effects& effects);

 private:
  void check_granted(const Unit& unit);
  void check_done(const JobRecord& job) const;
  /// Time limit that its client wants; 0 if none, or no longer.
  double seconds_of(const JobSpec& spec) const;

  World& world_;
  const ServerSide& server_;
  const ClientSide& clients_;
  std::map<JobId, Time> granted_first_;
  std::map<JobId, std::int64_t> finished_;                        ///< end times of checked jobs
  std::map<std::pair<JobId, TileId>, std::uint64_t> granted_to_;  ///< end of the granted samples
};

}  // namespace lightmill::simulation
