// Handing a prepared job to a farm: the assets it lacks, then the job.
#pragma once

#include "client/cli/console.h"
#include "client/cli/farm_connection.h"
#include "client/cli/render_options.h"

namespace lightmill::cli {

/// Uploads what is missing, saying how far it is, and submits. The job is stored when this returns.
Result<v1::Job> submit_job(FarmConnection& connection, const PreparedJob& job, const Console& console);

}  // namespace lightmill::cli
