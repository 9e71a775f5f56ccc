// The worker without its threads, sockets and clock: events in, with their time; actions out.
//
// It holds leases, the tiles that are still to be rendered, and results until the coordinator has acknowledged them; it
// knows nothing of scenes, assets or gRPC. The shell around it feeds it from one thread at a time, and the simulation
// from one seed.
//
//   start → OpenStream → connected (hello) → Welcome (every unacknowledged result again) ⇄ disconnected (OpenStream
//   with backoff) LeaseGrant → PrepareJob → job_ready → RenderTile … tile_rendered → SendMessage(result) … ResultAck →
//   forgotten drain or DrainRequest → rest finished or given back → CloseStream, Exit
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/base/clock.h"
#include "common/farm/messages.h"

namespace lightmill {

struct SessionConfig {
  std::string name;  ///< unique on the farm: of two processes with one name, the second is dismissed
  std::string host;
  std::string machine;  ///< as WorkerHello::machine
  std::uint32_t pid = 0;
  std::uint32_t threads = 1;
  std::string fingerprint_class;
  std::string renderer_version;

  // Stated bounds.
  /// Rendering waits while unacknowledged results hold more.
  std::uint64_t unacknowledged_bytes = std::uint64_t{64} << 20;
  std::uint32_t max_leases = 64;                             ///< more are given back, pilots apart
  Duration reconnect_least = std::chrono::milliseconds(50);  ///< doubles with every failure …
  Duration reconnect_most = std::chrono::seconds(1);         ///< … up to this
  /// A coordinator that lets the worker in no more is asked as seldom: people have to do something first.
  Duration refused_least = std::chrono::seconds(1), refused_most = std::chrono::minutes(1);
  Duration prepare_retry = std::chrono::seconds(1);
  /// A drain drops what the coordinator has not acknowledged after so long without progress, not counting the time that
  /// tiles take which are with the threads: twice that of the longest so far …
  Duration drain_limit = std::chrono::seconds(30);
  Duration drain_away_limit = std::chrono::seconds(5);  ///< … or so long without a connection
};

// ---- what the shell is to do ----

/// Open a stream to the coordinator (the next of several addresses), then report `connected` or `disconnected`.
struct OpenStream {};
/// Half-close the stream once everything sent before has been written. Nothing is reported for it.
struct CloseStream {};
/// Send on the open stream; messages keep their order. Results are shared with the session, which may send them again.
struct SendMessage {
  std::shared_ptr<const WorkerMessage> message;
};
/// Fetch the job's assets and compile its scene; report `job_ready`, `job_failed` or `job_unavailable`. May be asked
/// again for the same job (a cache by digest answers at once).
struct PrepareJob {
  std::shared_ptr<const JobDescription> description;
};
/// The job has no work here any more. It may come back with another PrepareJob.
struct ForgetJob {
  JobId job;
};
/// Queue a tile for the rendering threads; report `tile_rendered`. At most 2 × threads are out.
struct RenderTile {
  std::uint64_t ticket = 0;  ///< to be given back with the tile
  std::shared_ptr<const JobDescription> description;
  NodeKey key;
  LeaseId lease;  ///< for the log, as the trace
  Hash128 trace;
};
/// Nobody wants the tile any more: end its rendering soon, and report `tile_rendered` nevertheless, with or without
/// values.
struct StopTile {
  std::uint64_t ticket = 0;
};
/// For the log: the coordinator has acknowledged this WorkerResult.
struct ResultStored {
  std::shared_ptr<const WorkerMessage> message;
};
/// Find out which of the grant's methods is the cheapest; report `pilot_done`, `pilot_failed` or `pilot_unavailable`.
/// May be asked again for the same lease.
struct RunPilot {
  std::shared_ptr<const PilotGrant> grant;
};
/// The pilot is not wanted any more, whether it waits or is being run: what it reports is not heard.
struct DropPilot {
  LeaseId lease;
};
/// Read scene files, instead of any read before; report `inspection_done`.
struct RunInspection {
  std::shared_ptr<const InspectGrant> grant;
};
/// It is not wanted any more: what it reports is not heard.
struct DropInspection {};
/// The worker's life is over: leave the process, after what was sent has been written.
struct Exit {
  std::string reason;
  bool failed = false;  ///< dismissed: exit with an error
};

/// Something for the log that the coordinator says.
struct Say {
  std::string text;
};

using SessionAction = std::variant<OpenStream, CloseStream, SendMessage, PrepareJob, ForgetJob, RenderTile, StopTile,
                                   RunPilot, DropPilot, RunInspection, DropInspection, ResultStored, Say, Exit>;
using SessionActions = std::vector<SessionAction>;

/// A tile as the rendering threads give it back.
struct RenderedTile {
  std::uint64_t ticket = 0;  ///< of its RenderTile
  Node node;
  Hash128 hash;        ///< hash_of(node), taken by the thread that rendered it
  double seconds = 0;  ///< thread time
  /// Why there are no values although nobody stopped it: what this worker lacks to render the job. Others may have it.
  std::string lacks = {};
};

/// Why a job or a pilot cannot be rendered.
struct Refused {
  std::string reason;
  bool own_limits = false;  ///< of this worker: others may render it
};

/// What people may see of a session.
struct SessionStatus {
  bool connected = false;
  bool draining = false;
  std::uint32_t leases = 0;
  std::uint32_t tiles_queued = 0;     ///< to be rendered, not handed to threads yet
  std::uint32_t tiles_rendering = 0;  ///< handed to threads
  std::uint32_t results_unacknowledged = 0;
  std::uint64_t unacknowledged_bytes = 0;
  std::uint64_t tiles_rendered = 0;  ///< since the start
};

/// Not thread-safe. Every call appends what is to be done to `actions`, in order. After Exit nothing more is asked for.
class Session {
 public:
  explicit Session(SessionConfig config);

