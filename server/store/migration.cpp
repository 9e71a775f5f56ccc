#include "server/store/migration.h"

namespace lightmill {
namespace {

constexpr std::size_t kBytesAtOnce = std::size_t{64} << 20;
constexpr std::size_t kBytesOfAWrite = 256;  ///< rough size of a write without a node

/// Collects writes and commits them in batches.
class Pieces {
 public:
  explicit Pieces(Store& store) : store_(store) {}
  Status add(StoreOp op, std::size_t size_bytes = kBytesOfAWrite) {
    ops_.push_back(std::move(op));
    size_bytes_ += size_bytes;
    return size_bytes_ < kBytesAtOnce ? ok_status() : commit();
  }
  Status commit() {
    size_bytes_ = 0;
    const std::vector<StoreOp> ops = std::exchange(ops_, {});
    return ops.empty() ? ok_status() : store_.commit(ops);
  }

 private:
  Store& store_;
  std::vector<StoreOp> ops_;
  std::size_t size_bytes_ = 0;
};

Status write_job(const StoredState& state, const StoredState::StoredJob& job, Pieces& pieces) {
  const JobId id = job.record.id;
  LM_RETURN_IF_ERROR(pieces.add(PutJob{job.record}, job.record.spec.settings.scene->size() + kBytesOfAWrite));
  for (const StoredState::StoredNode& node : job.nodes) {
    LM_RETURN_IF_ERROR(pieces.add(PutNode{id, node.tile, node.node}, node.node->values.size() * sizeof(float)));
  }
  for (const StoredState::StoredResult& result : job.results) {
    const NodeKey key{id, result.tile, result.range};
    LM_RETURN_IF_ERROR(pieces.add(PutResult{key, result.hash, state.renderers.at(result.by), result.audit_pending}));
  }
  return ok_status();
}

}  // namespace

Status check_store_format(std::string_view place, std::int64_t found, std::int64_t known, std::string_view elsewhere) {
  if (found == known) {
    return ok_status();
  }
  if (found < 1) {
    return failed_precondition(
        "{} has store format {}, which no lightmill-server writes: restore a backup, or choose {}", place, found,
        elsewhere);
  }
  const std::string_view age = found > known ? "newer" : "older";
  return failed_precondition(
      "{} has store format {}, {} than format {} of this lightmill-server: use the {} lightmill-server that wrote it, "
      "or choose {}",
      place, found, age, known, age, elsewhere);
}

Status write_state(const StoredState& state, Store& store) {
  Pieces pieces(store);
  for (const StoredState::StoredJob& job : state.jobs) {
    LM_RETURN_IF_ERROR(write_job(state, job, pieces));
  }
  for (const TokenRecord& token : state.tokens) {
    LM_RETURN_IF_ERROR(pieces.add(PutToken{token}));
  }
  for (const Action& action : state.actions) {
    LM_RETURN_IF_ERROR(pieces.add(PutAction{action}));
  }
  for (const QuarantineRecord& record : state.quarantine) {
    LM_RETURN_IF_ERROR(pieces.add(PutQuarantine{record}));
  }
  return pieces.commit();
}

}  // namespace lightmill
