// Real processes for tests: commands that run to their end, and background programs that always end.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace lightmill::test {

/// Limit that keeps a test from hanging. It is no expectation, because the machine can be busy.
inline constexpr std::chrono::seconds kPatience{120};

/// Variables to set on top of the test's own environment; an empty value unsets.
using Environment = std::map<std::string, std::string>;

struct CommandResult {
  int exit_code = -1;  ///< 128 + signal if a signal or the time limit killed it
  std::string out, err;
};

/// Runs a program to its end. Kills it after `limit`.
CommandResult run_command(const std::vector<std::string>& arguments, const Environment& environment = {},
                          std::chrono::seconds limit = kPatience);

/// A background program. It is killed and waited for at the end of its scope. The kernel kills it if the test dies.
class BackgroundProcess {
 public:
  /// Its output goes to the file `log`.
  BackgroundProcess(const std::vector<std::string>& arguments, const std::string& log,
                    const Environment& environment = {});
  ~BackgroundProcess();
  BackgroundProcess(const BackgroundProcess&) = delete;
  BackgroundProcess& operator=(const BackgroundProcess&) = delete;

  pid_t pid() const { return pid_; }
  /// After SIGSTOP it returns when all threads of the process have stopped.
  void send(int signal) const;
  /// The exit code (128 + signal if killed), or nothing if the process still runs after `limit`.
  std::optional<int> wait(std::chrono::milliseconds limit = kPatience);

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

/// Processes (zombies apart) whose environment contains NAME=VALUE.
std::vector<pid_t> processes_with(const std::string& name, const std::string& value);

/// Checks `condition` every 10 ms until it holds or `limit` is over. Returns whether it held.
template <class Condition>
bool eventually(Condition condition, std::chrono::milliseconds limit = kPatience) {
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
