// Messages between worker and coordinator on their one stream, as plain values.
//
// Every message may be repeated or lost without harm. common/wire converts them to lightmill.v1.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/digest.h"
#include "common/base/ids.h"
#include "common/base/status.h"
#include "common/farm/inspection.h"
#include "common/farm/job.h"
#include "common/film/allocation.h"
#include "common/film/node.h"
#include "common/film/sample_range.h"

namespace lightmill {

/// A unit: a set of tiles × one sample range of one job.
struct Unit {
  JobId job;
  SampleRange range;
  std::vector<TileId> tiles;
  friend bool operator==(const Unit&, const Unit&) = default;
};

/// The key of one node of one job.
struct NodeKey {
  JobId job;
  TileId tile;
  SampleRange range;
  friend auto operator<=>(const NodeKey&, const NodeKey&) = default;
};

/// "job 1, samples [0, 16)".
std::string describe(JobId job, const SampleRange& range);
/// "job 1, samples [0, 16), tile 3".
std::string describe(const NodeKey& key);

struct HeldLease {
  LeaseId lease;
  std::uint64_t epoch = 0;
  Sha256 render_digest;      ///< of the job as the worker knows it: job 1 of another farm is another job
  Unit unit;                 ///< with the tiles that are not yet rendered or acknowledged
  std::vector<Sha256> tags;  ///< one per tile of the unit, as granted
};

// ---- worker → coordinator ----

/// The first message on every stream, also after a reconnect.
struct WorkerHello {
  std::string name;  ///< unique on the farm; while it sends heartbeats, a second process of this name is refused
  std::string host;
  std::uint32_t pid = 0;
  std::uint32_t threads = 1;
  std::string fingerprint_class;
  std::string renderer_version;
  std::vector<HeldLease> held;  ///< leases of an earlier session, of any epoch, that the worker still works on
  bool draining = false;
  std::string machine = {};  ///< the same for all processes on one machine, also in containers
  bool inspects = false;     ///< it understands InspectGrant
  /// The name of its certificate or token. The coordinator sets it. It is not sent. Empty: no authentication was
  /// required.
  std::string identity = {};
};

/// A tile that a thread works on, or a pilot, whose tile is 0.
struct TileAtWork {
  LeaseId lease;
  TileId tile;
  double cpu_seconds = 0;  ///< of its thread so far
  friend bool operator==(const TileAtWork&, const TileAtWork&) = default;
};

/// Sent every heartbeat interval. It renews the worker's leases that it lists. The coordinator answers unknown ones
/// with a LeaseCancel.
struct WorkerHeartbeat {
  std::vector<LeaseId> leases;
  /// The longest wait of a result for its acknowledgement. It covers results acknowledged since the previous heartbeat,
  /// and results that still wait. None if there are neither.
  std::optional<Duration> longest_wait = std::nullopt;
  std::vector<TileAtWork> at_work = {};  ///< tiles and pilots that took a second of CPU time or more
};

struct WorkerResult {
  LeaseId lease;
  NodeKey key;
  Node node;
  Hash128 hash;          ///< hash_of(node), computed by the worker
  Sha256 render_digest;  ///< a result belongs to a render digest, tile and range; others are refused
  double seconds = 0;    ///< thread time
  Hash128 trace = {};    ///< of its lease
  Sha256 tag = {};       ///< tag of its tile in the grant
  /// The node does not have the hash. The stream that receives the result finds this, because it takes long. Not sent.
  bool damaged = false;
};

/// Whether the node has the result's hash.
bool has_its_hash(const WorkerResult& result);

/// The worker returns the tiles of a lease for which it has sent no result, because it drains or does not know the job.
/// It sends the results that it has rendered first.
struct WorkerReturn {
  LeaseId lease;
};

/// The worker cannot render this job. Either no worker can (the scene does not compile, an asset is damaged), or its
/// own limits are too small.
struct WorkerRefusal {
  JobId job;
  std::string reason;
  bool own_limits = false;  ///< other workers may render it
};

/// The result of a pilot. Its thread seconds are part of the job's.
struct PilotReport {
  LeaseId lease;
  std::uint32_t choice = 0;          ///< index in the grant's methods
  std::vector<std::string> reasons;  ///< for people
  double seconds = 0;
  Allocation allocation{};  ///< if it was asked for and is worthwhile
};

/// The result of an inspection. An error says what is wrong with the files, or why they could not be read.
struct InspectReport {
  InspectionId inspection;
  Result<std::shared_ptr<const Inspection>> found;
};

/// The worker takes no more leases. It leaves after its last one.
struct WorkerDraining {};

// Copies of the two variants are compiled once, in messages.cpp: those of std::variant take seconds in each file.
struct WorkerMessage : std::variant<WorkerHello, WorkerHeartbeat, WorkerResult, WorkerReturn, WorkerRefusal,
                                    WorkerDraining, PilotReport, InspectReport> {
  using variant::variant;
  WorkerMessage(const WorkerMessage& other);
  WorkerMessage(WorkerMessage&& other) noexcept;
  WorkerMessage& operator=(const WorkerMessage& other);
  WorkerMessage& operator=(WorkerMessage&& other) noexcept;
  ~WorkerMessage();
};

// ---- coordinator → worker ----

struct Welcome {
  std::uint64_t epoch = 0;
  Duration heartbeat_interval{};
  Duration lease_duration{};  ///< a lease that is not renewed for this long is lost
  Hash128 farm{};             ///< id of the farm: grants of another farm are not valid here
  std::string worker{};  ///< its name in the farm, which begins with its identity; grants of another one are not valid
};

/// Describes a job. Sent before the first lease of this job that the worker holds in this session.
struct JobDescription {
  JobId job;
  Sha256 render_digest;
  RenderSettings settings;
};

struct LeaseGrant {
  LeaseId lease;
  Unit unit;
  Hash128 trace = {};  ///< trace_id of the job, for logs
  /// One per tile of the unit. It proves to every coordinator of the farm, at any time, that these samples were granted
  /// to this worker (server/domain/grant_signer.h).
  std::vector<Sha256> tags = {};
};

/// A request for a pilot: the worker finds the cheapest of these methods for the job, and may allocate its samples. It
/// ends with the stream. Then the pilot is granted again, and has the same result.
struct PilotGrant {
  LeaseId lease;
  JobId job;
  RenderSettings settings;           ///< whose method is still `auto`
  std::vector<std::string> methods;  ///< simplest first; only one if the pilot just allocates samples
  bool allocate = false;             ///< noisy tiles get more samples
};

/// A request to read these scene files and report what they hold. One at a time. It ends with the stream, or when the
/// worker leaves. Then another worker gets it.
struct InspectGrant {
  InspectionId inspection;
  std::shared_ptr<const InspectionRequest> request;
};

/// These nodes are committed, or not wanted. The worker may drop them.
struct ResultAck {
  std::vector<NodeKey> keys;
};

/// The worker stops working on these leases. It does not answer.
struct LeaseCancel {
  std::vector<LeaseId> leases;
};

/// The worker takes no more leases, finishes its work and leaves.
struct DrainRequest {};

/// The worker has to leave: another worker of this name replaced it, or its hello was refused.
struct Dismissal {
  std::string reason;
  bool for_now = false;  ///< no room now: try again later. The end of the stream tells this, not a message.
};

/// A line for the worker's log.
struct Notice {
  std::string text;
};

struct CoordinatorMessage : std::variant<Welcome, JobDescription, LeaseGrant, ResultAck, LeaseCancel, DrainRequest,
                                         Dismissal, PilotGrant, Notice, InspectGrant> {
  using variant::variant;
  CoordinatorMessage(const CoordinatorMessage& other);
  CoordinatorMessage(CoordinatorMessage&& other) noexcept;
  CoordinatorMessage& operator=(const CoordinatorMessage& other);
  CoordinatorMessage& operator=(CoordinatorMessage&& other) noexcept;
  ~CoordinatorMessage();
};

}  // namespace lightmill
