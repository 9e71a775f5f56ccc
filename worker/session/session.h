// Worker's side of the protocol: a state machine without threads, sockets or clock. It takes timed events and returns
// actions.
//
// It holds leases, tiles to render, and results until the coordinator acknowledges them. It does not know scenes,
// assets or gRPC. The shell feeds it events from one thread at a time. The simulation feeds it from one seed.
//
//     start → OpenStream → connected (hello) → Welcome (all unacknowledged results again)
//     disconnected → OpenStream with backoff
//     LeaseGrant → PrepareJob → job_ready → RenderTile … tile_rendered → SendMessage(result) … ResultAck → forgotten
//     drain or DrainRequest → rest finished or given back → CloseStream, Exit
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
  std::string name;  ///< unique in the farm: of two processes with one name, the coordinator refuses the second
  std::string host;
  std::string machine;  ///< see WorkerHello::machine
  std::uint32_t pid = 0;
  std::uint32_t threads = 1;
  std::string fingerprint_class;
  std::string renderer_version;

  // Limits.
  /// Rendering pauses while unacknowledged results exceed this.
  std::uint64_t unacknowledged_bytes = std::uint64_t{64} << 20;
  std::uint32_t max_leases = 64;  ///< further leases are given back; pilots are counted separately
  Duration reconnect_least = std::chrono::milliseconds(50);  ///< doubles with every failure …
  Duration reconnect_most = std::chrono::seconds(1);         ///< … up to this
  /// Backoff after a refusal, which usually lasts until a person acts.
  Duration refused_least = std::chrono::seconds(1), refused_most = std::chrono::minutes(1);
  Duration prepare_retry = std::chrono::seconds(1);
  /// A drain drops unacknowledged results after this time without progress. While tiles are being rendered, twice the
  /// time of the longest recent tile is added.
  Duration drain_limit = std::chrono::seconds(30);
  Duration drain_away_limit = std::chrono::seconds(5);  ///< limit without a connection
};

// ---- actions for the shell ----

/// Open a stream to the coordinator (the next of several addresses), then report `connected` or `disconnected`.
struct OpenStream {};
/// Half-close the stream after everything sent before has been written. There is no report.
struct CloseStream {};
/// Send on the open stream, in order. The session shares results, and may send them again.
struct SendMessage {
  std::shared_ptr<const WorkerMessage> message;
};
/// Fetch the job's assets and compile its scene. Report `job_ready`, `job_failed` or `job_unavailable`. It may come
/// again for the same job. A cache by digest answers at once.
struct PrepareJob {
  std::shared_ptr<const JobDescription> description;
};
/// The job has no more work here. It may come back with another PrepareJob.
struct ForgetJob {
  JobId job;
};
/// Queue a tile for the rendering threads, and report `tile_rendered`. At most 2 tiles per thread are pending.
struct RenderTile {
  std::uint64_t ticket = 0;  ///< returned with the tile
  std::shared_ptr<const JobDescription> description;
  NodeKey key;
  LeaseId lease;  ///< for the log, like the trace
  Hash128 trace;
};
/// The tile is not needed any more. End its rendering soon, and report `tile_rendered`, with or without values.
struct StopTile {
  std::uint64_t ticket = 0;
};
/// For the log: the coordinator has acknowledged this WorkerResult.
struct ResultStored {
  std::shared_ptr<const WorkerMessage> message;
};
/// Run the grant's pilot, which finds the cheapest method. Report `pilot_done`, `pilot_failed` or `pilot_unavailable`.
/// It may come again for the same lease.
struct RunPilot {
  std::shared_ptr<const PilotGrant> grant;
};
/// The pilot is not needed any more, whether it waits or runs. Its report is ignored.
struct DropPilot {
  LeaseId lease;
};
/// Read scene files. An earlier inspection is dropped. Report `inspection_done`.
struct RunInspection {
  std::shared_ptr<const InspectGrant> grant;
};
/// The inspection is not needed any more. Its report is ignored.
struct DropInspection {};
/// The worker has finished: exit after sent messages are written.
struct Exit {
  std::string reason;
  bool failed = false;  ///< the coordinator ended the session: exit with an error
};

