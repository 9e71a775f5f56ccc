// What a worker and the coordinator say to each other on their one stream, as plain values.
//
// Every message may be repeated or lost; none does harm twice. common/wire converts them to lightmill.v1.
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

/// Names one node of one job.
struct NodeKey {
  JobId job;
  TileId tile;
  SampleRange range;
  friend auto operator<=>(const NodeKey&, const NodeKey&) = default;
};

struct HeldLease {
  LeaseId lease;
  std::uint64_t epoch = 0;
  Sha256 render_digest;      ///< of the job as the worker knows it: job 1 of another farm is another job
  Unit unit;                 ///< with the tiles that are still to be rendered or acknowledged
  std::vector<Sha256> tags;  ///< of each tile of the unit, as granted
};

// ---- worker → coordinator ----

/// The first message on every stream, also after a reconnect.
struct WorkerHello {
  std::string name;  ///< unique on the farm; a second one of the same name replaces the first
  std::string host;
  std::uint32_t pid = 0;
  std::uint32_t threads = 1;
  std::string fingerprint_class;
  std::string renderer_version;
  std::vector<HeldLease> held;  ///< leases of an earlier session, of any epoch, that are still being worked on
  bool draining = false;
  std::string machine = {};  ///< the same for all processes on one machine, whatever containers they are in
  bool inspects = false;     ///< it knows what an InspectGrant is
  /// The name of its certificate or token. The coordinator finds it out; it is not sent. Empty: nothing was asked for.
  std::string identity = {};
};

/// A tile that a thread works on.
struct TileAtWork {
  LeaseId lease;
  TileId tile;
  double cpu_seconds = 0;  ///< of its thread, so far
  friend bool operator==(const TileAtWork&, const TileAtWork&) = default;
};

/// Sent every heartbeat interval: it renews all the worker's leases that it lists. Those that the coordinator does not
/// know are answered with a LeaseCancel.
struct WorkerHeartbeat {
  std::vector<LeaseId> leases;
  /// The longest that a result has waited: one that was acknowledged since the heartbeat before, until it was; one that
  /// still waits to be, until now. None if there are neither.
  std::optional<Duration> longest_wait = std::nullopt;
  std::vector<TileAtWork> at_work = {};  ///< those that have taken a second of CPU time or more
};

struct WorkerResult {
  LeaseId lease;
  NodeKey key;
  Node node;
  Hash128 hash;          ///< hash_of(node), computed by the worker
  Sha256 render_digest;  ///< a result is a fact about (render digest, tile, range): others' are not wanted
  double seconds = 0;    ///< thread time that it took
  Hash128 trace = {};    ///< as its lease's
  Sha256 tag = {};       ///< of its tile in the grant
};

/// The worker gives the tiles of a lease back for which it has sent no result (it drains, or does not know the job).
/// Results of the lease that it has rendered come before.
struct WorkerReturn {
  LeaseId lease;
};

/// The worker cannot render this job: nobody can (the scene does not compile, an asset is damaged), or it alone cannot,
/// by limits of its own.
struct WorkerRefusal {
  JobId job;
  std::string reason;
  bool own_limits = false;  ///< others may render it
};

/// What a pilot has found. Its thread seconds are part of the job's.
struct PilotReport {
  LeaseId lease;
  std::uint32_t choice = 0;          ///< index in the grant's methods
  std::vector<std::string> reasons;  ///< for people
  double seconds = 0;
  Allocation allocation{};  ///< where it was asked for, and gains something
};

/// What an inspection has found; an error says what is wrong with the files, or why they could not be read.
struct InspectReport {
  InspectionId inspection;
  Result<std::shared_ptr<const Inspection>> found;
};

/// The worker takes no more leases; it leaves when its last one is done.
struct WorkerDraining {};

using WorkerMessage = std::variant<WorkerHello, WorkerHeartbeat, WorkerResult, WorkerReturn, WorkerRefusal,
                                   WorkerDraining, PilotReport, InspectReport>;

// ---- coordinator → worker ----

struct Welcome {
  std::uint64_t epoch = 0;
  Duration heartbeat_interval{};
  Duration lease_duration{};  ///< a lease not renewed for so long is lost
  Hash128 farm{};             ///< names the farm: grants of another one are worth nothing here
};

/// Describes a job. Sent before each lease of a job of which the worker holds no other lease of this session.
struct JobDescription {
  JobId job;
  Sha256 render_digest;
  RenderSettings settings;
};

struct LeaseGrant {
  LeaseId lease;
  Unit unit;
  Hash128 trace = {};  ///< trace_id of the job, for logs
  /// For each tile of the unit: proves to every coordinator of the farm, at any time, that these samples were granted
  /// to this worker (server/domain/grants.h).
  std::vector<Sha256> tags = {};
};

/// A unit of its own kind: find out which of these methods is the cheapest for the job, and where its samples go. It is
/// bound to the stream: where that breaks, the pilot is granted again, and comes to the same.
struct PilotGrant {
  LeaseId lease;
  JobId job;
  RenderSettings settings;           ///< whose method is still `auto`
  std::vector<std::string> methods;  ///< the simplest first; one only if samples are to be allocated
  bool allocate = false;             ///< samples go by noise
};

/// Read these scene files and say what they hold. One at a time; bound to the stream, as a pilot is, and dropped by a
/// worker that leaves: another one gets it.
struct InspectGrant {
  InspectionId inspection;
  std::shared_ptr<const InspectionRequest> request;
};

/// These nodes are committed (or not wanted): the worker may forget them.
struct ResultAck {
  std::vector<NodeKey> keys;
};

/// Stop working on these leases; answer with nothing.
struct LeaseCancel {
  std::vector<LeaseId> leases;
};

/// Take no more leases, finish what is there, leave.
struct DrainRequest {};

/// Another worker of this name has taken over, or the hello was not acceptable: leave.
struct Dismissal {
  std::string reason;
  bool for_now = false;  ///< there is no room: ask again later. It is told by the end of the stream, not by a message.
};

/// Something that the worker's people are to know: a line for its log.
struct Notice {
  std::string text;
};

using CoordinatorMessage = std::variant<Welcome, JobDescription, LeaseGrant, ResultAck, LeaseCancel, DrainRequest,
                                        Dismissal, PilotGrant, Notice, InspectGrant>;

}  // namespace lightmill
