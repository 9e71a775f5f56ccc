#include "server/domain/dismissals.h"

namespace lightmill {
namespace {

/// Minimum time between two notes that the farm is full.
constexpr Duration kFullNotePause = std::chrono::minutes(1);

}  // namespace

void Dismissals::dismiss(SessionId session, std::string reason, const Event& event, bool for_now) {
  const std::string& name = workers_.find_session(session)->worker;
  if (!for_now) {
    event.warn(about(name), "the session of worker {} is ended: {}", name, reason);
  } else if (event.now >= next_full_note_) {  // workers retry
    next_full_note_ = event.now + kFullNotePause;
    event.warn(about(name), "worker {} is refused: {}", name, reason);
  }
  event.send_after_commit(session, Dismissal{std::move(reason), for_now});
  workers_.end_current(session);
  inspections_.left(session, false, event);
}

void Dismissals::distrust(SessionId session, LeaseId lease_id, const Status& error, const Event& event) {
  if (const Lease* const lease = leases_.find(lease_id);
      lease != nullptr && lease->worker == workers_.find_session(session)->worker) {
    life_cycle_.end_lease(lease_id, {.cancel = true, .lost = true}, event);
  }
  count_violation(session, workers_.count_bad_result(session, event.now), error, event);
}

void Dismissals::count_violation(SessionId session, std::uint32_t bad_results, const Status& error,
                                 const Event& event) {
  Worker* const worker = workers_.of(session);
  if (worker == nullptr) {
    return;
  }
  if (bad_results >= limits_.max_bad_results) {
    const std::string name = worker->name();
    dismiss(session,
            fmt::format("the worker sent {} invalid results. The last one: {}", bad_results, message_of(error)), event);
    while (!worker->leases().empty()) {
      life_cycle_.end_lease(*worker->leases().begin(), {.lost = true}, event);
    }
    workers_.forget_if_gone(name, event);
  } else {
    scheduler_.serve(*worker, event);
  }
  scheduler_.serve_all(event);
}

}  // namespace lightmill
