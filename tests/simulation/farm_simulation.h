// A whole farm on a simulated clock, network and disk, driven from one seed.
//
// The coordinator and the workers' sessions are the real ones. Around them: streams that delay, repeat and lose
// messages (order within a stream is kept, as gRPC keeps it; across streams and the disk anything may overtake), a disk
// whose commits take time and are all or nothing, workers that die, hang and come back, a coordinator that is killed
// before, during and after commits, and clients that repeat what was not answered. Some farms have a machine that lies:
// its workers send wrong sums, always or now and then, or garbage. Links are cut in one direction, workers become a
// hundred times slower, the disk is full or slow or has damaged what it held, and a coordinator that stood still goes
// on after another one has taken over. Chaos lasts some seconds, then the farm must finish its jobs.
//
// Checked on the way: acknowledged nodes are durable, and stay so; no lease leaves before its job's class and
// method are durable, nor names samples that are merged already, unless a machine verifies what another one rendered;
// nobody in quarantine gets a lease; bounds hold; what is stored never overlaps, and who rendered it is stored with it.
// At the end: every job has ended as it must (one that asks for an error, with the count that the quiet run's sums
// give), and its film, in memory and on disk, has the bytes of the fixed sums over its samples, which are also those of
// the quiet run (QuietFarm checks it by the same comparison). Where a job allows workers of two classes, which round
// differently, its sums are those but for their last bits: each sample is in, once.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <queue>
#include <set>
#include <string>
#include <vector>

#include "common/film/film.h"
#include "server/domain/coordinator.h"
#include "tests/simulation/chaos.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/fake_renderer.h"
#include "tests/simulation/random.h"
#include "worker/session/session.h"

namespace lightmill::simulation {

/// Of most workers.
inline constexpr const char* kUsualClass = "class-a";

class FarmSimulation {
 public:
  FarmSimulation(std::uint64_t seed, const Chaos& chaos, const PlantedBugs& bugs);
  FarmSimulation(std::uint64_t seed, const Race& race);
  Report run();
  /// Prints what the coordinator notes and what happens to processes.
  void trace() { traced_ = true; }
  /// Hashes all effects of all coordinators, and what can be seen of them after each event; traced, prints them too.
  void hash_effects() { effects_.emplace(); }

 private:
  using Action = std::function<void()>;
  struct Event {
    Time time;
    std::uint64_t order;
    Action action;
    bool operator>(const Event& other) const { return std::tie(time, order) > std::tie(other.time, other.order); }
  };

  /// One stream of one worker's life with one coordinator's life.
  struct Stream {
    std::size_t worker = 0;
    std::string name;  ///< by which the worker had come
    std::uint64_t worker_life = 0;
    std::uint64_t server_life = 0;
    SessionId session;
    bool broken = false;
    bool lingers = false;  ///< broken for the worker; what it had sent still comes
    bool said_hello = false;
    Time cut_up, cut_down;    ///< until when nothing comes through
    Time last_up, last_down;  ///< when the last message arrives: order within a direction is kept
  };
  enum class Lies { never, always, sometimes, garbage };
  struct SimulatedWorker {
    std::string name;
    std::string machine;
    std::uint64_t inspection = 0;  ///< counts those that were begun and dropped
    Lies lies = Lies::never;
    std::string fingerprint;
    std::uint32_t threads = 1;
    double slowness = 1;
    Time slow_until;  ///< a hundred times slower until then
    std::unique_ptr<Session> session;
    std::uint64_t life = 0;  ///< counts up with every start and death
    bool alive = false;
    Time hung_until;
    std::shared_ptr<Stream> stream;
    std::deque<RenderTile> to_render;
    std::map<std::uint64_t, NodeKey> rendering;       ///< by ticket: what threads are at
    std::map<NodeKey, std::uint64_t> unacknowledged;  ///< pixel samples, rendered or in work
    Time next_tick = Time::max();
  };
  struct Pending {
    std::vector<StoreOp> writes;
    std::vector<Outgoing> after_commit;
    std::vector<Action> replies;  ///< to clients
  };
  struct ClientJob {
    JobSpec spec;
    MethodNotes notes;  ///< with candidates for a pilot, or without
    std::optional<JobId> id;
    std::uint64_t goal = 0;            ///< samples that were asked for, with all extensions; 0: none
    double error = 0;                  ///< likewise
    std::uint64_t poison = kNoPoison;  ///< from this sample on tile 0 kills its worker
    bool poisoned_pilot = false;
    bool cancel_asked = false;
    bool cancelled = false;
    bool removed = false;
  };
  static constexpr std::uint64_t kNoPoison = ~std::uint64_t{0};

