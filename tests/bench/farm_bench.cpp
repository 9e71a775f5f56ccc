// Cost of the farm over the bare renderer, and time to the first picture of a watching client.
//
// A real coordinator and worker on loopback render a job for a real client process. Then this process renders the same
// samples on the same number of threads. The result is the ratio of CPU time. The farm's is that of all three programs, from
// submission until the client has the film in memory. It includes the client's start, but not the writing of files.
// Pairs alternate and the median counts, because the machine may be busy.
#include <sys/resource.h>
#include <sys/wait.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/cli/child_process.h"
#include "client/cli/console.h"
#include "client/cli/coordinator_client.h"
#include "client/cli/film_fetch.h"
#include "client/cli/submission.h"
#include "common/base/check.h"
#include "common/base/file.h"
#include "tests/bench/measure.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using Seconds = std::chrono::duration<double>;

struct Options {
  std::string scene = test::source_file("scenes/cornell-bench-blocks.json");
  std::uint32_t level = 8;
  int size = 512, pairs = 10, first_pictures = 20, threads = 2;
  std::string client_of;  ///< run as the client of this coordinator
  std::uint64_t seed = 0;
  bool first_picture = false;
};

double cpu_seconds_of(pid_t pid) {
  clockid_t clock;
  LM_CHECK(clock_getcpuclockid(pid, &clock) == 0);
  return seconds_of(clock);
}

template <class T>
T value_of(Result<T> result) {
  LM_CHECK(result.ok(), "{}", message_of(result.status()));
  return std::move(*result);
}

/// The client's part, in its own process. Prints the seconds from submission to the first complete picture, if asked
/// to.
int run_client(const Options& options) {
  cli::RenderOptions render;
  render.scene.scenes = {options.scene};
  render.size = fmt::format("{0}x{0}", options.size);
  render.spec.goal.samples = std::uint64_t{1} << options.level;
  render.spec.settings.seed = options.seed;
  cli::Signals signals;
  const cli::PreparedJob prepared = value_of(cli::make_job(render, signals));
  cli::CoordinatorClient farm(options.client_of);
  const cli::Console console(true);
  const auto start = std::chrono::steady_clock::now();
  const v1::Job job = value_of(cli::submit_job(farm, prepared, console));
  if (options.first_picture) {
    std::int64_t missing = std::int64_t{options.size} * options.size;
    std::set<std::pair<int, int>> seen;
    bool stop = false;
    (void)farm.watch(
        job.id(), true, [&] { return stop; },
        [&](const v1::WatchJobResponse& update) {
          for (const v1::PreviewTile& tile : update.tiles()) {
            if (tile.samples() > 0 && seen.insert({tile.rect().x(), tile.rect().y()}).second) {
              missing -= std::int64_t{tile.rect().width()} * tile.rect().height();
            }
          }
          if (missing == 0 && !stop) {
            fmt::print("{}\n", Seconds(std::chrono::steady_clock::now() - start).count());
            stop = true;
            farm.cancel_calls();
          }
        });
    (void)value_of(farm.cancel_job(job.id()));
    return missing == 0 ? 0 : 1;
  }
  bool done = false;
  const Status watched = farm.watch(
      job.id(), false, [] { return false; },
      [&](const v1::WatchJobResponse& update) { done = update.job().state() == v1::JOB_STATE_DONE; });
  LM_CHECK(watched.ok() && done, "the job did not end as done");
  const AssembledFilm film = value_of(cli::fetch_film(farm, job.id()));
  return film.picture.pixels() == static_cast<std::size_t>(options.size) * options.size ? 0 : 1;
}

test::CommandResult start_client(const Options& options, const std::string& address, std::uint64_t seed,
                                 bool first_picture) {
  std::vector<std::string> arguments{(own_folder() / "farm_bench").string(),
                                     options.scene,
                                     "--client-of",
                                     address,
                                     "--seed",
                                     std::to_string(seed),
                                     "--level",
                                     std::to_string(options.level),
                                     "--size",
                                     std::to_string(options.size)};
  if (first_picture) {
    arguments.push_back("--first-picture");
  }
  const test::CommandResult result = test::run_command(arguments, {}, std::chrono::seconds(600));
  LM_CHECK(result.exit_code == 0, "the client failed: {}", result.err);
  return result;
}

