// Worker side of a simulated farm: workers in their processes, with streams, threads, deaths and hangs.
//
// Owns the workers. Their sessions are the real ones. The fake renderer renders, and some workers lie.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/domain/effects.h"
#include "tests/simulation/stream.h"
#include "tests/simulation/world.h"
#include "worker/session/session.h"

namespace lightmill::simulation {

class ServerSide;
class ClientSide;

/// Identity of all liars of a farm. Some farms have a second one: of a liar that comes back, or of the second of two.
inline constexpr const char* kIdentityOfLies = "identity-of-lies";
inline constexpr const char* kSecondIdentityOfLies = "identity-of-lies, again";
inline bool is_of_lies(const std::string& identity) {
  return identity == kIdentityOfLies || identity == kSecondIdentityOfLies;
}

/// Class of most workers.
inline constexpr const char* kUsualClass = "class-a";

/// Index of the candidate that a job's pilot chooses, on any worker.
std::size_t pilot_choice(const RenderSettings& settings, std::size_t candidates);
/// Allocation that a job's pilot finds, on any worker.
Allocation pilot_allocation(const RenderSettings& settings);

/// Pixel samples of a result of this job.
std::uint64_t pixel_samples(const JobDescription& job, const NodeKey& key);

/// Size of a result in parts of its job (kPartsOfAJob), at least 1. While the film has less than half of the job's
/// `goal`, the whole is twice what the film has.
double parts_of(const FilmOutline& film, std::uint64_t goal, const NodeKey& key);

/// Reasons of refusals: of broken jobs, and of sound ones.
inline constexpr const char* kBroken = "the scene does not compile";
inline constexpr const char* kSpite = "out of spite";

/// Misbehaviour of a worker. `idle`: it sends heartbeats, takes work and delivers nothing. `in_requests`: its sums are
/// right, but it refuses work or sends results that were not granted. `loses`: it dies with its leases. `by_plan`:
/// Deceit.
enum class Lies { never, always, sometimes, garbage, idle, in_requests, loses, by_plan };

struct SimulatedWorker {
  std::string name;
  std::string identity;          ///< its own on a farm with certificates; else its machine
  std::string machine;           ///< as it claims
  std::uint64_t inspection = 0;  ///< counts inspections that began or were dropped
  Lies lies = Lies::never;
  std::string fingerprint;
  std::uint32_t threads = 1;
  double slowness = 1;
  Time slow_until;  ///< a hundred times slower until then
  std::unique_ptr<Session> session;
  std::uint64_t life = 0;  ///< counts up with every start and death
  bool alive = false;
  Time hung_until;
  Time disturbed;  ///< end of its last hang or cut link
  std::shared_ptr<Stream> stream;
  std::deque<RenderTile> to_render;
  std::optional<RenderTile> last_tile;               ///< last requested tile
  std::shared_ptr<const WorkerMessage> last_result;  ///< last sent result
  std::map<std::uint64_t, NodeKey> rendering;        ///< by ticket: tiles in work on threads
  std::map<NodeKey, std::uint64_t> unacknowledged;   ///< pixel samples, rendered or in work
  Time next_tick = Time::max();
};

class WorkerSide {
 public:
  WorkerSide(World& world, ServerSide& server, ClientSide& clients)
      : world_(world), server_(server), clients_(clients) {}

  /// Draws the workers.
  void make();
  void make_racers(const Race& race);
  /// The last racer becomes slower, or hangs.
  void change_last(const Race& race);
  const SimulatedWorker& operator[](std::size_t index) const { return workers_[index]; }
  std::size_t size() const { return workers_.size(); }
  auto begin() const { return workers_.begin(); }
  auto end() const { return workers_.end(); }
  /// Whether some workers send wrong sums that look valid.
  bool have_liars() const { return have_liars_; }
  /// Whether the coordinator asks workers for certificates. If so, liars claim other names and machines.
  bool have_certificates() const { return have_certificates_; }
  /// Whether two identities of liars have rendered the samples, with the same wrong bits.
  bool have_agreed(const NodeKey& key) const { return agreed_.contains(key); }
  bool have_agreed() const { return !agreed_.empty(); }
  /// Whether the identity has rendered samples on which two identities of liars have agreed.
  bool is_outvoted(const std::string& identity) const;
  /// Whether the samples belong to the race's deceit. Its samples may be right.
  bool in_deceit(const NodeKey& key) const { return deceit_.contains(key); }

  /// Calls a worker's session: later if the worker hangs, never if it dies meanwhile.
  void on_worker(std::size_t index, std::uint64_t life, std::function<void(Session&, SessionActions&)> call);
  void acknowledged(std::size_t index, const ResultAck& ack);
  void break_stream(const std::shared_ptr<Stream>& stream);

  // ---- worker_faults.cpp: faults of one worker ----
  void kill_one();
  void hang_one();
  void break_one();
  void cut_link();
  void slow_down();
  /// Once it is found, a liar comes again with a second identity.
  void come_again_when_found(std::size_t index);
  /// A liar with new names leaves now and then.
  void leave_sometimes(std::size_t index);
  /// Plans the next garbage of a worker that sends it, and the next ungranted samples of a liar.
  void plan_babble();

 private:
  void start(std::size_t index);
  void kill(std::size_t index);
  void act(std::size_t index, const SessionActions& actions);
  void open_stream(std::size_t index);
  void sends(std::size_t index, const std::shared_ptr<const WorkerMessage>& message);
  void plan_tick(std::size_t index);
  void babble(std::size_t index);
  void send_ungranted(std::size_t index);
  /// A liar that restarts claims another name and machine.
  void change_claims(SimulatedWorker& worker);
  void die_of_poison(std::size_t index);

  // ---- refusing.cpp ----
  /// Why the worker refuses the job, if it does.
  std::optional<JobRefusal> refuses(std::size_t index, const RenderSettings& settings);
  /// Whether the job is too large for the worker. One worker of each class takes all jobs.
  bool is_too_large(std::size_t index, const RenderSettings& settings) const;
  /// Draws whether the worker runs out of memory, with this probability. Then it restarts.
  bool memory_ends(std::size_t index, double chance);

  // ---- rendering.cpp ----
  void prepare(std::size_t index, const PrepareJob& job);
  void run_pilot(std::size_t index, const RunPilot& pilot);
  void run_inspection(std::size_t index, const RunInspection& inspection);
  void render(std::size_t index);
  void tile_rendered(std::size_t index, std::uint64_t life, const RenderTile& tile, double seconds);
  void stop_tile(std::size_t index, std::uint64_t ticket);
  void lie(std::size_t index, const NodeKey& key, RenderedTile& rendered);
  void note_agreement(const std::string& identity, const NodeKey& key);
  /// Whether the race's deceit has the result. Adds it if it suits.
  bool joins_deceit(const NodeKey& key);

  World& world_;
  ServerSide& server_;
  ClientSide& clients_;
  std::vector<SimulatedWorker> workers_;
  bool have_liars_ = false, have_certificates_ = false;
  /// Of farms where two identities may lie alike: who has rendered which samples, and the samples on which they agree.
  std::map<NodeKey, std::set<std::string>> identities_;
  std::set<NodeKey> agreed_;
  std::set<NodeKey> deceit_;  ///< results
  double deceit_parts_ = 0;
  double seconds_per_pixel_sample_ = 2e-3;  ///< of one thread of a worker of slowness 1
};

}  // namespace lightmill::simulation
