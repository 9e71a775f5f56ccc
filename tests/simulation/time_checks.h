// Checks of jobs that end after so many seconds.
//
// Such a job is not done by time before so many seconds have passed since its first grant, nor before it has been
// rendered for as long. From then on no new samples of it are granted: only gaps below those that were, and the first
// sample of tiles that have none. What a tile ends with is checked in EndChecks.
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

  /// As Checks::check_effects.
  void check(const Effects& effects);

 private:
  void check_granted(const Unit& unit);
  void check_done(const JobRecord& job) const;
  /// As its client has asked for; 0 if it has not, or does not any more.
  double seconds_of(const JobSpec& spec) const;

  World& world_;
  const ServerSide& server_;
  const ClientSide& clients_;
  std::map<JobId, Time> granted_first_;
  std::map<JobId, std::int64_t> finished_;                        ///< when jobs were done that have been checked
  std::map<std::pair<JobId, TileId>, std::uint64_t> granted_to_;  ///< no sample from here on was ever granted
};

}  // namespace lightmill::simulation
