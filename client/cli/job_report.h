// Report and pictures of a job that was fetched or has ended.
#pragma once

#include <string>
#include <vector>

#include "client/cli/console.h"
#include "client/cli/coordinator_client.h"
#include "client/cli/film_fetch.h"
#include "common/wire/film_assembly.h"

namespace lightmill::cli {

/// Fetches the film as it is now, writes it to `outputs` and reports this, with the method's notices.
ExitCode fetch_and_report(const Console& console, CoordinatorClient& connection, std::uint64_t id,
                          const PictureOutputs& outputs);

/// The same for a done job, after a ProgressPrinter has printed the method's notices. With --json the report includes
/// the scene's notices. For a failed or cancelled job, reports the reason and returns kJobFailed.
ExitCode report_ended_job(const Console& console, CoordinatorClient& connection, const v1::Job& job,
                          const PictureOutputs& outputs, const std::vector<std::string>& scene_notices = {});

/// A line below readings.
inline constexpr std::string_view kReadingConfidence = "each ± has 95% confidence";
/// "0.1807 ± 0.0003 W/m², 123.4 ± 0.2 lx".
std::string reading_text(const NamedReading& reading);

}  // namespace lightmill::cli
