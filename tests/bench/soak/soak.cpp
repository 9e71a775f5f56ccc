// A soak: a farm of three workers under faults for an hour. Every film must equal that of a quiet farm, nothing may
// fail, and memory and descriptors may not grow.
//
// First a quiet farm renders twenty jobs of different kinds. Then another farm renders all twenty at once, again and
// again. Every ten seconds a fault happens, and jobs are paused, extended and reordered.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <thread>

#include "client/cli/console.h"
#include "client/cli/signals.h"
#include "client/cli/units.h"
#include "tests/bench/soak/soak_faults.h"
#include "tests/bench/soak/soak_jobs.h"
#include "tests/bench/soak/soak_watch.h"

namespace {

using namespace lightmill;
using namespace lightmill::soak;

constexpr double kFaultSeconds = 10;  // between faults
constexpr double kMinFault = 1, kMaxFault = 8;
constexpr double kSampleSeconds = 1;
constexpr double kLongestEnd = 900;  // for the remaining jobs after the last fault
constexpr int kSkipped = 77;
constexpr auto kLook = std::chrono::milliseconds(300);

struct Options {
  double minutes = 60;
  std::uint64_t seed = 1;
};

double seconds_now() {
  return to_seconds(system_clock().now().time_since_epoch());
}

/// A thread that calls step() until its end.
std::jthread keep_stepping(Jobs& jobs) {
  return std::jthread([&jobs](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      jobs.step();
      std::this_thread::sleep_for(kLook);
    }
  });
}

/// A progress line in a terminal, otherwise a line per minute.
class Progress {
 public:
  void show(const std::string& line) {
    if (console_.terminal()) {
      console_.redraw(line);
    } else if (const double now = seconds_now(); now >= next_) {
      console_.notice(line);
      next_ = now + 60;
    }
  }
  ~Progress() { console_.end_redraw(); }

 private:
  cli::Console console_{false};
  double next_ = 0;
};

/// Empty if interrupted.
Films quiet_films(cli::Signals& signals, Progress& progress) {
  test::Farm farm;
  for (int i = 0; i < kWorkers; ++i) {
    farm.add_worker(1, TroubledFarm::worker_name(i));
  }
  Jobs jobs(farm.address(), {}, 0);
  const std::jthread stepping = keep_stepping(jobs);
  while (jobs.films().size() < kinds().size()) {
    if (signals.interrupted() || !jobs.tally().wrong.empty()) {
      fmt::print(stderr, "{}\n", fmt::join(jobs.tally().wrong, "\n"));
      return {};
    }
    progress.show(fmt::format("a quiet farm: {} of {} films", jobs.films().size(), kinds().size()));
    signals.sleep(kLook);
  }
  return jobs.films();
}

class Soak {
 public:
  Soak(const Options& options, Films quiet, const test::SmallDisk* disk, cli::Signals& signals, Progress& progress)
      : options_(options),
        signals_(signals),
        progress_(progress),
        random_(options.seed),
        farm_(disk, options.seed),
        jobs_(farm_.address(), std::move(quiet), options.seed) {}

  void run() {
    const std::jthread stepping = keep_stepping(jobs_);
    const double length = 60 * options_.minutes;
    while (passed() < length && !signals_.interrupted() && wrong_.empty()) {
      farm_.in_fault() ? end_fault_in_time() : begin_fault_in_time(passed() < length / 2);
      watch();
    }
    farm_.end_fault();
    jobs_.stop_submitting();
    const double until = passed() + kLongestEnd;
    while (!jobs_.none_left() && !signals_.interrupted() && wrong_.empty()) {
      watch();
      if (passed() > until) {
        wrong_.push_back(fmt::format("jobs still run {:.0f} s after the last fault", kLongestEnd));
      }
    }
  }

  /// Whether everything passed.
  bool report() const {
    const Tally tally = jobs_.tally();
    fmt::print("seed {}, {} of faults: {} films, {} as on a quiet farm\n\n| faults and commands | times |\n",
               options_.seed, cli::human_seconds(std::min(passed(), 60 * options_.minutes)),
               tally.alike + static_cast<int>(tally.wrong.size()), tally.alike);
    fmt::print("| --- | --- |\n");
    for (const auto& [what, times] : faults_) {
      fmt::print("| {} | {} |\n", what, times);
    }
    for (const auto& [what, times] : tally.commands) {
      fmt::print("| a job {} | {} |\n", what, times);
    }
    bool flat = true;
    fmt::print("\n| longest life of | seconds | memory, MiB: by thirds (peak) | descriptors | |\n");
    fmt::print("| --- | --- | --- | --- | --- |\n");
    for (const auto& [name, trend] : watch_.trends()) {
      fmt::print("| {} | {:.0f} | {:.0f} ({:.0f}) | {:.0f} | {} |\n", name, trend.seconds,
                 fmt::join(trend.memory_mib, ", "), trend.most_mib, fmt::join(trend.descriptors, ", "),
                 !trend.judged()                         ? "too short to judge"
                 : !trend.flat()                         ? "grows"
                 : trend.seconds < Trend::kSecondsToFill ? "descriptors flat, too short to judge memory"
                                                         : "flat");
      flat = flat && (!trend.judged() || trend.flat());
    }
    std::vector<std::string> wrong = wrong_;
    wrong.insert(wrong.end(), tally.wrong.begin(), tally.wrong.end());
    if (!wrong.empty()) {
      fmt::print("\nwrong:\n{}\n", fmt::join(wrong, "\n"));
    }
    // The test support reports errors, such as a process that does not start, to GoogleTest.
    return flat && wrong_.empty() && tally.wrong.empty() && tally.alike > 0 &&
           !::testing::UnitTest::GetInstance()->ad_hoc_test_result().Failed();
  }

