// Server side of a simulated farm: the coordinator in its process, its disk, its commits and its crashes.
//
// Owns the coordinator, the disk, and the open streams. Each call into the coordinator ends in execute(), which checks,
// stores and sends its effects. Another coordinator may take over.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>

#include "server/domain/coordinator.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/stream.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class WorkerSide;
class ClientSide;
class Checks;

class ServerSide {
 public:
  ServerSide(World& world, WorkerSide& workers, ClientSide& clients, Checks& checks)
      : world_(world), workers_(workers), clients_(clients), checks_(checks) {}

  CoordinatorLimits& limits() { return limits_; }
  Coordinator* coordinator() const { return coordinator_.get(); }  ///< null while it is dead
  std::uint64_t life() const { return life_; }
  std::uint64_t epoch() const { return epoch_; }  ///< of the active coordinator
  const Disk& disk() const { return disk_; }
  /// Call it before start().
  void set_secret(const Sha256& secret) { disk_.set_secret(secret); }
  const std::map<SessionId, std::shared_ptr<Stream>>& streams() const { return streams_; }
  /// Tiles with damaged nodes.
  const std::set<std::pair<JobId, TileId>>& damaged() const { return damaged_; }

  void start();
  void crash(bool commit_lands);
  void crash_at_commit(std::uint64_t number) { crash_at_commit_.insert(number); }
  /// Calls the coordinator, if it is alive.
  void call(const std::function<void(Effects&)>& call);
  /// `replies`: to clients, when the effects are durable.
  void execute(Effects effects, std::vector<Action> replies);

  void open_stream(const std::shared_ptr<Stream>& stream);
  void receive(const std::shared_ptr<Stream>& stream, WorkerMessage message);
  /// The server notices that the stream broke, and takes it for the stream of `session`.
  void disconnected(const Stream& stream, SessionId session);

  // ---- server_films.cpp ----
  /// Runs `action` when effects report the job's film, unless the coordinator is killed first.
  void when_film_is_told(JobId job, Action action) { film_waits_.emplace(job, std::move(action)); }
  /// The job's film, read into memory. No other event may be pending.
  const Film& film_now(JobId job);

  // ---- server_faults.cpp ----
  void fill_disk();
  /// The coordinator stands still, and another one starts.
  void depose();

  /// Hashes all effects of all coordinators, and their views after each event.
  void hash_effects() { hash_.emplace(); }
  Hash128 effects_hash() const { return hash_ ? hash_->finish() : Hash128{}; }

 private:
  struct Pending {
    std::vector<StoreOp> writes;
    std::vector<Outgoing> after_commit;
    std::vector<Action> replies;  ///< to clients
    std::vector<JobId> film_reads;
  };
  struct FilmRead {
    JobId job;
    TileId next;
    StoredFilm nodes;
  };
  struct Deposed {
    std::unique_ptr<Coordinator> coordinator;
    std::uint64_t life = 0, epoch = 0;
    std::map<SessionId, std::shared_ptr<Stream>> streams;
    std::vector<StoreOp> unwritten;
    std::vector<std::pair<std::shared_ptr<Stream>, WorkerMessage>>
        inbox;  ///< messages that arrived while it stood still
  };

  StoredState load_checked();
  void note_effects(const Effects& effects, const Coordinator& coordinator);
  /// The running commit is stored as a whole or not at all. No reply or message follows.
  void abandon_commits(bool commit_lands);
  void start_commit();
  void finish_commit();
  void read_film(const std::shared_ptr<FilmRead>& read);
  void read_tile(FilmRead& read);
  void tell_films(const Effects& effects);
  void plan_tick();
  void send(Outgoing message);
  void deliver(const std::shared_ptr<Stream>& stream, const CoordinatorMessage& message);
  /// Changes the result for planted bugs.
  void falsify(const Stream& stream, WorkerResult& result);
  void damage_disk();
  /// The deposed coordinator resumes. It handles the messages that arrived meanwhile, and tries to store its effects.
  void resume_deposed();

  World& world_;
  WorkerSide& workers_;
  ClientSide& clients_;
  Checks& checks_;
  CoordinatorLimits limits_;
  Disk disk_;
  std::unique_ptr<Coordinator> coordinator_;
  std::uint64_t life_ = 0, epoch_ = 0;
  std::optional<Deposed> deposed_;
  Time disk_full_until_, disk_slow_until_;
  std::set<std::pair<JobId, TileId>> damaged_;
  Time next_tick_ = Time::max();
  std::deque<Pending> pending_;
  std::vector<Pending> committing_;
  std::uint64_t commits_ = 0;
  std::set<std::uint64_t> crash_at_commit_;
  std::uint64_t next_session_ = 1;
  std::map<SessionId, std::shared_ptr<Stream>> streams_;
  std::multimap<JobId, Action> film_waits_;
  std::set<NodeKey> falsified_;            ///< by the planted bug `wrong_beside_lies`
  std::map<NodeKey, Node> first_results_;  ///< only with repeat_results
  std::optional<Xxh3Hasher> hash_;
};

}  // namespace lightmill::simulation
