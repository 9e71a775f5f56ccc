// Limits of one coordinator: thousands of simulated workers over real gRPC, and the cost of merging and committing
// their results.
#include <sched.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <future>

#include "common/base/check.h"
#include "common/base/machine_memory.h"
#include "common/base/mutex.h"
#include "common/base/number_text.h"
#include "common/film/tile_grid.h"
#include "tests/bench/cpu_share.h"
#include "tests/bench/swarm/swarm.h"
#include "tests/support/farm.h"

namespace {

using namespace lightmill;
using SteadyClock = std::chrono::steady_clock;

struct Options {
  std::vector<std::uint32_t> workers{100, 1000};
  std::uint32_t threads = 1;
  double speed = 20'000, spread = 1;
  int side = 512, jobs = 1;
  std::uint64_t samples = std::uint64_t{1} << 22;
  double warm_seconds = 10, seconds = 20;
  int viewers = 0, server_core = -1;
  std::string log_level = "warn";
  std::vector<std::string> server_options;
};

double seconds_since(SteadyClock::time_point begin) {
  return std::chrono::duration<double>(SteadyClock::now() - begin).count();
}

/// A field of /proc/PID/status, in KiB.
std::uint64_t status_kib(pid_t pid, const std::string& field) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(field + ":")) {
      return std::stoull(line.substr(field.size() + 1));
    }
  }
  LM_CHECK(false, "process {} has no {}", pid, field);
  return 0;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) {
    return std::nan("");
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// A client that watches a square picture with its tiles, and reads everything.
class Viewer {
 public:
  Viewer(const std::string& address, std::uint64_t job, int side)
      : columns_(static_cast<std::size_t>((side + kTileSize - 1) / kTileSize)),
        current_(columns_ * columns_, SteadyClock::now()),
        client_(address),
        thread_([this, job] {
          v1::WatchJobRequest request;
          request.set_id(job);
          request.set_tiles(true);
          const auto stream = client_.stub().WatchJob(&context_, request);
          for (v1::WatchJobResponse response; stream->Read(&response);) {
            take(response);
          }
          stream->Finish();
        }) {}
  ~Viewer() {
    context_.TryCancel();
    thread_.join();
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  /// Number of tiles received.
  std::uint64_t tiles() const {
    const MutexLock lock(mutex_);
    return tiles_;
  }
  /// Appends, for each tile, the seconds since it was last known to match the coordinator's.
  void add_ages(std::vector<double>& ages) const {
    const MutexLock lock(mutex_);
    std::ranges::transform(current_, std::back_inserter(ages), seconds_since);
  }

 private:
  void take(const v1::WatchJobResponse& response) {
    const auto now = SteadyClock::now();
    const int count = response.tiles_size();
    const MutexLock lock(mutex_);
    tiles_ += static_cast<std::uint64_t>(count);
    most_ = std::max(most_, count);
    if (count < most_) {  // the message had room for more, so no other tile has changed
      std::ranges::fill(current_, now);
    }
    for (const v1::PreviewTile& tile : response.tiles()) {
      const auto column = static_cast<std::size_t>(tile.rect().x() / kTileSize);
      current_.at(static_cast<std::size_t>(tile.rect().y() / kTileSize) * columns_ + column) = now;
    }
  }

  const std::size_t columns_;
  mutable Mutex mutex_;
  std::uint64_t tiles_ LM_GUARDED_BY(mutex_) = 0;
  int most_ LM_GUARDED_BY(mutex_) = 0;  ///< tiles in one message
  std::vector<SteadyClock::time_point> current_ LM_GUARDED_BY(mutex_);
  test::FarmClient client_;
  grpc::ClientContext context_;
  std::thread thread_;
};

using Viewers = std::vector<std::unique_ptr<Viewer>>;

std::uint64_t tiles_seen(const Viewers& viewers) {
  std::uint64_t sum = 0;
  for (const auto& viewer : viewers) {
    sum += viewer->tiles();
  }
  return sum;
}

/// Waits this many seconds. Returns the ages of the viewers' tiles in that time.
std::vector<double> let_pass(double seconds, const Viewers& viewers) {
  constexpr int kGlances = 20;
  std::vector<double> ages;
  for (int i = 0; i < kGlances; ++i) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds / kGlances));
    for (const auto& viewer : viewers) {
      viewer->add_ages(ages);
    }
  }
  return ages;
}

