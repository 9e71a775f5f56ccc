// Tests of the farm's real threads over a real store, with a fault at any call of the store or any allocation.
//
// Each farm runs in its own process, and reports acknowledged results through a pipe. Whatever ends it, the store has
// all of them. Another coordinator finishes the jobs, with the bits of a run without faults. An alarm ends a farm that
// hangs, and no test accepts this.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <future>
#include <sstream>

#include "common/base/out_of_memory.h"
#include "server/runtime/farm_loop.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/simulation/failing_store.h"
#include "tests/simulation/fake_renderer.h"
#include "tests/simulation/stored_farm.h"
#include "tests/simulation/worker_side.h"
#include "tests/support/allocations.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::simulation {
namespace {

constexpr int kAllDone = 0, kStoreFailed = 3, kMemoryEnded = 7;
constexpr unsigned kTimeoutSeconds = 120;
constexpr std::uint64_t kJobs = 3;

struct Trial {
  StoreFault fault = StoreFault::none;
  std::uint64_t at_call = 0;
  std::int64_t at_allocation = -1;
};

std::map<JobId, StoredJob> jobs_of(std::uint64_t seed) {
  Random random(seed);
  std::map<JobId, StoredJob> jobs;
  for (std::uint64_t number = 1; number <= kJobs; ++number) {
    jobs[JobId{number}] = draw_job(number, {}, random);
  }
  return jobs;
}

/// Farm in its process: clients that submit jobs, and workers that render at once, on the farm thread.
class RunningFarm {
 public:
  RunningFarm(Store& store, StoredState state, int report_pipe)
      : report_pipe_(report_pipe), coordinator_(limits(), std::move(state), system_clock().now()) {
    loop_.emplace(coordinator_, actions_, store, system_clock(), [this](const Status&) { end(); });
    loop_->set_handlers({.send = [this](Outgoing message) { take(std::move(message)); }});
  }

  int run(const std::map<JobId, StoredJob>& jobs) {
    for (const std::uint64_t worker : {1, 2}) {
      loop_->post_always([worker](FarmLoop::TaskContext& context) {
        WorkerHello hello{fmt::format("worker-{}", worker), "host", 1, 1, kUsualClass, kRendererVersion, {}, false};
        hello.identity = fmt::format("identity-{}", worker);
        context.farm.worker_connected(SessionId{worker}, hello, context.now, context.effects);
      });
    }
    for (const auto& [id, job] : jobs) {
      loop_->post_always([this, id = id, job = job](FarmLoop::TaskContext& context) { submit(id, job, context); });
    }
    ended_.get_future().wait();
    loop_->stop_waiting();
    return loop_->stop().ok() ? kAllDone : kStoreFailed;
  }

 private:
  static CoordinatorLimits limits() {
    CoordinatorLimits limits;
    limits.film_idle = std::chrono::milliseconds(1);  // films are read again
    limits.auditor_timeout = std::chrono::seconds(1);
    return limits;
  }
  void end() {
    if (!has_ended_.exchange(true)) {
      ended_.set_value();
    }
  }
  void report(const std::string& line) const { (void)!::write(report_pipe_, line.data(), line.size()); }

  void submit(JobId id, const StoredJob& job, FarmLoop::TaskContext& context) {
    MethodNotes notes;
    notes.candidates = job.methods;
    if (context.farm.submit(job.spec, context.now, context.unix_ms, context.effects, notes).ok()) {
      context.callers.push_back([this, id](const Status& status) {
        if (status.ok()) {
          report(fmt::format("J {}\n", id.value));
        }
      });
    }
  }

  /// From the farm thread and the commit thread.
  void take(Outgoing message) {
    if (const auto* const ack = std::get_if<ResultAck>(&message.message)) {
      for (const NodeKey& key : ack->keys) {
        report(fmt::format("A {} {} {} {}\n", key.job.value, key.tile.value, key.range.level, key.range.index));
      }
      loop_->post_always([this](FarmLoop::TaskContext& context) { look(context); });
    } else {
      loop_->post_always(
          [this, message = std::move(message)](FarmLoop::TaskContext& context) { answer(message, context); });
    }
  }

