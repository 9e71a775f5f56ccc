// Records of a store, the writes that change them, and the state that it returns.
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
#include "server/access/token_registry.h"

namespace lightmill {

/// Record of a job: everything but pixels that must outlive the coordinator.
struct JobRecord {
  JobId id;
  JobSpec spec;  ///< with the current goal and priority
  MethodNotes method_notes;
  Allocation allocation;  ///< even, except for adaptive jobs after their pilot
  JobState state = JobState::queued;
  std::string reason;
  GoalLimit reached = GoalLimit::none;  ///< only for a done job
  std::string fingerprint_class;        ///< empty until fixed; kMixedClass if it allows all
  double active_seconds = 0;
  double worker_seconds = 0;
  JobCounters counters;
  std::vector<ErrorPoint> history;  ///< about sixty at most: see JobStatus; it only grows
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
  std::string name = {};  ///< of the job, for the action log
};
/// Inserts a node of the film's forest, or replaces the one of the same range.
struct PutNode {
  JobId job;
  TileId tile;
  std::shared_ptr<const Node> node;
};
/// Deletes a node: it was joined with its sibling, or replaced.
struct DropNode {
  NodeKey key;
};
/// Deletes the row of a node. Its numbers may lie outside the range of a NodeKey.
struct DropNodeRow {
  JobId job;
  std::int64_t tile = 0, level = 0, index = 0;
};
/// Worker that rendered something, and the identity that this is attributed to (identity_of). Empty: unknown. The class
/// is set only for jobs that allow several classes. There, only results of one class can be compared.
struct Renderer {
  std::string worker, identity, fingerprint_class = {};
  friend auto operator<=>(const Renderer&, const Renderer&) = default;
};
/// Records the renderer of a merged result, and its hash.
struct PutResult {
  NodeKey key;
  Hash128 hash;
  Renderer by;
  bool audit_pending = false;  ///< an audit of it is pending
};
/// An audit gave the same bits as the recorded result.
struct PutAudited {
  NodeKey key;
};
/// Deletes the records of results of the key's tile whose samples lie within the key's range.
struct DropResults {
  NodeKey key;
};
/// Deletes the record of one result. Its numbers may lie outside the range of a NodeKey.
struct DropResultRow {
  JobId job;
  std::int64_t tile = 0, level = 0, index = 0;
  friend bool operator==(const DropResultRow&, const DropResultRow&) = default;
};

/// Record of a worker in quarantine. It and all others of its identity get no work.
struct QuarantineRecord {
  Renderer of;
  std::string reason;
  std::int64_t since_unix_ms = 0;
  std::string host = {};  ///< set for a worker without certificate or token; workers on this host share its quarantine
  friend bool operator==(const QuarantineRecord&, const QuarantineRecord&) = default;
};
/// Prefix of the reason when an operator, not a failed check, put the worker into quarantine.
inline constexpr std::string_view kByHand = "put there by ";
/// Inserts the record, or replaces the one of the same worker.
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

/// Inserts an entry of the action log. An existing entry of this number stays.
struct PutAction {
  Action action;
};
struct DropAction {
  std::uint64_t number = 0;
};

/// One write to the store. Its copies are compiled once, in stored_rows.cpp: those of std::variant take seconds in each
/// file.
struct StoreOp : std::variant<PutJob, PutProgress, DeleteJobRows, PutNode, DropNode, DropNodeRow, PutResult, PutAudited,
                              DropResults, DropResultRow, PutQuarantine, DropQuarantine, PutToken, DropToken, PutAction,
                              DropAction> {
  using variant::variant;
  StoreOp(const StoreOp& other);
  StoreOp(StoreOp&& other) noexcept;
  StoreOp& operator=(const StoreOp& other);
  StoreOp& operator=(StoreOp&& other) noexcept;
  ~StoreOp();
};
/// The job of each row that says that it has ended.
std::vector<JobId> ends_in(std::span<const StoreOp> writes);

/// State that a store returns when a coordinator starts.
struct StoredState {
  struct StoredNode {
    StoredNode(TileId of, NodePtr stored) : tile(of), outline(outline_of(*stored)), node(std::move(stored)) {}
    StoredNode(TileId of, const NodeOutline& stored) : tile(of), outline(stored) {}
    TileId tile;
    NodeOutline outline;
    NodePtr node;  ///< null if its values stayed in the store
  };
  struct StoredResult {
    TileId tile;
    SampleRange range;
    Hash128 hash;
    std::uint32_t by = 0;  ///< index in `renderers`
    bool audit_pending = false;
  };
  struct StoredJob {
    JobRecord record;
    std::vector<StoredNode> nodes;           ///< the forest, in any order; for an ended job perhaps only outlines
    std::vector<StoredResult> results = {};  ///< that the film was merged from, in any order
  };
  std::uint64_t epoch = 1;  ///< number of this start: one more than the last
  std::vector<StoredJob> jobs;
  std::uint64_t next_job_id = 1;      ///< never reused, even after deletes
  std::vector<NodeKey> damaged = {};  ///< stored nodes that are left out because they are damaged
  /// Rows whose renderer is lost. remove_invalid_rows adds the nodes that they were merged into to `damaged`.
  std::vector<DropResultRow> damaged_results = {};
  std::vector<JobId> damaged_jobs = {};           ///< left out, because their rows are damaged
  std::vector<std::string> damaged_entries = {};  ///< unreadable tokens and action log entries, in words
  std::vector<TokenRecord> tokens = {};
  std::vector<Action> actions = {};  ///< any order
  std::vector<Renderer> renderers = {};
  std::vector<QuarantineRecord> quarantine = {};
  Sha256 secret = {};  ///< of this store, drawn when it was created; it selects the results for audit, and signs grants
};

/// Nodes of one film, with their values.
using StoredFilm = std::vector<StoredState::StoredNode>;

}  // namespace lightmill