double bare_cpu_seconds(const Options& options, std::shared_ptr<const CompiledScene> scene, std::uint64_t seed) {
  const auto method = value_of(make_method(scene, {"path", seed, 0}));
  const TileGrid grid({0, 0, options.size, options.size});
  std::atomic<std::uint32_t> next{0};
  const double start = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  std::vector<std::jthread> threads;
  for (int i = 0; i < options.threads; ++i) {
    threads.emplace_back([&] {
      const auto workspace = method->make_workspace();
      for (std::uint32_t tile = next++; tile < grid.tile_count(); tile = next++) {
        method->render(grid.tile_rect({tile}), {options.level, 0}, *workspace);
      }
    });
  }
  threads.clear();
  return seconds_of(CLOCK_PROCESS_CPUTIME_ID) - start;
}

double children_cpu_seconds() {
  rusage usage;
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

int run_bench(const Options& options) {
  test::Farm farm;
  auto& worker = farm.add_worker(options.threads, "w1");
  start_client(options, farm.address(), 999, true);  // loads the scene once

  std::vector<double> first;
  for (int i = 0; i < options.first_pictures; ++i) {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(300));  // the cancelled job's last tiles, then the farm is idle
    first.push_back(std::stod(start_client(options, farm.address(), 2000 + i, true).out));
  }
  if (!first.empty()) {
    std::printf("first picture of %dx%d at the client: median %.3f s (%.3f to %.3f) of %zu\n", options.size,
                options.size, median(first), *std::min_element(first.begin(), first.end()),
                *std::max_element(first.begin(), first.end()), first.size());
    std::fflush(stdout);
  }

  const auto loaded = test::TestScene(options.scene).resized(options.size, options.size);
  const auto compiled = value_of(CompiledScene::compile(loaded.scene(), loaded.assets()));
  std::vector<double> ratios;
  for (int pair = 0; pair < options.pairs; ++pair) {
    const double server_before = cpu_seconds_of(farm.server().pid()), worker_before = cpu_seconds_of(worker.pid());
    const double client_before = children_cpu_seconds();
    start_client(options, farm.address(), 1 + pair, false);
    const double server_cpu = cpu_seconds_of(farm.server().pid()) - server_before;
    const double worker_cpu = cpu_seconds_of(worker.pid()) - worker_before;
    const double client_cpu = children_cpu_seconds() - client_before;
    const double bare = bare_cpu_seconds(options, compiled, 1 + pair);
    ratios.push_back((server_cpu + worker_cpu + client_cpu) / bare);
    std::printf("farm %.2f s (server %.3f, worker %.2f, client %.3f), bare renderer %.2f s: ratio %.4f\n",
                server_cpu + worker_cpu + client_cpu, server_cpu, worker_cpu, client_cpu, bare, ratios.back());
    std::fflush(stdout);
  }
  std::printf("median ratio of %zu pairs: %.4f (%.4f to %.4f)\n", ratios.size(), median(ratios),
              *std::min_element(ratios.begin(), ratios.end()), *std::max_element(ratios.begin(), ratios.end()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("CPU time of the farm over the bare renderer, and the time to the first picture.");
  Options options;
  app.add_option("scene", options.scene, "scene document")->capture_default_str();
  app.add_option("--level", options.level, "log2 of the samples per pixel")
      ->capture_default_str()
      ->check(CLI::Range(0, 16));
  app.add_option("--size", options.size, "film width and height in pixels")
      ->capture_default_str()
      ->check(CLI::Range(8, 8192));
  app.add_option("--pairs", options.pairs, "runs of farm and bare renderer in turn")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_option("--first-pictures", options.first_pictures, "jobs whose first picture is timed")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000));
  app.add_option("--threads", options.threads, "threads of the worker and of the bare renderer")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  app.add_option("--client-of", options.client_of,
                 "run as the client of this coordinator (the bench itself uses this)");
  app.add_option("--seed", options.seed, "with --client-of");
  app.add_flag("--first-picture", options.first_picture, "with --client-of");
  CLI11_PARSE(app, argc, argv);
  return options.client_of.empty() ? run_bench(options) : run_client(options);
}