  void answer(const Outgoing& message, FarmLoop::TaskContext& context) {
    const auto say = [&](WorkerMessage answer) {
      context.farm.worker_message(message.to, std::move(answer), context.now, context.unix_ms, context.effects);
    };
    if (const auto* const grant = std::get_if<LeaseGrant>(&message.message)) {
      for (std::size_t i = 0; i < grant->unit.tiles.size(); ++i) {
        if (std::optional<WorkerResult> result = render(*grant, i, context.farm, context.now)) {
          say(*std::move(result));
        }
      }
    } else if (const auto* const pilot = std::get_if<PilotGrant>(&message.message)) {
      say(pilot_report(*pilot));
    }
    look(context);
  }

  /// After all jobs have ended, reads their films, and then ends the farm.
  void look(FarmLoop::TaskContext& context) {
    const std::vector<JobStatus> jobs = context.farm.jobs(context.now);
    if (looked_ || jobs.size() < kJobs ||
        !std::ranges::all_of(jobs, [](const JobStatus& job) { return has_ended(job.state); })) {
      return;
    }
    looked_ = true;
    for (const JobStatus& job : jobs) {
      context.with_film(job.id, [this](FarmLoop::TaskContext&, const Status&) {
        if (++films_ == kJobs) {
          end();
        }
      });
    }
  }

