// A worker with wrong results, for tests: SERVER NAME MACHINE SHARE-OF-NODES [CLASS]. It is honest with a share of 0.
// With another fingerprint class it is honest within that class.
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <iostream>

#include "common/base/log.h"
#include "common/base/signals.h"
#include "common/farm/job.h"
#include "worker/render/worker_class.h"
#include "worker/shell/worker_loop.h"

namespace lightmill {
namespace {

/// Changes the same nodes in the same way every time.
void lie_about(Node& node, double share) {
  if (static_cast<double>(hash_of(node).low >> 11) < std::ldexp(share, 53)) {
    float& value = node.values[node.values.size() / 2];
    value = std::nextafter(value, 1e30f);
  }
}

int run(int argc, char** argv) {
  if (argc != 5 && argc != 6) {
    std::cerr << "lying_worker SERVER NAME MACHINE SHARE-OF-NODES [CLASS]\n";
    return 2;
  }
  (void)start_logging("lying_worker", "debug", "text");
  const double share = std::strtod(argv[4], nullptr);
  WorkerOptions options;
  options.farm.servers = {argv[1]};
  options.session.name = argv[2];
  options.session.host = argv[3];
  options.session.machine = argv[3];
  options.session.pid = static_cast<std::uint32_t>(::getpid());
  options.session.fingerprint_class = argc == 6 ? argv[5] : worker_class(options.decoder.program);
  options.session.renderer_version = kRendererVersion;
  if (share > 0) {
    options.tamper = [share](Node& node) { lie_about(node, share); };
  }
  WorkerLoop loop(options, system_clock());
  const StopSignals signals([&loop](int) { loop.drain(); });
  const Status status = loop.run();
  return status.ok() ? 0 : 1;
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  return lightmill::run(argc, argv);
}
