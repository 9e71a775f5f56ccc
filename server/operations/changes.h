// Text of what a call changed, for the action log (Action::change). Empty: nothing.
#pragma once

#include <string>

#include "server/domain/coordinator.h"

namespace lightmill {

/// The values of a job that differ: "state done -> running, samples 64 -> 128". `after` is null for a deleted job.
std::string describe_change(const JobStatus& before, const JobStatus* after);

/// The values of a worker that differ: "quarantine none -> 'put there by ada: noise'".
std::string describe_change(const WorkerStatus& before, const WorkerStatus& after);

}  // namespace lightmill
