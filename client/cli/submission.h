// Submission of a prepared job: first the missing assets, then the job.
#pragma once

#include "client/cli/console.h"
#include "client/cli/coordinator_client.h"
#include "client/cli/render_options.h"

namespace lightmill::cli {

/// Uploads what is missing with progress, and submits. The job is stored when this returns.
Result<v1::Job> submit_job(CoordinatorClient& connection, const PreparedJob& job, const Console& console);

}  // namespace lightmill::cli