  // ---- world ----
  void at(Time time, Action action);
  void after(Duration delay, Action action) { at(now_ + delay, std::move(action)); }
  void fail(std::string what);
  bool chaos_now() const { return now_ < chaos_end_; }
  std::int64_t unix_ms() const;
  void make_schedule();
  void make_workers();

  // ---- faults.cpp ----
  void make_faults();
  void inject(const std::string& kind);
  void cut_link();
  void slow_down();
  void babble(std::size_t index);
  void fill_disk();
  void damage_disk();
  /// It stands still, and another one starts.
  void depose_server();
  /// One that was deposed goes on: takes what came meanwhile, and tries to store what follows.
  void resume_deposed();

  // ---- inspecting.cpp ----
  void make_inspections();
  std::optional<InspectionId> inspect(const std::string& caller);
  void ask_inspection();
  void ask_last_inspection();
  void lose_inspections();
  void note_inspected(const Effects& effects);
  void run_inspection(std::size_t index, const RunInspection& inspection);

  // ---- race.cpp ----
  void make_race();
  void note_race();

  // ---- server_side.cpp ----
  void start_server();
  void crash_server(bool commit_lands);
  void on_server(const std::function<void(Effects&)>& call);
  void note_effects(const Effects& effects, const Coordinator& coordinator);
  void execute(Effects effects, std::vector<Action> replies);
  /// What was being written lands as a whole or not at all; nobody hears of it.
  void abandon_commits(bool commit_lands);
  void start_commit();
  void finish_commit();
  void plan_server_tick();
  void server_sends(Outgoing message);
  void deliver(const std::shared_ptr<Stream>& stream, const CoordinatorMessage& message);
  void server_receives(const std::shared_ptr<Stream>& stream, WorkerMessage message);
  StoredState load_checked();

  // ---- server_checks.cpp ----
  void check_decisions(const Effects& effects);
  /// Whether the worker of the session may be leased what is merged: it was somebody else's on another machine.
  bool may_verify(SessionId session, const NodeKey& key) const;
  void note_writes(const Effects& effects);
  void note_grants(const Effects& effects);
  /// Nobody loses what nobody was sent.
  void check_losses(const Effects& effects);
  void note_stored(std::span<const StoreOp> ops);
  /// Of a lease that leaves now, unless its job has lost its class since it was granted: nothing comes of that one.
  void check_grant(const Stream& stream, const LeaseGrant& grant);
  void note_unwanted(const Effects& effects);
  void check_ack(const Stream& stream, const ResultAck& ack);
  void check_acknowledged_is_durable();

  // ---- worker_side.cpp ----
  void start_worker(std::size_t index);
  void kill_worker(std::size_t index);
  /// Calls into a worker's session, later if it hangs, never if it has died meanwhile.
  void on_worker(std::size_t index, std::uint64_t life, std::function<void(Session&, SessionActions&)> call);
  void act(std::size_t index, const SessionActions& actions);
  void open_stream(std::size_t index);
  void break_stream(const std::shared_ptr<Stream>& stream);
  void worker_sends(std::size_t index, const std::shared_ptr<const WorkerMessage>& message);
  void prepare(std::size_t index, const PrepareJob& job);
  void run_pilot(std::size_t index, const RunPilot& pilot);
  void render(std::size_t index);
  void stop_tile(std::size_t index, std::uint64_t ticket);
  void lie(std::size_t index, const NodeKey& key, RenderedTile& rendered);
  /// The job that a client has submitted with these settings' seed and scene name.
  const ClientJob& job_of(const RenderSettings& settings) const;
  /// Whether the job is too large for the worker. For one of each class nothing is.
  bool is_too_large(std::size_t index, const RenderSettings& settings) const;
  void die_of_poison(std::size_t index);
  void plan_worker_tick(std::size_t index);

  // ---- client_side.cpp ----
  void make_jobs();
  void submit(std::size_t index);
  void change_something();
  /// Asks until it is answered: `ask` returns whether the answer settles the matter once the effects is committed, else
  /// is repeated.
  void request(std::function<bool(Effects&)> ask, Action answered);
  void extend(std::size_t index);
  void pause(std::size_t index);
  void quarantine(const std::string& worker);
  void cancel(std::size_t index);
  bool is_cancelled_on_disk(JobId id) const;
  bool all_ended() const;
  std::string describe_farm() const;

