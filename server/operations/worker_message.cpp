#include "server/operations/worker_message.h"

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

}  // namespace lightmill