  const int report_pipe_;
  Coordinator coordinator_;
  ActionLog actions_{{}, {}};
  std::promise<void> ended_;
  std::atomic<bool> has_ended_ = false;
  bool looked_ = false;
  std::size_t films_ = 0;
  std::optional<FarmLoop> loop_;
};

int run_farm(const std::filesystem::path& folder, std::uint64_t seed, const Trial& trial, int report_pipe) {
  spdlog::set_level(spdlog::level::off);
  ::alarm(kTimeoutSeconds);
  exit_on_out_of_memory("farm", kMemoryEnded);
  FailingStore store(open_sqlite_store(StoredFarm::database_of(folder)).value(), trial.fault, trial.at_call, seed);
  StoredState state = store.load().value();
  RunningFarm farm(store, std::move(state), report_pipe);
  const std::map<JobId, StoredJob> jobs = jobs_of(seed);
  test::allocations_left = trial.at_allocation;
  const int code = farm.run(jobs);
  test::allocations_left = -1;
  return code;
}

/// The fault after the end of a farm; empty if there is none.
std::string wrong_outcome(const std::filesystem::path& folder, std::uint64_t seed, const std::string& reports) {
  auto farm = StoredFarm::start(folder, false, {});
  if (!farm.ok()) {
    return message_of(farm.status());
  }
  const StoredState& state = (*farm)->loaded();
  if (!state.damaged.empty() || !state.damaged_jobs.empty()) {
    return "the store is damaged";
  }
  std::istringstream lines(reports);
  for (std::string kind; lines >> kind;) {
    JobId job;
    TileId tile;
    SampleRange range;
    lines >> job.value;
    if (kind == "A") {
      lines >> tile.value >> range.level >> range.index;
    }
    const auto stored = std::ranges::find(state.jobs, job, [](const auto& each) { return each.record.id; });
    if (stored == state.jobs.end()) {
      return fmt::format("job {} was confirmed, but is not stored", job.value);
    }
    if (kind == "A" && std::ranges::none_of(stored->nodes, [&](const StoredState::StoredNode& node) {
          return node.tile == tile && node.outline.range.contains(range);
        })) {
      return fmt::format("job {}, tile {}, samples [{}, {}) were acknowledged, but are not stored", job.value,
                         tile.value, range.first(), range.end());
    }
  }
  const std::string waits = (*farm)->finish();
  return waits.empty() ? (*farm)->wrong_films(jobs_of(seed)) : waits;
}

struct Ended {
  int code = -1;  ///< exit code of the process; -1 if a signal ended it
  int signal = 0;
  std::string reports;  ///< what it acknowledged
  std::string wrong;
};

/// Runs farms in parallel, because they mostly wait.
std::vector<Ended> run_all(const std::vector<Trial>& trials, std::uint64_t first_seed) {
  std::vector<Ended> ended(trials.size());
  constexpr std::size_t kAtOnce = 16;
  for (std::size_t begin = 0; begin < trials.size(); begin += kAtOnce) {
    const std::size_t end = std::min(begin + kAtOnce, trials.size());
    std::vector<std::unique_ptr<test::TemporaryFolder>> folders;
    std::vector<std::pair<pid_t, int>> children;
    for (std::size_t i = begin; i < end; ++i) {
      folders.push_back(std::make_unique<test::TemporaryFolder>());
      std::array<int, 2> pipe{};
      EXPECT_EQ(::pipe(pipe.data()), 0);
      const pid_t child = ::fork();
      if (child == 0) {
        ::close(pipe[0]);
        int code = kAllDone;
        std::thread([&] {  // its own thread, so that no frame catches its exceptions
          code = run_farm(folders.back()->path(), first_seed + i, trials[i], pipe[1]);
        })
            .join();
        std::_Exit(code);
      }
      ::close(pipe[1]);
      children.emplace_back(child, pipe[0]);
    }
    for (std::size_t i = begin; i < end; ++i) {
      const auto [child, pipe] = children[i - begin];
      std::array<char, 4096> piece{};
      for (ssize_t got = 0; (got = ::read(pipe, piece.data(), piece.size())) > 0;) {
        ended[i].reports.append(piece.data(), static_cast<std::size_t>(got));
      }
      ::close(pipe);
      int status = 0;
      ::waitpid(child, &status, 0);
      ended[i].code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      ended[i].signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
      ended[i].wrong = wrong_outcome(folders[i - begin]->path(), first_seed + i, ended[i].reports);
    }
  }
  return ended;
}

std::vector<Trial> trials_of(StoreFault fault, std::uint64_t count) {
  std::vector<Trial> trials;
  for (std::uint64_t i = 0; i < count; ++i) {
    trials.push_back({fault, 1 + i % 8, -1});
  }
  return trials;
}

/// Count of trials whose farm did not finish. All of these must have ended with `code` or `signal`.
std::uint64_t expect_promises(const std::vector<Ended>& ended, std::uint64_t first_seed, int code, int signal = 0) {
  std::uint64_t cut_short = 0;
  for (std::size_t i = 0; i < ended.size(); ++i) {
    SCOPED_TRACE(fmt::format("seed {}", first_seed + i));
    EXPECT_EQ(ended[i].wrong, "");
    if (ended[i].code != kAllDone) {
      ++cut_short;
      EXPECT_EQ(ended[i].signal, signal);
      EXPECT_EQ(ended[i].code, signal != 0 ? -1 : code);
    }
  }
  return cut_short;
}

TEST(RuntimeFaults, TheFarmWaitsWhileTheDiskIsFullOrFilesAreShort) {
  std::vector<Trial> trials = trials_of(StoreFault::full, 8);
  for (const Trial& trial : trials_of(StoreFault::away, 8)) {
    trials.push_back(trial);
  }
  // A farm that stops does not retry a failing commit.
  EXPECT_LT(expect_promises(run_all(trials, 1), 1, kStoreFailed), 4u);
}

TEST(RuntimeFaults, ADamagedStoreStopsTheFarm) {
  EXPECT_GT(expect_promises(run_all(trials_of(StoreFault::damaged, 16), 100), 100, kStoreFailed), 2u);
}

TEST(RuntimeFaults, AFailedAllocationInACallOfTheStoreLosesNothing) {
  EXPECT_GT(expect_promises(run_all(trials_of(StoreFault::memory, 16), 200), 200, kMemoryEnded), 2u);
}

TEST(RuntimeFaults, AKillInACallOfTheStoreLosesNothing) {
  EXPECT_GT(expect_promises(run_all(trials_of(StoreFault::killed, 16), 300), 300, -1, SIGKILL), 2u);
}

TEST(RuntimeFaults, AFailureOfAnyAllocationLosesNothing) {
  std::vector<Trial> trials;
  for (int i = 0; i < 48; ++i) {
    trials.push_back({StoreFault::none, 0, static_cast<std::int64_t>(10 * std::pow(1.2, i))});
  }
  EXPECT_GT(expect_promises(run_all(trials, 400), 400, kMemoryEnded), 16u);
}

TEST(RuntimeFaults, AFalselyReportedCommitIsFound) {
  std::uint64_t found = 0;
  for (const Ended& ended : run_all(trials_of(StoreFault::lies, 16), 500)) {
    found += ended.wrong.empty() ? 0 : 1;
  }
  EXPECT_GT(found, 2u);
}

}  // namespace
}  // namespace lightmill::simulation