/// A message for the log.
struct LogNotice {
  std::string text;
};

using SessionAction = std::variant<OpenStream, CloseStream, SendMessage, PrepareJob, ForgetJob, RenderTile, StopTile,
                                   RunPilot, DropPilot, RunInspection, DropInspection, ResultStored, LogNotice, Exit>;
using SessionActions = std::vector<SessionAction>;

/// A tile from the rendering threads.
struct RenderedTile {
  std::uint64_t ticket = 0;  ///< of its RenderTile
  Node node;
  Hash128 hash;        ///< hash_of(node), computed by the rendering thread
  double seconds = 0;  ///< thread time
  /// Set if the tile has no values, although it was not stopped: what this worker lacks for the job. Other workers may
  /// have it.
  std::string lacks = {};
};

/// Why a job or a pilot cannot be rendered.
struct JobRefusal {
  std::string reason;
  bool own_limits = false;  ///< of this worker; others may render it
};

/// State of a session, for people.
struct SessionStatus {
  bool connected = false;
  bool draining = false;
  std::uint32_t leases = 0;
  std::uint32_t tiles_queued = 0;     ///< to be rendered, not yet with threads
  std::uint32_t tiles_rendering = 0;  ///< with threads
  std::uint32_t results_unacknowledged = 0;
  std::uint64_t unacknowledged_bytes = 0;
  std::uint64_t tiles_rendered = 0;  ///< since the start
};

/// Not thread-safe. Every call appends actions in order. After Exit there are no more actions.
class Session {
 public:
  explicit Session(SessionConfig config);

  void start(Time now, SessionActions& actions);
  /// The stream of the last OpenStream is open.
  void connected(Time now, SessionActions& actions);
  /// The stream closed or could not be opened. `refused`: the coordinator refuses this worker, or has no room. Do not
  /// pass messages of this stream afterwards.
  void disconnected(Time now, SessionActions& actions, bool refused = false);
  void message(const CoordinatorMessage& message, Time now, SessionActions& actions);

  void job_ready(JobId job, Time now, SessionActions& actions);
  /// The job cannot be rendered by any worker (its scene does not compile, an asset is damaged), or not by this one.
  void job_failed(JobId job, const JobRefusal& refused, Time now, SessionActions& actions);
  /// Assets cannot be fetched now. The session asks again after `prepare_retry`.
  void job_unavailable(JobId job, Time now, SessionActions& actions);
  /// If the worker lacks something for a tile, it refuses the job, and others render it.
  void tile_rendered(RenderedTile tile, Time now, SessionActions& actions);
  /// CPU time that a thread has spent on this tile. The next heartbeat reports it.
  void at_work(std::uint64_t ticket, double cpu_seconds);
  /// The same for a pilot.
  void pilot_at_work(LeaseId lease, double cpu_seconds);

  void pilot_done(PilotReport report, Time now, SessionActions& actions);
  /// See job_failed().
  void pilot_failed(LeaseId lease, const JobRefusal& refused, Time now, SessionActions& actions);
  /// See job_unavailable().
  void pilot_unavailable(LeaseId lease, Time now, SessionActions& actions);

  void inspection_done(InspectReport report, SessionActions& actions);

  /// Gives back waiting work, finishes running work, and leaves (SIGTERM).
  void drain(Time now, SessionActions& actions);
  /// Does what is due: heartbeats, reconnects, retries.
  void tick(Time now, SessionActions& actions);
  /// Time of the next tick() that has something to do.
  std::optional<Time> next_deadline() const;

  SessionStatus status() const;

