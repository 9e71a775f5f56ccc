// Time of the last twentieth of a job with four workers, with and without one that is much slower than the rest.
//
// The workers are real processes. Each is held to the same small share of a core, so that four fit on two cores. The
// slow one gets a twentieth of that. Runs with and without it alternate.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/base/check.h"
#include "tests/bench/cpu_share.h"
#include "tests/support/farm.h"

namespace {

using namespace lightmill;
using SteadyClock = std::chrono::steady_clock;

constexpr int kWorkers = 4;
constexpr double kLastPart = 0.95;

struct Options {
  double share = 0.15, slow = 20;
  int runs = 5, size = 256;
  std::uint64_t samples = 1024;
  double from = 0;
};

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

struct Race {
  double seconds = 0;       ///< of the whole job
  double last_seconds = 0;  ///< from 95 % to its end
  double slow_share = 0;    ///< CPU of the slow worker over the mean of the others
};

std::vector<double> cpu_seconds_of(const std::vector<pid_t>& pids) {
  std::vector<double> seconds;
  for (const pid_t pid : pids) {
    seconds.push_back(process_cpu_seconds(pid));
  }
  return seconds;
}

/// Starts the workers and waits until all are connected.
std::vector<pid_t> start_workers(test::Farm& farm) {
  std::vector<pid_t> pids;
  for (int i = 0; i < kWorkers; ++i) {
    pids.push_back(farm.add_worker(1, fmt::format("w{}", i + 1)).pid());
  }
  for (int i = 0; i < kWorkers; ++i) {
    LM_CHECK(test::eventually([&] { return farm.met(fmt::format("w{}", i + 1)); }), "a worker does not connect");
  }
  return pids;
}

/// CPU that the last worker has used since `before`, over the mean of the others.
double share_of_last(const std::vector<double>& before, const std::vector<double>& now) {
  double others = 0;
  for (std::size_t i = 0; i + 1 < now.size(); ++i) {
    others += (now[i] - before[i]) / static_cast<double>(now.size() - 1);
  }
  return (now.back() - before.back()) / others;
}

/// One job on its own farm. With `slow`, one worker is slow from that part of the job on.
Race race(const Options& options, bool slow, std::uint64_t seed) {
  test::Farm farm;
  const std::vector<pid_t> pids = start_workers(farm);
  std::vector<std::unique_ptr<CpuShare>> shares;
  for (const pid_t pid : pids) {
    shares.push_back(std::make_unique<CpuShare>(pid, options.share));
  }
  test::Picture picture;
  picture.side = options.size;
  picture.samples = options.samples;
  picture.seed = seed;
  test::FarmClient client = farm.client();
  const std::uint64_t id = client.submit(picture).id();
  const double all = static_cast<double>(options.samples) * options.size * options.size;
  std::vector<double> cpu = cpu_seconds_of(pids);
  const auto start = SteadyClock::now();
  double at_95 = 0;
  for (bool slowed = false;;) {
    const v1::Job job = client.job(id);
    const double done = static_cast<double>(job.samples_done()) / all;
    if (slow && !slowed && done >= options.from) {
      shares.back()->change(options.share / options.slow);
      cpu = cpu_seconds_of(pids);
      slowed = true;
    }
    at_95 = at_95 == 0 && done >= kLastPart ? seconds_since(start) : at_95;
    if (job.state() == v1::JOB_STATE_DONE) {
      const double seconds = seconds_since(start);
      return {seconds, seconds - at_95, share_of_last(cpu, cpu_seconds_of(pids))};
    }
    LM_CHECK(job.state() != v1::JOB_STATE_FAILED, "the job failed: {}", job.reason());
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

struct Column {
  std::vector<double> seconds, last_seconds, slow_shares;
  void add(const Race& race) {
    seconds.push_back(race.seconds);
    last_seconds.push_back(race.last_seconds);
    slow_shares.push_back(race.slow_share);
  }
};

std::string spread(const std::vector<double>& values) {
  return fmt::format("{:.2f} ({:.2f}-{:.2f})", median(values), *std::ranges::min_element(values),
                     *std::ranges::max_element(values));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Time from 95 % of a job to its end, with four workers, and with one of them much slower.");
  Options options;
  app.add_option("--share", options.share, "share of a core for each worker")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1.0));
  app.add_option("--slow", options.slow, "factor by which the slow worker is slower")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--from", options.from, "part of the job after which it is slow; 0: from the start")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 0.99));
  app.add_option("--size", options.size, "film width and height in pixels")
      ->capture_default_str()
      ->check(CLI::Range(64, 4096));
  app.add_option("--samples", options.samples, "samples per pixel")
      ->capture_default_str()
      ->check(CLI::Range(16, 1 << 20));
  app.add_option("--runs", options.runs, "runs with and without the slow worker, in turn")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);

  Column without, with;
  for (int run = 0; run < options.runs; ++run) {
    for (const bool slow : {false, true}) {
      const Race result = race(options, slow, static_cast<std::uint64_t>(run));
      (slow ? with : without).add(result);
      std::printf("%s: %.1f s, from 95 %% to done %.2f s\n", slow ? "one slow" : "all equal", result.seconds,
                  result.last_seconds);
      std::fflush(stdout);
    }
  }
  fmt::print("\n| | whole job, s | from 95 % to done, s | CPU of the slow one over that of another |\n");
  fmt::print("| --- | --- | --- | --- |\n");
  fmt::print("| all alike | {} | {} | {} |\n", spread(without.seconds), spread(without.last_seconds),
             spread(without.slow_shares));
  fmt::print("| one {:g} times slower | {} | {} | {} |\n", options.slow, spread(with.seconds),
             spread(with.last_seconds), spread(with.slow_shares));
  fmt::print("\nmedians: {:.2f} times as long\n", median(with.last_seconds) / median(without.last_seconds));
}
