// Simulation of a whole farm on a simulated clock, network and disk, driven from one seed.
//
// The coordinator and the workers' sessions are the real ones. Around them:
// - streams delay, repeat and lose messages; order within a stream is kept, as gRPC keeps it
// - the disk takes time to commit, all or nothing; it is full or slow at times, and a crash damages what it holds
// - workers die, hang, slow down and come back; some farms have a machine that lies or sends garbage
// - the coordinator is killed before, during and after commits; or it stands still, and another one deposes it
// - films of ended jobs leave memory, and are read again tile by tile, while commits go on
// - clients change jobs and repeat requests that were not answered
// Chaos lasts some seconds. Then the farm must finish its jobs.
//
// Checked on the way (checks.h):
// - acknowledged nodes are durable, and stay so
// - no lease leaves before its job's class and method are durable
// - no lease names merged samples, unless it audits them on another machine
// - no worker in quarantine gets a lease, and limits hold
// - no worker that nothing befalls loses a lease, and jobs fail only for as many lost workers as the rule says
// - jobs with a time limit end by it neither early nor late
// - stored nodes never overlap, and their renderers are stored with them
//
// Checked at the end (end_checks.h): every job has ended as it must, and its film has the bytes of the quiet run, in
// memory and on disk. It shows the counts that its film has. A job that asks for an error has the count that the quiet
// run's sums give. A job that allows two classes, which round differently, has the same sums but for their last bits.
//
// World has time and chance. The server, worker and client sides own what their names say.
#pragma once

#include "tests/simulation/checks.h"
#include "tests/simulation/client_side.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class FarmSimulation {
 public:
  FarmSimulation(std::uint64_t seed, const Chaos& chaos, const PlantedBugs& bugs);
  FarmSimulation(std::uint64_t seed, const Race& race);  // race.cpp
  Report run();
  /// Prints what the coordinator notes and what happens to processes.
  void trace() { world_.traced = true; }
  /// Hashes all effects of all coordinators, and what they show after each event. With trace(), prints them too.
  void hash_effects() { server_.hash_effects(); }

 private:
  void make_schedule();
  void make_faults();
  void note_race();  // race.cpp

  World world_;
  ServerSide server_{world_, workers_, clients_, checks_};
  WorkerSide workers_{world_, server_, clients_};
  ClientSide clients_{world_, server_, workers_};
  Checks checks_{world_, server_, workers_, clients_};
  bool films_seen_ = false;
  std::optional<Time> race_started_, race_nearly_done_;
};

}  // namespace lightmill::simulation
