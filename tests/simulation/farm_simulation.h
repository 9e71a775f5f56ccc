// Simulation of a whole farm on a simulated clock, network and disk, driven from one seed.
//
// The coordinator and the workers' sessions are the real ones. Around them:
// - streams delay, repeat and lose messages; order within a stream is kept, as in gRPC
// - the disk commits atomically and takes time; it is sometimes full or slow, and a crash may damage stored nodes
// - workers die, hang, slow down and come back; some farms have a machine that lies or sends garbage
// - the coordinator is killed before, during and after commits, or stands still and another one takes over
// - films of ended jobs leave memory, and are read again tile by tile during commits
// - clients change jobs, and retry unanswered requests
// Chaos lasts some seconds. Then the farm must finish its jobs.
//
// Checked during the run (checks.h):
// - acknowledged nodes are durable, and stay so; clients see the end of a job when it is durable
// - no lease is sent before its job's class and method are durable
// - no lease has merged samples, unless it audits them on another machine
// - no worker in quarantine gets a lease, and limits hold
// - no undisturbed worker loses a lease, and jobs fail only after the number of lost workers that the rule states
// - jobs with a time limit end neither early nor late
// - stored nodes never overlap, and their renderers are stored with them
//
// Checked at the end (end_checks.h): every job has the right state, and its film has the bytes of a run without faults,
// in memory and on disk. If a film may have unaudited results of a liar, or its job was cancelled, this holds only for
// nodes without a part of a liar. Its status has the counts of its film. A job with an error goal has the sample count
// that the sums of the run without faults give. A job that allows two classes, which round differently, has the same
// sums except for the last bits.
//
// World has time and chance. The server, worker and client sides own their parts of the farm.
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
  FarmSimulation(std::uint64_t seed, const Race& race, const PlantedBugs& bugs = {});  // race.cpp
  Report run();
  /// Prints the coordinator's notes, and events of processes.
  void trace() { world_.traced = true; }
  /// Hashes all effects of all coordinators, and their views after each event. With trace(), prints them too.
  void hash_effects() { server_.hash_effects(); }

 private:
  void make_schedule();
  void make_faults();
  void note_race();               // race.cpp
  bool deceit_has_ended() const;  // race.cpp

  World world_;
  ServerSide server_{world_, workers_, clients_, checks_};
  WorkerSide workers_{world_, server_, clients_};
  ClientSide clients_{world_, server_, workers_};
  Checks checks_{world_, server_, workers_, clients_};
  bool films_seen_ = false;
  std::optional<Time> race_started_, race_nearly_done_;
};

}  // namespace lightmill::simulation
