// Effects of the coordinator's decisions: rows to store, messages to send, notes for the log.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/ids.h"
#include "common/farm/job.h"
#include "common/farm/messages.h"
#include "common/film/film.h"
#include "server/access/action_log.h"
#include "server/access/token_book.h"

namespace lightmill {

/// Everything of a job, except pixels, that must outlive the coordinator.
struct JobRecord {
  JobId id;
  JobSpec spec;  ///< with the current goal and priority
  MethodNotes method_notes;
  Allocation allocation;  ///< even but for adaptive jobs, and until their pilot
  JobState state = JobState::queued;
  std::string reason;
  GoalLimit reached = GoalLimit::none;  ///< of a done job
  std::string fingerprint_class;        ///< empty until fixed; kMixedClass if it allows all
  double active_seconds = 0;
  double worker_seconds = 0;
  JobCounters counters;
  std::vector<ErrorPoint> history;  ///< some sixty at most: see JobStatus; only ever grows
  std::int64_t submitted_unix_ms = 0, finished_unix_ms = 0;
};

/// Inserts or replaces the job's row.
struct PutJob {
  JobRecord record;
};
/// Updates the part of a job's row that changes with every result. The row exists.
struct PutProgress {
  JobId job;
  double active_seconds = 0;
  double worker_seconds = 0;
  JobCounters counters;
};
/// Deletes the job, its nodes and its results.
struct DeleteJobRows {
  JobId job;
};
/// Inserts a node of the film's forest.
struct PutNode {
  JobId job;
  TileId tile;
  std::shared_ptr<const Node> node;
};
/// Deletes a node: it was joined with its sibling, or replaced.
struct DropNode {
  NodeKey key;
};
/// Worker that rendered something, and whom that is attributed to (identity_of); empty: not known. The class is set
/// only for jobs that allow several: there, only workers of one class can be compared.
struct Renderer {
  std::string worker, identity, fingerprint_class = {};
  friend auto operator<=>(const Renderer&, const Renderer&) = default;
};
/// Records the renderer of a merged result, and its hash.
struct PutResult {
  NodeKey key;
  Hash128 hash;
  Renderer by;
  bool to_verify = false;  ///< another identity is still to render it again
};
/// A recorded result has been rendered again, with the same bits.
struct PutVerified {
  NodeKey key;
};
/// Forgets the recorded results of the key's tile whose samples lie within the key's.
struct DropResults {
  NodeKey key;
};
/// Forgets one recorded result. Its numbers may be out of a key's range.
struct DropResultRow {
  JobId job;
  std::int64_t tile = 0, level = 0, index = 0;
  friend bool operator==(const DropResultRow&, const DropResultRow&) = default;
};

/// A worker that gets nothing to render, and neither do others of its identity: it has sent wrong bits.
struct QuarantineRecord {
  Renderer of;
  std::string reason;
  std::int64_t since_unix_ms = 0;
  std::string host = {};  ///< of a worker without certificate or token: others on this host share its quarantine
  friend bool operator==(const QuarantineRecord&, const QuarantineRecord&) = default;
};
/// Prefix of the reason when an operator, not a failed check, put the worker into quarantine.
inline constexpr std::string_view kByHand = "put there by ";
/// Inserts it, or replaces that of the same worker.
struct PutQuarantine {
  QuarantineRecord record;
};
struct DropQuarantine {
  std::string worker;
};

/// Inserts a token, or replaces the one of its id.
struct PutToken {
  TokenRecord token;
};
struct DropToken {
  std::string id;
};

/// Inserts an entry of the farm's log; one of this number that is there stays.
struct PutAction {
  Action action;
};
struct DropAction {
  std::uint64_t number = 0;
};

using StoreOp = std::variant<PutJob, PutProgress, DeleteJobRows, PutNode, DropNode, PutResult, PutVerified, DropResults,
                             DropResultRow, PutQuarantine, DropQuarantine, PutToken, DropToken, PutAction, DropAction>;

/// A message for the worker of one session.
struct Outgoing {
  SessionId to;
  CoordinatorMessage message;
};

/// Leases that these messages grant.
std::vector<LeaseId> leases_granted(std::span<const Outgoing> messages);

/// Something worth a line in the log.
struct Note {
  enum class Level { info, warning };
  Level level = Level::info;
  std::string text;
  // The job, worker or lease that it is about, if any.
  JobId job{};
  std::string worker = {};
  LeaseId lease{};
};

/// A worker at one moment. The last three count up while the coordinator knows it.
struct WorkerCount {
  std::string name;
  std::uint32_t threads = 0, leases = 0;
  std::uint64_t results = 0, leases_lost = 0, pixel_samples = 0;
};

/// Answer to the client that asked for an inspection.
struct InspectionOutcome {
  InspectionId id;
  Result<std::shared_ptr<const Inspection>> found;
};

/// Whether a film that was asked for is in memory now, and else why not.
struct FilmOutcome {
  JobId job;
  Status status;
};

/// What one or several events lead to. `writes` are applied in order, in one transaction. Only when they are durable
/// may `after_commit` be sent and a client be answered. `now` may be sent at once, before or after.
///
/// Effects are committed in the order in which they arose; several may share a transaction. `after_commit`, also of
/// effects without writes, is sent only when all earlier effects are durable: an acknowledgement may stand on an
/// earlier node. Within one session, the messages of `now` keep their order, and those of `after_commit` theirs.
struct Effects {
  std::vector<StoreOp> writes;
  std::vector<Outgoing> now;
  std::vector<Outgoing> after_commit;
  std::vector<SessionId> closed;             ///< sessions whose streams are to end at once
  std::vector<InspectionOutcome> inspected;  ///< to be told at once: none of it is stored
  std::vector<Note> notes;
  std::vector<WorkerCount> departed;  ///< workers that are forgotten, as they were last
  std::vector<JobId> film_reads;      ///< films to be read from the store, after these writes and all earlier ones
  std::vector<FilmOutcome> films;     ///< to be told at once
};

/// What a store gives back when a coordinator starts.
struct StoredState {
  struct StoredNode {
    StoredNode(TileId of, NodePtr stored) : tile(of), outline(outline_of(*stored)), node(std::move(stored)) {}
    StoredNode(TileId of, const NodeOutline& stored) : tile(of), outline(stored) {}
    TileId tile;
    NodeOutline outline;
    NodePtr node;  ///< null where its values were left in the store
  };
  struct StoredResult {
    TileId tile;
    SampleRange range;
    Hash128 hash;
    std::uint32_t by = 0;  ///< index in `renderers`
    bool to_verify = false;
  };
  struct StoredJob {
    JobRecord record;
    std::vector<StoredNode> nodes;           ///< the forest, any order; of a job that has ended perhaps outlines alone
    std::vector<StoredResult> results = {};  ///< that it was merged from, any order
  };
  std::uint64_t epoch = 1;  ///< of the coordinator that starts now: one more than the last
  std::vector<StoredJob> jobs;
  std::uint64_t next_job_id = 1;      ///< never reused, even after deletes
  std::vector<NodeKey> damaged = {};  ///< nodes that were stored, and are left out because they are damaged
  /// Rows whose renderer is lost. take_out_nonsense puts the nodes that they went into among `damaged`.
  std::vector<DropResultRow> damaged_results = {};
  std::vector<JobId> damaged_jobs = {};           ///< left out: what was stored of them is not what was written
  std::vector<std::string> damaged_entries = {};  ///< tokens and entries of the log that mean nothing, in words
  std::vector<TokenRecord> tokens = {};
  std::vector<Action> actions = {};  ///< any order
  std::vector<Renderer> renderers = {};
  std::vector<QuarantineRecord> quarantine = {};
  Sha256 secret = {};  ///< of this store, drawn when it was made: draws the results that are audited
};

/// Nodes of one film, with their values.
using StoredFilm = std::vector<StoredState::StoredNode>;

}  // namespace lightmill
