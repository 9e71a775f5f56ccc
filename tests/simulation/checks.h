// Checks of a coordinator's decisions, writes and messages, during the run.
//
// Owns the sets of acknowledged nodes, of renderers of merged results, and of sent leases. farm_simulation.h lists what
// must hold.
#pragma once

#include "tests/simulation/loss_checks.h"
#include "tests/simulation/refusal_checks.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/time_checks.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

class Checks {
 public:
  Checks(World& world, ServerSide& server, const WorkerSide& workers, const ClientSide& clients)
      : world_(world),
        server_(server),
        workers_(workers),
        refusals_(world, server, workers),
        losses_(world, server, workers),
        times_(world, server, clients) {}

  /// A coordinator starts with this state.
  void server_starts(const StoredState& stored);
  void hello_came(const std::shared_ptr<Stream>& stream, const WorkerHello& hello);
  void result_came(const Stream& stream, const WorkerResult& result);
  void refusal_came(const Stream& stream, const WorkerRefusal& refusal) { refusals_.refusal_came(stream, refusal); }
  void stored(std::span<const StoreOp> ops);
  /// Call it before any of the effects is sent.
  void check_effects(const Effects& effects);
  /// Call it after the messages that need no commit were sent.
  void check_losses(const Effects& effects) { losses_.check_sent(effects); }
  /// A message is sent.
  void check_sent(const std::shared_ptr<Stream>& stream, const Outgoing& message);
  void check_acknowledged_is_durable();
  /// Each end that clients can see is stored.
  void check_shown_ends();

 private:
  void check_decisions(const Effects& effects);
  /// Whether the worker of the session may audit this result: another machine rendered it.
  bool may_verify(SessionId session, const NodeKey& key) const;
  void note_writes(const Effects& effects);
  void note_grants(const Effects& effects);
  /// A lease is sent now. If its job has lost its class since the grant, its results are dropped.
  void check_grant(const Stream& stream, const LeaseGrant& grant);
  void note_unwanted(const Effects& effects);
  void check_ack(const Stream& stream, const ResultAck& ack);

  World& world_;
  ServerSide& server_;
  const WorkerSide& workers_;
  RefusalChecks refusals_;
  LossChecks losses_;
  TimeChecks times_;
  std::map<std::pair<SessionId, NodeKey>, Sha256> last_result_;  ///< render digests of arrived results
  std::set<NodeKey> acknowledged_;                               ///< with the right digest
  /// Results that were unwanted when they arrived. Their acknowledgement promises nothing.
  std::multiset<std::pair<SessionId, NodeKey>> unwanted_;
  std::map<JobId, std::uint64_t> unbound_;             ///< how often each job lost its class
  std::map<LeaseId, std::uint64_t> unbound_then_;      ///< the same for a lease's job when it was granted
  std::map<NodeKey, Renderer> merged_by_;              ///< as the coordinator reports
  std::vector<NodeKey> dropped_;                       ///< that the coordinator dropped from films
  std::set<std::pair<std::string, NodeKey>> granted_;  ///< all grants of each worker, by name
  std::map<std::string, std::size_t> brought_;         ///< count of leases in a worker's last hello
};

}  // namespace lightmill::simulation
