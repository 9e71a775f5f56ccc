#include "server/operations/worker_message.h"

#include "common/base/text.h"

namespace lightmill {

void to_wire(const WorkerStatus& worker, v1::Worker* out) {
  out->set_name(worker.name);
  out->set_host(worker.host);
  out->set_pid(worker.pid);
  out->set_threads(worker.threads);
  out->set_fingerprint_class(worker.fingerprint_class);
  out->set_draining(worker.draining);
  out->set_samples_per_second(worker.samples_per_second);
  out->set_leases(worker.leases);
  out->set_connected_seconds(worker.connected_seconds);
  out->set_results(worker.results);
  out->set_leases_lost(worker.leases_lost);
  out->set_quarantine(worker.quarantine);
  out->set_away(!worker.connected);
}

void show_worker(const FarmLoop::Turn& turn, const std::string& name, v1::Worker* out) {
  out->set_name(name);
  for (const WorkerStatus& worker : turn.farm.workers(turn.now)) {
    if (worker.name == name) {
      to_wire(worker, out);
    }
  }
}

Result<Quarantining> from_wire(const v1::QuarantineWorkerRequest& request, const Identity& caller) {
  if (!request.reason().empty()) {
    LM_RETURN_IF_ERROR(check_name("the reason", request.reason()));
  }
  return Quarantining{request.name(),
                      fmt::format("{}{}{}{}", kByHand, caller.name.empty() ? "hand" : caller.name,
                                  request.reason().empty() ? "" : ": ", request.reason()),
                      request.render_again()};
}

}  // namespace lightmill