/// Measures one farm with this many workers: a row of the table.
std::string measure(const Options& options, std::uint32_t workers) {
  std::vector<std::string> server_options{"--max-workers", "20000", "--films-gib", "16",
                                          "--film-gib",    "8",     "--log-level", options.log_level};
  server_options.insert(server_options.end(), options.server_options.begin(), options.server_options.end());
  test::Launch launch{"127.0.0.1", {}, {}};
  if (options.server_core >= 0) {
    launch.before = {"/usr/bin/taskset", "--cpu-list", std::to_string(options.server_core)};
  }
  test::Farm farm(server_options, launch);
  test::FarmClient client = farm.client();
  client.upload_assets();
  test::Picture picture;
  picture.side = options.side;
  picture.samples = options.samples;
  for (int i = 1; i < options.jobs; ++i) {
    client.submit(picture, fmt::format("job-{}", i));
  }

  const auto begun = SteadyClock::now();
  bench::Swarm swarm({farm.address(), workers, options.threads, options.speed, options.spread});
  LM_CHECK(test::eventually([&] { return swarm.counts().connected == workers; }, std::chrono::seconds(120)),
           "only {} of {} workers are connected after two minutes", swarm.counts().connected, workers);
  const double connecting = seconds_since(begun);

  const auto submitted = SteadyClock::now();
  const std::uint64_t job = client.submit(picture, "last").id();
  LM_CHECK(test::eventually([&] { return client.job(job).min_tile_samples() > 0; }, std::chrono::seconds(300)),
           "no picture after five minutes");
  const double first_picture = seconds_since(submitted);

  Viewers viewers;
  for (int i = 0; i < options.viewers; ++i) {
    viewers.push_back(std::make_unique<Viewer>(farm.address(), job, options.side));
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(options.warm_seconds));
  swarm.take_latencies();
  const bench::SwarmCounts before = swarm.counts();
  const std::uint64_t seen_before = tiles_seen(viewers);
  const pid_t pid = farm.server().pid();
  const double cpu = process_cpu_seconds(pid), own_cpu = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  const auto measured = SteadyClock::now();
  const std::vector<double> ages = let_pass(options.seconds, viewers);
  const double passed = seconds_since(measured);
  const double seen = static_cast<double>(tiles_seen(viewers) - seen_before) / passed;
  const bench::SwarmCounts after = swarm.counts();
  const double cores = (process_cpu_seconds(pid) - cpu) / passed;
  const double own_cores = (seconds_of(CLOCK_PROCESS_CPUTIME_ID) - own_cpu) / passed;
  const bench::SwarmLatencies latencies = swarm.take_latencies();
  const double results = static_cast<double>(after.acknowledged - before.acknowledged) / passed;
  const double bytes = static_cast<double>(after.result_bytes - before.result_bytes) / passed;
  const double busy = (after.busy_seconds - before.busy_seconds) / (passed * workers * options.threads);
  const std::string view = viewers.empty() ? " | "
                                           : fmt::format("{:.1f} | {:.2f}, {:.2f}", seen / options.viewers,
                                                         percentile(ages, 0.5), percentile(ages, 0.99));
  LM_CHECK(after.connected == workers && after.disconnects == 0, "{} of {} workers are connected, and {} were lost",
           after.connected, workers, counted(after.disconnects, "connection"));
  return fmt::format(
      "| {} | {:.0f} | {:.1f} | {:.2f} | {:.2f} | {} | {:.0f}, {:.0f} | {:.0f}, {:.0f} | {:.2f} | {:.0f} % | {:.1f} | "
      "{} |",
      workers, results, bytes / 1e6, cores, own_cores, status_kib(pid, "VmRSS") / 1024,
      1e3 * percentile(latencies.lease, 0.5), 1e3 * percentile(latencies.lease, 0.99),
      1e3 * percentile(latencies.commit, 0.5), 1e3 * percentile(latencies.commit, 0.99), first_picture, 100 * busy,
      connecting, view);
}

