// A process of our own: started in the background, ended with us whatever happens to us.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace lightmill::cli {

/// A running child. It gets its own process group (a Ctrl-C in the terminal does not reach it), a clean signal mask and
/// SIGKILL when the thread that started it dies. Its output goes to a file. Not thread-safe.
class ChildProcess {
 public:
  /// `arguments[0]` is the program's path. It does not see our variables LIGHTMILL_*: the farm that they name, and what
  /// they show to it, are not its own.
  static Result<ChildProcess> start(const std::vector<std::string>& arguments, const std::filesystem::path& output);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();  ///< kills it

  pid_t pid() const { return pid_; }
  /// How it ended ("exit code 2", "signal 11"), if it did.
  std::optional<std::string> ended();
  /// SIGKILL, then waits.
  void kill();

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}
  pid_t pid_ = -1;  ///< -1: moved from, or ended and waited for
  std::optional<std::string> end_;
};

}  // namespace lightmill::cli
