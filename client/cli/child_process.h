// A background process that dies with its parent.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace lightmill::cli {

/// A running child. It has its own process group, so a Ctrl-C in the terminal does not reach it. Its signal mask is
/// empty. It gets SIGKILL when the thread that started it dies. Its output goes to a file. Not thread-safe.
class ChildProcess {
 public:
  /// `arguments[0]` is the program's path. The child does not see our LIGHTMILL_* variables about a farm, because they
  /// are for another farm.
  static Result<ChildProcess> start(const std::vector<std::string>& arguments, const std::filesystem::path& output);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();  ///< kills it

  pid_t pid() const { return pid_; }
  /// "exit code 2" or "signal 11"; empty while it runs.
  std::optional<std::string> ended();
  /// SIGKILL, then waits.
  void kill();

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}
  pid_t pid_ = -1;  ///< -1: moved from, or already waited for
  std::optional<std::string> end_;
};

}  // namespace lightmill::cli
