// lightmill show JOB
#include <nlohmann/json.hpp>
#include <utility>

#include "client/chart/chart.h"
#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/film_fetch.h"
#include "client/cli/job_json.h"
#include "client/cli/job_report.h"
#include "client/cli/progress.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/file.h"
#include "common/base/number_text.h"
#include "common/scene_io/load.h"

namespace lightmill::cli {
namespace {

std::string goal_text(const v1::Goal& goal) {
  std::string text = goal.samples() > 0 ? counted(goal.samples(), "sample") + " per pixel" : "";
  if (goal.seconds() > 0) {
    text += (text.empty() ? "" : ", or ") + human_seconds(goal.seconds()) + " of rendering time";
  }
  if (goal.error() > 0) {
    text += (text.empty() ? "" : ", or ") + fmt::format("error (relMSE) {:g}", goal.error());
  }
  if (goal.adaptive()) {
    text += ", adaptive";
  }
  return text;
}

std::vector<std::string> layer_names(const FilmPicture& picture) {
  std::vector<std::string> names;
  for (const PictureLayer& layer : picture.layers) {
    names.push_back(layer.name);
  }
  return names;
}

/// "ada on lab-7". Jobs by HTTP have no host, and without authentication no owner.
std::string owner_text(const v1::Job& job) {
  const std::string owner = job.owner().empty() ? "unknown" : job.owner();
  return job.host().empty() ? owner : fmt::format("{} on {}", owner, job.host());
}

/// `film`: null if it cannot be read. `verbose`: with rows that only help to find a problem.
std::vector<std::vector<std::string>> describe(const v1::Job& job, const AssembledFilm* film, bool verbose) {
  const v1::JobCounters& counters = job.counters();
  const v1::PixelRect& crop = job.crop();
  const bool says_more = !job.reason().empty() && job.reason() != state_name(job.state());
  const bool cropped = crop.width() != job.width() || crop.height() != job.height();
  std::vector<std::vector<std::string>> rows{
      {"job", fmt::format("{}  {}", job.id(), job.name())},
      {"state", state_name(job.state()) + (says_more ? ": " + job.reason() : "")},
      {"owner", owner_text(job)},
      {"submitted", human_date(job.submitted_unix_ms())},
      {"picture",
       fmt::format(
           "{}x{}{}", job.width(), job.height(),
           cropped ? fmt::format(", crop {}x{} at {},{}", crop.width(), crop.height(), crop.x(), crop.y()) : "")},
      {"method", fmt::format("{}{}, seed {}", method_name(job), how_chosen(job), job.seed())},
      {"goal", goal_text(job.goal())},
      {"priority", std::to_string(job.priority())},
      {"samples",
       fmt::format("{} per pixel, {} samples in all", range_text(job.min_tile_samples(), job.max_tile_samples()),
                   human_count(static_cast<double>(job.samples_done())))},
      {"rendering", human_seconds(job.active_seconds())},
      {"thread time", human_seconds(job.worker_seconds()) + " over all threads"},
      {"audits", audits_text(job)},
      {"film hash", film == nullptr ? "unknown, because the film cannot be read"
                                    : film->picture.receipt.film_hash +
                                          (film->picture.layers.empty() ? "" : " (of picture and layers)")},
  };
  if (job.has_error()) {
    rows.push_back({"error", fmt::format("{} (relMSE {}, 95% confidence)", error_text(job),
                                         interval_text(job.error().rel_mse(), job.error().half_width()))});
  }
  if (job.allow_mixed()) {
    rows.push_back({"class", mixed_text(job)});
  }
  if (film != nullptr && !film->picture.layers.empty()) {
    rows.push_back({"layers", fmt::format("{}", fmt::join(layer_names(film->picture), ", "))});
  }
  std::string head = job.method_notes().candidates().empty() ? "chosen" : "candidates";
  for (const std::string& reason : job.method_notes().reasons()) {
    rows.push_back({std::exchange(head, ""), reason});
  }
  for (const std::string& notice : job.method_notes().notices()) {
    rows.push_back({"note", notice});
  }
  if (film != nullptr && !film->meters.empty()) {
    for (const NamedReading& reading : film->meters) {
      rows.push_back({"meter", fmt::format("{}: {}", reading.meter.name, reading_text(reading))});
    }
    rows.push_back({"", std::string(kReadingConfidence)});
  }
  if (counters.non_finite() > 0) {
    rows.push_back({"non-finite", fmt::format("{} samples counted as zero", counters.non_finite())});
  }
  if (verbose) {
    const std::string digest = film == nullptr ? "" : film->picture.receipt.render_digest;
    rows.push_back({"results", fmt::format("{} merged, {} repeated, {} leases lost", counters.results_merged(),
                                           counters.results_duplicate(), counters.leases_lost())});
    rows.push_back({"render digest", digest.empty() ? "none yet" : digest});
    rows.push_back({"trace id", trace_text(job)});
  }
  return rows;
}

struct ShowOptions {
  std::uint64_t job = 0;
  std::string chart;
  bool verbose = false;
};

/// Its error against time. Each point is an estimate with its confidence interval.
Chart job_chart(const v1::Job& job) {
  Chart chart;
  chart.title = fmt::format("job {}: {}", job.id(), job.name());
  chart.x_label = "thread seconds";
  chart.y_label = "estimated relMSE (bars: 95% confidence)";
  ChartSeries series{fmt::format("{}, {}x{}, seed {}", job.method(), job.width(), job.height(), job.seed()), {}};
  for (const v1::ErrorPoint& point : job.history()) {
    const double error = point.error().rel_mse(), half_width = point.error().half_width();
    series.points.push_back({point.worker_seconds(), error, error - half_width, error + half_width,
                             fmt::format("{:.6g} samples per pixel, {} of thread time, {}", point.samples(),
                                         human_seconds(point.worker_seconds()), interval_text(error, half_width))});
  }
  chart.series.push_back(std::move(series));
  chart.guides = {{-1, "slope −1"}};
  if (job.goal().error() > 0) {
    chart.levels = {{job.goal().error(), "goal"}};
  }
  return chart;
}

Status show_job(CoordinatorClient& connection, const Console& console, const ShowOptions& options) {
  if (!options.chart.empty()) {
    LM_RETURN_IF_ERROR(check_output(options.chart));
  }
  const Result<AssembledFilm> read = fetch_film(connection, options.job);
  if (!read.ok()) {
    const Result<v1::Job> job = connection.get_job(options.job);
    if (job.ok() && !console.json()) {
      print_table(console, describe(*job, nullptr, options.verbose));
    }
    return read.status();
  }
  const AssembledFilm& film = *read;
  if (!options.chart.empty()) {
    LM_RETURN_IF_ERROR(
        as_output_error(write_file_atomically(options.chart, as_byte_view(chart_file(job_chart(film.job))))));
    console.notice(fmt::format("the chart is written to {}", options.chart));
    if (film.job.history().empty()) {
      console.notice("the chart has no points yet: a job's error is estimated from 16 samples per pixel on");
    }
  }
  nlohmann::json object = to_json(film.job);
  object["film_hash"] = film.picture.receipt.film_hash;
  object["layers"] = layer_names(film.picture);
  object["meters"] = to_json(film.meters);
  console.object(object);
  print_table(console, describe(film.job, &film, options.verbose));
  return ok_status();
}

}  // namespace

void add_show_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<ShowOptions>();
  CLI::App* command = app.add_subcommand("show", "Show a job in detail, with the hash of its film.");
  add_job_number(*command, options->job);
  command->add_option("--chart", options->chart, "write a chart of its error as SVG")
      ->type_name("FILE.svg")
      ->check(CLI::Validator(
          [](std::string& file) {
            return lower_ending(file) == ".svg" ? std::string()
                                                : fmt::format("a file that ends in .svg is expected, got '{}'", file);
          },
          ""));
  command->add_flag("--verbose", options->verbose, "also show counts of results, the render digest, and the trace id");
  add_common_options(*command, context);
  ask_farm(*command, context, [options](CoordinatorClient& connection, const Console& console) {
    return show_job(connection, console, *options);
  });
}

}  // namespace lightmill::cli
