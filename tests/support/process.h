// Real processes for tests: commands that run to their end, and background programs that always end.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace lightmill::test {

/// Limit that keeps a test from hanging. It is no expectation, because the machine can be busy.
inline constexpr std::chrono::seconds kTimeout{120};

/// Variables to set on top of the test's own environment; an empty value unsets.
using Environment = std::map<std::string, std::string>;

struct CommandResult {
  int exit_code = -1;  ///< 128 + signal if a signal or the time limit killed it
  std::string out, err;
};

/// Runs a program to its end. Kills it after `limit`.
CommandResult run_command(const std::vector<std::string>& arguments, const Environment& environment = {},
                          std::chrono::seconds limit = kTimeout);

/// A background program. It is killed and waited for at the end of its scope. The kernel kills it if the test dies.
/// If LIGHTMILL_LEAVE_MS is set, it gets SIGTERM first, and so many milliseconds to end. A killed program would lose its
/// counts of lines in the coverage build.
/// Its crash fails the test, or the program if no test runs. A crash is an end by a signal that the test did not send, an
/// exit code that the test did not ask for, or a report of a fault in the log.
class BackgroundProcess {
 public:
  /// Its output goes to the file `log`.
  BackgroundProcess(const std::vector<std::string>& arguments, const std::string& log,
                    const Environment& environment = {});
  ~BackgroundProcess();
  BackgroundProcess(const BackgroundProcess&) = delete;
  BackgroundProcess& operator=(const BackgroundProcess&) = delete;

  pid_t pid() const { return pid_; }
  bool runs();
  /// After SIGSTOP it returns when all threads of the process have stopped.
  void send(int signal);
  /// The exit code (128 + signal if killed), or nothing if the process still runs after `limit`.
  std::optional<int> wait(std::chrono::milliseconds limit = kTimeout);
  /// Its log may report faults, because the test causes them.
  void allow_faults() { faults_allowed_ = true; }

 private:
  /// Why its end or its log is a crash. Empty if it is none.
  std::string crash() const;

  const std::string program_;
  int log_ = -1;         ///< descriptor, so that the log is there when its folder is gone
  off_t log_begin_ = 0;  ///< earlier processes have written what is before
  pid_t pid_ = -1;
  std::set<int> sent_;      ///< signals that the test sent
  std::optional<int> end_;  ///< as waitpid() gives it
  bool asked_ = false;      ///< the test has received the exit code
  bool faults_allowed_ = false;
};

/// Processes (zombies apart) whose environment contains NAME=VALUE.
std::vector<pid_t> processes_with(const std::string& name, const std::string& value);

/// Checks `condition` every 10 ms until it holds or `limit` is over. Returns whether it held.
template <class Condition>
bool eventually(Condition condition, std::chrono::milliseconds limit = kTimeout) {
  const auto until = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace lightmill::test
