// Real processes for tests: commands that are run to their end, and programs in the background that are sure to go.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace lightmill::test {

/// Keeps a test from hanging where something never happens. It is no expectation: the machine may be busy.
inline constexpr std::chrono::seconds kPatience{120};

/// Variables to set on top of the test's own environment; an empty value unsets.
using Environment = std::map<std::string, std::string>;

struct CommandResult {
  int exit_code = -1;  ///< 128 + signal if it was killed, also by the time limit
  std::string out, err;
};

/// Runs a program to its end; it is killed after `limit`.
CommandResult run_command(const std::vector<std::string>& arguments, const Environment& environment = {},
                          std::chrono::seconds limit = std::chrono::seconds(120));

/// A program in the background; killed and waited for at the end of its scope, and by the kernel if the test dies.
class BackgroundProcess {
 public:
  /// Its output goes to the file `log`.
  BackgroundProcess(const std::vector<std::string>& arguments, const std::string& log,
                    const Environment& environment = {});
  ~BackgroundProcess();
  BackgroundProcess(const BackgroundProcess&) = delete;
  BackgroundProcess& operator=(const BackgroundProcess&) = delete;

  pid_t pid() const { return pid_; }
  /// After SIGSTOP it returns once all threads of the process stand still.
  void send(int signal) const;
  /// The exit code (128 + signal if killed), or nothing if it still runs after `limit`.
  std::optional<int> wait(std::chrono::milliseconds limit = kPatience);

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

/// Processes (zombies apart) whose environment contains NAME=VALUE.
std::vector<pid_t> processes_with(const std::string& name, const std::string& value);

/// Asks `condition` every 10 ms until it holds or `limit` is over; whether it held.
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
