// Program that runs schedules of the simulation on several threads, and prints the count of each fault.
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "tests/simulation/attacks.h"
#include "tests/simulation/damages.h"
#include "tests/simulation/farm_simulation.h"
#include "tests/simulation/odds.h"

namespace {

using namespace lightmill::simulation;
using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t interrupted = 0;

struct Options {
  std::uint64_t seeds = 1'000'000, first = 1, seed = 0, damages = 0, attacks = 0, odds = 0;
  std::string hashes;  ///< file for the hashes; empty: none
  std::string notes;   ///< file with the progress of this program; empty: none
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
};

/// Totals of all schedules.
struct Sum {
  std::mutex mutex;
  std::set<std::uint64_t> at_work;  ///< seeds
  std::uint64_t done = 0, restarts = 0, deaths = 0, quarantined = 0, poisoned = 0, unlucky = 0;
  std::map<std::string, std::uint64_t> faults;
  std::map<std::uint64_t, std::string> failures;        ///< by seed
  std::map<std::uint64_t, lightmill::Hash128> effects;  ///< by seed

  void add(std::uint64_t seed, const Report& report) {
    const std::lock_guard lock(mutex);
    effects[seed] = report.effects;
    at_work.erase(seed);
    ++done;
    restarts += report.restarts;
    deaths += report.deaths;
    quarantined += report.quarantined;
    poisoned += report.poisoned;
    unlucky += report.unlucky;
    for (const auto& [kind, count] : report.faults) {
      faults[kind] += count;
    }
    if (!report.failure.empty()) {
      failures.emplace(seed, report.failure);
      fmt::print("\nseed {} failed {}\n  replay it step by step: simulate --seed {}\n", seed, report.failure, seed);
      std::fflush(stdout);
    }
  }
};

/// Identifies the program, and so the sources that it is built from.
std::string this_program() {
  std::ifstream in("/proc/self/exe", std::ios::binary);
  lightmill::Sha256Hasher hasher;
  for (std::string piece(1 << 20, '\0'); in.read(piece.data(), 1 << 20), in.gcount() > 0;) {
    hasher.append(std::string_view(piece.data(), static_cast<std::size_t>(in.gcount())));
  }
  return hasher.finish().hex();
}

/// Progress of this program over several runs: schedules from seed 1 on.
struct Notes {
  std::string program = this_program();
  std::uint64_t next = 1, failed = 0;  ///< the first seed that is not done