  void start(Time now, SessionActions& actions);
  /// The stream that OpenStream asked for is up.
  void connected(Time now, SessionActions& actions);
  /// It is down, or could not be opened; `refused`: because of who the worker is, or for want of room. No
  /// message of it may be fed after this.
  void disconnected(Time now, SessionActions& actions, bool refused = false);
  void message(const CoordinatorMessage& message, Time now, SessionActions& actions);

  void job_ready(JobId job, Time now, SessionActions& actions);
  /// The job cannot be rendered, by anybody (its scene does not compile, an asset is damaged) or here.
  void job_failed(JobId job, const Refused& refused, Time now, SessionActions& actions);
  /// Assets could not be fetched now: asked again after `prepare_retry`.
  void job_unavailable(JobId job, Time now, SessionActions& actions);
  /// A tile for which the worker lacks something leaves its job to others.
  void tile_rendered(RenderedTile tile, Time now, SessionActions& actions);
  /// A thread has worked on this tile for so long, in CPU time; the coordinator is told with the next heartbeat.
  void at_work(std::uint64_t ticket, double cpu_seconds);

  void pilot_done(PilotReport report, Time now, SessionActions& actions);
  /// As job_failed.
  void pilot_failed(LeaseId lease, const Refused& refused, Time now, SessionActions& actions);
  /// As job_unavailable.
  void pilot_unavailable(LeaseId lease, Time now, SessionActions& actions);

  void inspection_done(InspectReport report, SessionActions& actions);

  /// Give back what is not begun, finish what is, leave (SIGTERM).
  void drain(Time now, SessionActions& actions);
  /// Does what is due: heartbeats, reconnects, retries.
  void tick(Time now, SessionActions& actions);
  /// When tick has something to do next.
  std::optional<Time> next_deadline() const;

  SessionStatus status() const;

 private:
  struct Lease {
    std::uint64_t epoch = 0;
    Unit unit;
    std::map<TileId, Sha256> tags;  ///< of the grant
    Hash128 trace;
    std::shared_ptr<const JobDescription> description;
    std::deque<TileId> queued;        ///< not handed to threads yet, in the unit's order
    std::set<TileId> rendering;       ///< handed to threads
    std::set<TileId> unacknowledged;  ///< rendered, not acknowledged yet
    bool give_back = false;           ///< a WorkerReturn follows once nothing is rendering
  };
  struct Job {
    enum class State { preparing, unavailable, ready };
    std::shared_ptr<const JobDescription> description;
    State state = State::preparing;
    Time retry;  ///< when unavailable
    std::uint32_t leases = 0;
    bool had_lease = false;  ///< a job that has just been described waits for its lease
  };
  /// Bound to the stream it came by.
  struct Pilot {
    std::shared_ptr<const PilotGrant> grant;
    std::optional<Time> retry;  ///< when unavailable
  };
  struct Rendering {
    NodeKey key;
    LeaseId lease;       ///< whose result it will be; may be gone by then
    bool wanted = true;  ///< false once it was stopped
    double cpu_seconds = 0;
  };
  struct Result {
    std::shared_ptr<const WorkerMessage> message;
    std::uint64_t sequence = 0;  ///< order of rendering, kept when sent again
    Time sent;                   ///< the last time
    std::uint64_t bytes = 0;
  };

