#include "client/cli/job_report.h"

#include <nlohmann/json.hpp>
#include <numeric>

#include "client/cli/film_fetch.h"
#include "client/cli/job_json.h"
#include "client/cli/progress.h"
#include "client/cli/units.h"
#include "common/base/number_text.h"

namespace lightmill::cli {
namespace {

/// The probable remedy for a nearly black picture. Empty if it shows something.
std::string black_notice(const FilmPicture& picture, const ViewSettings& view) {
  constexpr double kBlack = 3;
  const std::vector<std::uint8_t> bytes = to_srgb8(cropped_frame(picture), view);
  const double mean = std::accumulate(bytes.begin(), bytes.end(), 0.0) / static_cast<double>(bytes.size());
  if (!(mean < kBlack)) {
    return "";
  }
  return fmt::format(
      "the picture is almost black (its mean is {:.1f} of 255). Add light (--sky on, if the scene has no environment), "
      "choose another camera (--camera; in a closed room, it must be inside), or raise --exposure",
      mean);
}

}  // namespace

static ExitCode fetch_and_report(const Console& console, CoordinatorClient& connection, std::uint64_t id,
                                 const PictureOutputs& outputs, const std::vector<std::string>& scene_notices,
                                 bool method_notices) {
  Result<AssembledFilm> film = fetch_film(connection, id);
  if (!film.ok()) {
    return console.fail(film.status());
  }
  if (film->picture.receipt.max_samples == 0 && film->job.state() != v1::JOB_STATE_DONE) {
    const bool may_get_some = !has_ended(film->job.state());
    return console.fail(
        make_error(may_get_some ? StatusCode::kUnavailable : StatusCode::kFailedPrecondition,
                   "job {} has no samples{}: it is {}{}", id, may_get_some ? " yet" : "", state_name(film->job.state()),
                   film->job.state() == v1::JOB_STATE_PAUSED ? fmt::format(". `lightmill resume {}` continues it", id)
                   : may_get_some                            ? ". Try again later"
                                                             : ""));
  }
  if (const Status status = outputs.denoise ? denoise(film->picture) : ok_status(); !status.ok()) {
    return console.fail(status);
  }
  if (const Status status = write_outputs(film->picture, outputs); !status.ok()) {
    return console.fail(status);
  }
  std::vector<std::string> notices = scene_notices;
  const std::string black = black_notice(film->picture, outputs.view);
  if (!black.empty()) {
    notices.push_back(black);
  }
  nlohmann::json object = to_json(film->job, notices);
  object["film_hash"] = film->picture.receipt.film_hash;
  object["outputs"] = outputs.paths;
  object["denoised"] = outputs.denoise;
  if (!film->meters.empty()) {
    object["meters"] = to_json(film->meters);
  }
  console.object(object);
  const std::string error = error_text(film->job);
  const v1::Goal& goal = film->job.goal();
  const bool tell_limit = film->job.state() == v1::JOB_STATE_DONE && (goal.seconds() > 0 || goal.error() > 0);
  const std::string samples =
      samples_per_pixel(film->picture.receipt.min_samples, film->picture.receipt.max_samples) + " per pixel";
  const std::string reached = tell_limit ? film->job.reason() : "";
  console.result(fmt::format("job {} {}: {}{}, {} of rendering{}", id, state_name(film->job.state()),
                             reached.ends_with(samples) ? reached
                             : reached.empty()          ? samples
                                                        : reached + "; " + samples,
                             error.empty() ? "" : ", error " + error, human_seconds(film->job.active_seconds()),
                             outputs.paths.empty() ? "" : fmt::format(" -> {}", fmt::join(outputs.paths, ", "))));
  if (!black.empty()) {
    console.result("note: " + black);
  }
  if (outputs.denoise && !outputs.paths.empty()) {
    console.result("note: the error is that of the raw picture. That of the denoised one is not known");
  }
  if (method_notices) {
    for (const std::string& notice : film->job.method_notes().notices()) {
      console.result("note: " + notice);
    }
  }
  if (film->job.counters().results_audited() > 0 || film->job.counters().nodes_dropped() > 0) {
    console.result(audits_text(film->job));
  }
  for (const NamedReading& reading : film->meters) {
    console.result(fmt::format("meter {}: {}", reading.meter.name, reading_text(reading)));
  }
  if (!film->meters.empty()) {
    console.result(fmt::format("meters: {}", kReadingConfidence));
  }
  return kDone;
}

ExitCode fetch_and_report(const Console& console, CoordinatorClient& connection, std::uint64_t id,
                          const PictureOutputs& outputs) {
  return fetch_and_report(console, connection, id, outputs, {}, true);
}

ExitCode report_ended_job(const Console& console, CoordinatorClient& connection, const v1::Job& job,
                          const PictureOutputs& outputs, const std::vector<std::string>& scene_notices) {
  if (job.state() == v1::JOB_STATE_DONE) {
    return fetch_and_report(console, connection, job.id(), outputs, scene_notices, false);
  }
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    return console.fail(make_error(StatusCode::kAborted, "job {} was cancelled", job.id()),
                        to_json(job, scene_notices));
  }
  return console.fail(make_error(StatusCode::kAborted, "job {} failed: {}", job.id(), job.reason()),
                      to_json(job, scene_notices));
}

std::string reading_text(const NamedReading& reading) {
  const MeterReading& r = reading.reading;
  if (r.samples == 0) {
    return "no samples yet";
  }
  return fmt::format("{} {}, {} {}", interval_text(r.value, r.half_width), radiometric_unit(reading.meter),
                     interval_text(r.photometric, r.photometric_width), photometric_unit(reading.meter));
}

}  // namespace lightmill::cli