  /// Reads the file. Starts again if it is of another program.
  static Notes read(const std::string& file) {
    Notes now, found;
    std::ifstream in(file);
    return in >> found.program >> found.next >> found.failed && found.program == now.program ? found : now;
  }
  bool write(const std::string& file) const {
    std::ofstream out(file);
    out << program << ' ' << next << ' ' << failed << '\n';
    return static_cast<bool>(out.flush());
  }
};

std::string as_duration(double seconds) {
  const auto whole = static_cast<std::uint64_t>(seconds);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

Report run_schedule(std::uint64_t seed, const Options& options) {
  FarmSimulation simulation(seed, Chaos{}, PlantedBugs{});
  if (!options.hashes.empty()) {
    simulation.hash_effects();
  }
  if (options.seed != 0) {
    simulation.trace();
  }
  return simulation.run();
}

int replay(const Options& options) {
  const std::uint64_t seed = options.seed;
  const Report report = run_schedule(seed, options);
  fmt::print("seed {}: {}\n", seed, report.failure.empty() ? "no failure" : "failed " + report.failure);
  return report.failure.empty() ? 0 : 1;
}

/// Each killed farm is made once, and damaged in several ways.
int run_damages(const Options& options) {
  spdlog::set_level(spdlog::level::off);  // the log names each damage
  DamageTable table;
  std::uint64_t failures = 0;
  for (std::uint64_t seed = options.first; seed < options.first + options.damages && interrupted == 0; ++seed) {
    const DamageReport report = damage_one(seed);
    table.add(report);
    if (!report.failure.empty()) {
      ++failures;
      fmt::print("seed {}, {}: {}\n  replay it: simulate --damages 1 --first {}\n", seed, report.kind, report.failure,
                 seed);
    }
  }
  fmt::print("{}{} of {} damages failed\n", table.text(), failures, options.damages);
  return failures > 0 ? 1 : 0;
}

int run_attacks(const Options& options) {
  const AttackTable table = try_attacks(options.attacks);
  fmt::print("{}", table.text());
  return std::ranges::all_of(table.rows, [](const auto& row) { return row.unnoticed == 0; }) ? 0 : 1;
}

/// Fails above four standard errors: a false alarm in one of 16,000 rows.
int run_odds(const Options& options) {
  const OddsTable table = measure_odds(options.odds);
  const double worst = table.worst();
  fmt::print("{}largest deviation: {:.2f} standard errors{}\n", table.text(), worst,
             worst > 4   ? ": the theory or the coordinator is wrong"
             : worst > 2 ? ": more than two"
                         : "");
  return worst > 4 ? 1 : 0;
}

int run_all(Options options) {
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  Sum sum;
  Notes notes;
  if (!options.notes.empty()) {
    notes = Notes::read(options.notes);
    options.first = notes.next;
  }
  const std::uint64_t failed_before = notes.failed;
  std::uint64_t next = options.first;
  const auto take_seed = [&]() -> std::optional<std::uint64_t> {
    const std::lock_guard lock(sum.mutex);
    if (next == options.first + options.seeds || interrupted != 0) {
      return std::nullopt;
    }
    sum.at_work.insert(next);
    return next++;
  };
  const auto note = [&] {
    notes.next = sum.at_work.empty() ? next : *sum.at_work.begin();
    notes.failed = failed_before + sum.failures.size();
    return options.notes.empty() || notes.write(options.notes);
  };
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < options.threads; ++i) {
    threads.emplace_back([&] {
      while (const std::optional<std::uint64_t> seed = take_seed()) {
        sum.add(*seed, run_schedule(*seed, options));
      }
    });
  }
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  double printed = 0;
  for (std::uint64_t done = 0; done < options.seeds && interrupted == 0;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    const std::lock_guard lock(sum.mutex);
    done = sum.done;
    (void)note();
    if (!terminal && elapsed() - printed < 60) {
      continue;
    }
    printed = elapsed();
    const double left =
        elapsed() / static_cast<double>(std::max<std::uint64_t>(done, 1)) * static_cast<double>(options.seeds - done);
    fmt::print(stderr, "{}{} of {} schedules, {} failed, {} to go{}", terminal ? "\r" : "", done, options.seeds,
               sum.failures.size(), as_duration(left), terminal ? "   " : "\n");
    std::fflush(stderr);
  }
  threads.clear();
  const double seconds = elapsed();
  if (!note()) {
    fmt::print(stderr, "cannot write {}\n", options.notes);
    return 1;
  }
  if (terminal) {
    fmt::print(stderr, "\n");
  }
  fmt::print("{}{} schedules from seed {} on: {} failed; {:.0f} s, {:.2f} s a thousand on {} threads\n",
             interrupted != 0 ? "interrupted: " : "", sum.done, options.first, sum.failures.size(), seconds,
             1000 * seconds / static_cast<double>(std::max<std::uint64_t>(sum.done, 1)), options.threads);
  if (!options.notes.empty()) {
    fmt::print("{} schedules in all, {} failed: the same command continues from there\n", notes.next - 1, notes.failed);
  } else if (interrupted != 0) {
    fmt::print("  to continue: simulate --first {} --seeds {}\n", options.first + sum.done, options.seeds - sum.done);
  }
  sum.faults.insert({{"workers killed", sum.deaths},
                     {"coordinators killed", sum.restarts},
                     {"workers put into quarantine", sum.quarantined},
                     {"jobs that kill workers and failed", sum.poisoned},
                     {"jobs that failed by bad luck", sum.unlucky}});
  for (const auto& [kind, count] : sum.faults) {
    fmt::print("{:12} {}\n", count, kind);
  }
  for (const auto& [seed, failure] : sum.failures) {
    fmt::print("seed {} failed {}\n", seed, failure);
  }
  if (!options.hashes.empty()) {
    std::ofstream file(options.hashes);
    for (const auto& [seed, hash] : sum.effects) {
      file << seed << ' ' << hash.hex() << '\n';
    }
    if (!file.flush()) {
      fmt::print(stderr, "cannot write {}\n", options.hashes);
      return 1;
    }
  }
  return !sum.failures.empty() || notes.failed > 0 ? 1 : interrupted != 0 ? 130 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Runs schedules of the simulated farm. Each schedule depends only on its seed.");
  Options options;
  app.add_option("--seeds", options.seeds, "number of schedules")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  app.add_option("--first", options.first, "seed of the first schedule; the others have the next seeds")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "schedules at a time")
      ->capture_default_str()
      ->check(CLI::Range(1u, 1024u));
  app.add_option("--seed", options.seed, "run only the schedule of this seed, and print its events");
  app.add_option("--notes", options.notes,
                 "continue after the schedules of earlier runs of this program, and keep the progress in this file")
      ->excludes("--first");
  app.add_option("--damages", options.damages,
                 "instead of schedules: damage the files of this number of killed farms, and print the outcomes");
  app.add_option(
      "--attacks", options.attacks,
      "instead of schedules: try each attack of one machine on this number of farms, and print the outcomes");
  app.add_option(
      "--odds", options.odds,
      "instead of schedules: compare how often audits find a liar with the theory, on this number of farms of each kind");
  app.add_option("--hashes", options.hashes,
                 "write a hash of all effects of each schedule to this file; with --seed, print the effects instead");
  CLI11_PARSE(app, argc, argv);
  return options.odds != 0      ? run_odds(options)
         : options.attacks != 0 ? run_attacks(options)
         : options.damages != 0 ? run_damages(options)
         : options.seed != 0    ? replay(options)
                                : run_all(options);
}