  void send(WorkerMessage message, SessionActions& actions);
  /// The coordinator has let the worker in: it is sent what it has not acknowledged, unless that is another farm's.
  void welcome(const Welcome& welcome, Time now, SessionActions& actions);
  void send_results_again(SessionActions& actions);
  void drop_everything(SessionActions& actions);
  void describe_job(const JobDescription& description, SessionActions& actions);
  void grant_lease(const LeaseGrant& grant, SessionActions& actions);
  void grant_pilot(const PilotGrant& grant, SessionActions& actions);
  void drop_pilots(SessionActions& actions);
  void grant_inspection(const InspectGrant& grant, SessionActions& actions);
  void drop_inspection(SessionActions& actions);
  void acknowledge(const ResultAck& ack, Time now, SessionActions& actions);
  void cancel_leases(const LeaseCancel& cancel, SessionActions& actions);
  void begin_drain(bool give_back, Time now, SessionActions& actions);
  void extend_drain(Time now);
  void limit_absence(Time now);
  /// Hands tiles to threads; gives back and leaves when drained.
  void advance(SessionActions& actions);
  /// Whether nothing of the lease waits for a thread any more.
  bool hand_out(LeaseId id, Lease& lease, SessionActions& actions);
  void render(Lease& lease, LeaseId id, TileId tile, SessionActions& actions);
  /// Those being rendered of which `unwanted(Rendering)` holds.
  void stop_tiles(const std::function<bool(const Rendering&)>& unwanted, SessionActions& actions);
  void erase_lease(LeaseId lease, SessionActions& actions);
  void erase_lease_if_finished(LeaseId lease, SessionActions& actions);
  void erase_leases_of(JobId job, SessionActions& actions);
  /// Does no more of the job, and says why.
  void refuse(JobId job, const Refused& refused, SessionActions& actions);
  void forget_job(JobId job, SessionActions& actions);
  void forget_job_if_idle(JobId job, SessionActions& actions);
  void exit(const std::string& reason, bool failed, SessionActions& actions);

  SessionConfig config_;
  enum class Link { down, opening, up } link_ = Link::down;
  bool welcomed_ = false;  ///< by the coordinator, on this stream
  bool exited_ = false;
  bool draining_ = false;
  Time drain_deadline_;                ///< moves on with every tile rendered or acknowledged
  Duration longest_tile_{};            ///< of those of late
  std::optional<Time> away_deadline_;  ///< of a drain without a connection
  std::uint64_t epoch_ = 0;
  std::optional<Hash128> farm_;  ///< the last that let the worker in
  Duration heartbeat_interval_ = std::chrono::seconds(2);
  Time next_heartbeat_;
  Duration backoff_, refused_backoff_;
  Time next_open_;
  std::map<LeaseId, Lease> leases_;  ///< in the order of granting
  std::map<LeaseId, Pilot> pilots_;
  std::optional<InspectionId> inspection_;  ///< being read; bound to the stream it came by
  std::map<JobId, Job> jobs_;
  std::map<std::uint64_t, Rendering> rendering_;       ///< handed to threads, by ticket
  std::map<NodeKey, std::uint64_t> rendering_ticket_;  ///< the wanted ones
  std::map<NodeKey, Result> results_;                  ///< unacknowledged
  std::uint64_t result_bytes_ = 0;
  std::optional<Duration> longest_wait_;  ///< of results that were acknowledged since the last heartbeat
  std::uint64_t next_ticket_ = 1;
  std::uint64_t next_sequence_ = 0;
  std::uint64_t tiles_rendered_ = 0;
};

}  // namespace lightmill