 private:
  struct Lease {
    std::uint64_t epoch = 0;
    Unit unit;
    std::map<TileId, Sha256> tags;  ///< from the grant
    Hash128 trace;
    std::shared_ptr<const JobDescription> description;
    std::deque<TileId> queued;        ///< not yet with threads, in the unit's order
    std::set<TileId> rendering;       ///< with threads
    std::set<TileId> unacknowledged;  ///< rendered, not acknowledged yet
    bool give_back = false;           ///< a WorkerReturn follows once nothing is rendering
  };
  struct Job {
    enum class State { preparing, unavailable, ready };
    std::shared_ptr<const JobDescription> description;
    State state = State::preparing;
    Time retry;  ///< if unavailable
    std::uint32_t leases = 0;
    bool had_lease = false;  ///< false: the job was just described, and waits for its lease
  };
  /// Belongs to the stream that brought it.
  struct Pilot {
    std::shared_ptr<const PilotGrant> grant;
    std::optional<Time> retry;  ///< if unavailable
    double cpu_seconds = 0;
  };
  struct Rendering {
    NodeKey key;
    LeaseId lease;       ///< of the result; may be gone by then
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
  /// The coordinator has admitted the worker. Sends unacknowledged results, or drops them if this is another farm, or
  /// the worker has another name there: its grants are not valid then.
  void welcome(const Welcome& welcome, Time now, SessionActions& actions);
  void send_results_again(SessionActions& actions);
  void drop_everything(std::string reason, SessionActions& actions);
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
  /// Hands tiles to threads. Gives back and leaves when drained.
  void advance(SessionActions& actions);
  /// Whether no tile of the lease waits for a thread any more.
  bool hand_out(LeaseId id, Lease& lease, SessionActions& actions);
  void render(Lease& lease, LeaseId id, TileId tile, SessionActions& actions);
  void take_result(const Rendering& rendering, RenderedTile tile, Time now, SessionActions& actions);
  /// Stops the current tiles for which `unwanted` is true.
  void stop_tiles(const std::function<bool(const Rendering&)>& unwanted, SessionActions& actions);
  void erase_lease(LeaseId lease, SessionActions& actions);
  void erase_lease_if_finished(LeaseId lease, SessionActions& actions);
  void erase_leases_of(JobId job, SessionActions& actions);
  /// Drops the job, and sends the coordinator the reason.
  void refuse(JobId job, const JobRefusal& refused, SessionActions& actions);
  Job* preparing_job(JobId job);  ///< null unless it is being prepared
  void forget_job(JobId job, SessionActions& actions);
  void forget_job_if_idle(JobId job, SessionActions& actions);
  void exit(const std::string& reason, bool failed, SessionActions& actions);

  SessionConfig config_;
  enum class Link { down, opening, up } link_ = Link::down;
  bool welcomed_ = false;  ///< by the coordinator, on this stream
  bool exited_ = false;
  bool draining_ = false;
  Time drain_deadline_;                ///< extended by every tile rendered or acknowledged
  Duration longest_tile_{};            ///< recently
  std::optional<Time> away_deadline_;  ///< of a drain without a connection
  std::uint64_t epoch_ = 0;
  std::optional<Hash128> farm_;  ///< the last farm that admitted the worker
  std::string name_in_farm_;     ///< of the worker, there
  Duration heartbeat_interval_ = std::chrono::seconds(2);
  Time next_heartbeat_;
  Duration backoff_, refused_backoff_;
  Time next_open_;
  std::map<LeaseId, Lease> leases_;  ///< in the order of grants
  std::map<LeaseId, Pilot> pilots_;
  std::optional<InspectionId> inspection_;  ///< being read; belongs to the stream that brought it
  std::map<JobId, Job> jobs_;
  std::map<std::uint64_t, Rendering> rendering_;       ///< with threads, by ticket
  std::map<NodeKey, std::uint64_t> rendering_ticket_;  ///< tiles that are still wanted
  std::map<NodeKey, Result> results_;                  ///< unacknowledged
  std::uint64_t result_bytes_ = 0;
  std::optional<Duration> longest_wait_;  ///< of results acknowledged since the last heartbeat
  std::uint64_t next_ticket_ = 1;
  std::uint64_t next_sequence_ = 0;
  std::uint64_t tiles_rendered_ = 0;
};

}  // namespace lightmill