 private:
  double passed() const { return seconds_now() - start_; }
  double drawn(double least, double most) {
    return least + (most - least) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }

  void begin_fault_in_time(bool may_kill_coordinator) {
    if (passed() >= next_fault_) {
      ++faults_[farm_.begin_fault(may_kill_coordinator)];
      fault_ends_ = passed() + drawn(kMinFault, kMaxFault);
      next_fault_ += kFaultSeconds;
    }
  }

  void end_fault_in_time() {
    if (passed() >= fault_ends_) {
      farm_.end_fault();
    }
  }

  /// Samples the resources of the processes, and prints progress.
  void watch() {
    signals_.sleep(std::chrono::milliseconds(100));
    if (!farm_.in_fault()) {
      const std::vector<std::string> ended = farm_.ended_by_themselves();
      wrong_.insert(wrong_.end(), ended.begin(), ended.end());
    }
    if (passed() >= next_sample_) {
      next_sample_ += kSampleSeconds;
      watch_.sample("the coordinator", farm_.farm().server().pid(), passed());
      for (int i = 0; i < kWorkers; ++i) {
        const std::string name = TroubledFarm::worker_name(i);
        watch_.sample("worker " + name, farm_.farm().worker(name).pid(), passed());
      }
    }
    const Tally tally = jobs_.tally();
    int faults = 0;
    for (const auto& [what, times] : faults_) {
      faults += times;
    }
    const double left = 60 * options_.minutes - passed();
    progress_.show(fmt::format("{} faults, {} films alike, {} things wrong, {}", faults, tally.alike,
                               tally.wrong.size() + wrong_.size(),
                               left > 0 ? cli::human_seconds(left) + " to go" : "until the last films are done"));
  }

  const Options options_;
  cli::Signals& signals_;
  Progress& progress_;
  std::mt19937_64 random_;
  TroubledFarm farm_;
  Jobs jobs_;
  ProcessWatch watch_;
  std::map<std::string, int> faults_;
  std::vector<std::string> wrong_;
  const double start_ = seconds_now();
  double next_fault_ = kFaultSeconds, fault_ends_ = 0, next_sample_ = 0;
};

int run(const Options& options, cli::Signals& signals) {
  fmt::print("seed {}\n", options.seed);
  std::fflush(stdout);
  const test::SmallDisk disk(kDiskMib);
  if (!disk.mounted()) {
    fmt::print(stderr, "soak: cannot mount a disk (needs root), so the disk faults are left out\n");
  }
  Progress progress;
  Films quiet = quiet_films(signals, progress);
  if (quiet.empty()) {
    return signals.interrupted() ? cli::kInterrupted : cli::kJobFailed;
  }
  Soak soak(options, std::move(quiet), disk.mounted() ? &disk : nullptr, signals, progress);
  soak.run();
  const bool well = soak.report();
  if (signals.interrupted() || !well) {
    return signals.interrupted() ? cli::kInterrupted : cli::kJobFailed;
  }
  if (!disk.mounted()) {
    fmt::print("skipped: the disk faults, which need root. All others passed\n");
    return kSkipped;
  }
  return cli::kDone;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Renders twenty kinds of jobs on a farm of its own with a fault every ten seconds, and compares every film with "
      "that of a quiet farm. Ctrl-C ends it and everything it has started.");
  Options options;
  app.add_option("--minutes", options.minutes,
                 "minutes with faults; the quiet run before and the last films after take more time")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 10'000.0));
  app.add_option("--seed", options.seed, "seed of the order of faults")->capture_default_str();
  app.footer(
      "Exit codes: 0 passed, 1 failed, 77 passed without the disk faults, 130 interrupted. Memory and descriptors are "
      "judged from `--minutes 8` on.");
  cli::Signals signals;
  CLI11_PARSE(app, argc, argv);
  return run(options, signals);
}