  // ---- end_checks.cpp ----
  std::uint64_t workers_lost() const;
  void check_end();
  void check_method(const ClientJob& job);
  void check_film(const ClientJob& job, const JobStatus& status);
  /// Returns how many results are stored that have not been verified.
  std::uint64_t check_results(JobId job, TileId tile);
  /// Whether workers may have rounded differently in this job.
  bool may_be_rounded(const ClientJob& job) const;
  /// The samples that a job with a goal in error ends with, whatever happens to the farm.
  std::uint64_t count_of(const ClientJob& job, const JobStatus& status) const;

  template <class... Args>
  void trace(fmt::format_string<Args...> format, Args&&... args) const {
    if (traced_) {
      fmt::print("{:9.4f}  {}\n", to_seconds(now_.time_since_epoch()),
                 fmt::format(format, std::forward<Args>(args)...));
    }
  }

  bool traced_ = false;
  std::optional<Xxh3Hasher> effects_;
  Random random_;
  Chaos chaos_;
  PlantedBugs bugs_;
  std::optional<Race> race_;
  std::optional<Time> race_started_, race_nearly_done_;
  Report report_;
  Time now_{std::chrono::seconds(100)};
  Time chaos_end_;
  std::uint64_t next_order_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;

  CoordinatorLimits limits_;
  double seconds_per_pixel_sample_ = 2e-3;  ///< of one thread of a worker of slowness 1
  Disk disk_;
  std::unique_ptr<Coordinator> coordinator_;
  std::uint64_t server_life_ = 0;
  std::uint64_t epoch_ = 0;  ///< of the coordinator at work
  struct Deposed {
    std::unique_ptr<Coordinator> coordinator;
    std::uint64_t life = 0, epoch = 0;
    std::map<SessionId, std::shared_ptr<Stream>> streams;
    std::vector<StoreOp> unwritten;
    std::vector<std::pair<std::shared_ptr<Stream>, WorkerMessage>> inbox;  ///< what came while it stood still
  };
  std::optional<Deposed> deposed_;
  Time disk_full_until_, disk_slow_until_;
  std::set<std::pair<JobId, TileId>> damaged_;  ///< tiles of which something was damaged
  Time next_server_tick_ = Time::max();
  std::deque<Pending> pending_;
  std::vector<Pending> committing_;
  std::uint64_t commits_ = 0;
  std::set<std::uint64_t> crash_at_commit_;
  std::uint64_t next_session_ = 1;
  std::map<SessionId, std::shared_ptr<Stream>> streams_;
  std::map<std::pair<SessionId, NodeKey>, Sha256> last_result_;  ///< render digests of results that came
  std::set<NodeKey> acknowledged_;                               ///< with the right digest
  /// Results whose acknowledgement says that they lay beyond the decided count when they came.
  std::multiset<std::pair<SessionId, NodeKey>> unwanted_;
  std::map<JobId, std::uint64_t> unbound_;         ///< how often each lost its class again
  std::map<LeaseId, std::uint64_t> unbound_then_;  ///< the same of a lease's job when it was granted
  std::map<NodeKey, Renderer> merged_by_;          ///< as the coordinator has it
  std::map<NodeKey, Node> first_results_;          ///< only with repeat_results
  std::vector<NodeKey> dropped_;                   ///< what it took out of films
  bool has_liars_ = false;                         ///< who send sums that look right
  std::set<LeaseId> sent_;                         ///< whose grants have left, or that workers came back with
  std::map<std::string, std::size_t> brought_;     ///< leases that a worker's last hello came with

  std::vector<SimulatedWorker> workers_;
  std::vector<ClientJob> client_jobs_;
  std::uint64_t open_requests_ = 0;
  std::optional<InspectionId> last_inspection_;
  std::map<InspectionId, std::string> asked_;  ///< whose answers are waited for, and their scenes
};

/// Why a worker is in quarantine that nobody has convicted.
inline constexpr const char* kByHand = "put there by hand";

/// Which of its candidates a job's pilot picks, whoever runs it.
std::size_t pilot_choice(const RenderSettings& settings, std::size_t candidates);

/// What a job's pilot gives its tiles, whoever runs it.
Allocation pilot_allocation(const RenderSettings& settings);

/// The renderer that all simulations share: what it has rendered once, it knows.
FakeRenderer& shared_renderer();

}  // namespace lightmill::simulation
