// What is said and written once a job has been fetched or has ended.
#pragma once

#include <string>
#include <vector>

#include "client/cli/console.h"
#include "client/cli/farm_connection.h"
#include "common/image/color.h"

namespace lightmill::cli {

/// Fetches the film as it stands, writes it to `outputs` and says so; with --json also what there was to say of the
/// scene.
ExitCode fetch_and_report(const Console& console, FarmConnection& connection, std::uint64_t id,
                          const std::vector<std::string>& outputs, const ViewSettings& view,
                          const std::vector<std::string>& scene_notices = {});

/// For a job that has ended: as above if it is done, else (1) why not.
ExitCode report_ended_job(const Console& console, FarmConnection& connection, const v1::Job& job,
                          const std::vector<std::string>& outputs, const ViewSettings& view,
                          const std::vector<std::string>& scene_notices = {});

}  // namespace lightmill::cli
