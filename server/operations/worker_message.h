// Message of a worker for clients.
#pragma once

#include "lightmill/v1/farm.pb.h"
#include "server/domain/coordinator.h"

namespace lightmill {

void to_wire(const WorkerStatus& worker, v1::Worker* out);

}  // namespace lightmill