/// From here on this process uses all other cores.
void leave_core(int core) {
  cpu_set_t cores;
  LM_CHECK(sched_getaffinity(0, sizeof(cores), &cores) == 0, "sched_getaffinity fails");
  CPU_CLR(static_cast<std::size_t>(core), &cores);
  LM_CHECK(sched_setaffinity(0, sizeof(cores), &cores) == 0, "there is no core except {}", core);
}

int run(const Options& options) {
  if (options.server_core >= 0) {
    leave_core(options.server_core);
  }
  const std::uint64_t files = raise_file_limit();
  for (const std::uint32_t workers : options.workers) {
    LM_CHECK(files > workers + 200, "{} workers take one open file each, and this process may have {}", workers, files);
  }
  fmt::print("{} of {}x{} pixels\n\n", counted(static_cast<std::size_t>(options.jobs), "job"), options.side,
             options.side);
  fmt::print(
      "| workers | results/s | MB/s | coordinator, cores | swarm, cores | coordinator, MiB | lease, ms: median, 99 % | "
      "commit, ms: median, 99 % | first picture, s | workers busy | connecting, s | tiles/s per viewer | tile "
      "age, s: median, 99 % |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const std::uint32_t workers : options.workers) {
    fmt::print("{}\n", measure(options, workers));
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Cost of thousands of workers to a coordinator. The workers are simulated, each with its own connection. They "
      "answer at the stated speed with copies of prepared nodes. Fails if one of them loses its connection.");
  app.footer(
      "Columns:\n"
      "  lease          from the result after which a worker has too few leases or tiles, until its next lease\n"
      "  commit         from a result until its acknowledgement, when it is durable\n"
      "  first picture  from submission of the last job until each of its tiles has a sample\n"
      "  workers busy   share of all threads' time with a tile\n"
      "  connecting     until all workers are connected; a thousand start per second, so at least workers / 1000\n"
      "  tiles/s        tiles that a viewer receives; results/s counts the changes of all jobs\n"
      "  tile age       of a viewer's tiles: since the last message with the tile, or with room for more tiles");
  Options options;
  app.add_option("--workers", options.workers, "workers of each farm")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(1, 20'000));
  app.add_option("--threads", options.threads, "threads of each worker")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  app.add_option("--speed", options.speed, "pixel samples per second of a thread")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e9));
  app.add_option("--spread", options.spread, "ratio of the fastest to the slowest thread")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 100.0));
  app.add_option("--side", options.side, "pixels on a side of the picture; a node of up to 64 has 24 bytes per pixel")
      ->capture_default_str()
      ->check(CLI::Range(1, 8192));
  app.add_option("--jobs", options.jobs,
                 "jobs at once; the first picture is that of the last one, submitted when all workers are connected")
      ->capture_default_str()
      ->check(CLI::Range(1, 2000));
  app.add_option("--spp", options.samples, "samples per pixel of each job")->capture_default_str();
  app.add_option("--warm", options.warm_seconds, "seconds before the measurement")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 600.0));
  app.add_option("--seconds", options.seconds, "seconds of the measurement")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 3600.0));
  app.add_option("--viewers", options.viewers, "viewers of the last job's tiles")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000));
  app.add_option("--server-core", options.server_core, "core for the coordinator alone; -1: any")
      ->capture_default_str()
      ->check(CLI::Range(-1, 1023));
  app.add_option("--log-level", options.log_level, "log level of the coordinator")->capture_default_str();
  app.add_option("--server-option", options.server_options, "more options for the coordinator")
      ->allow_extra_args(false);
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
