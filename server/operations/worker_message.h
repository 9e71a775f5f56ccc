// A worker as clients are shown it.
#pragma once

#include "lightmill/v1/farm.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "server/access/identity.h"
#include "server/domain/coordinator.h"
#include "server/runtime/farm_loop.h"

namespace lightmill {

void to_wire(const WorkerStatus& worker, v1::Worker* out);

/// The worker as it is now, or its name alone if it is gone.
void show_worker(const FarmLoop::Turn& turn, const std::string& name, v1::Worker* out);

/// A worker that is to be put into quarantine by hand.
struct Quarantining {
  std::string worker, reason;
  bool render_again = false;
};
/// With the caller's name in the reason. INVALID_ARGUMENT if the text is too long, or not one line.
Result<Quarantining> from_wire(const v1::QuarantineWorkerRequest& request, const Identity& caller);

}  // namespace lightmill
