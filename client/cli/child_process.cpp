#include "client/cli/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string_view>

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

constexpr int kExecFailed = 127;

/// The child's steps between fork and exec. Only async-signal-safe calls are allowed.
[[noreturn]] void become(char* const* arguments, char* const* environment, int output, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) {
    ::_exit(kExecFailed);  // the parent died before prctl
  }
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  std::signal(SIGPIPE, SIG_DFL);
  const int null = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::dup2(null, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  ::execve(arguments[0], arguments, environment);
  ::_exit(kExecFailed);
}

/// Our variables without those about a farm, which do not concern the child.
std::vector<char*> environment_for_child() {
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (!std::string_view(*variable).starts_with("LIGHTMILL_")) {
      variables.push_back(*variable);
    }
  }
  variables.push_back(nullptr);
  return variables;
}

std::string describe(int status) {
  if (WIFSIGNALED(status)) {
    return fmt::format("signal {}", WTERMSIG(status));
  }
  return fmt::format("exit code {}", WEXITSTATUS(status));
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& arguments, const fs::path& output) {
  if (::access(arguments[0].c_str(), X_OK) != 0) {
    return not_found("cannot start {}: {}", arguments[0], std::strerror(errno));
  }
  const int log = ::open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (log < 0) {
    return failed_precondition("cannot write {}: {}", output.string(), std::strerror(errno));
  }
  std::vector<char*> pointers;
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));  // execv does not write to it
  }
  pointers.push_back(nullptr);
  const std::vector<char*> environment = environment_for_child();
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) {
    become(pointers.data(), environment.data(), log, parent);
  }
  const int error = errno;
  ::close(log);
  if (pid < 0) {
    return resource_exhausted("cannot start {}: {}", arguments[0], std::strerror(error));
  }
  return ChildProcess(pid);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), end_(std::move(other.end_)) {}

ChildProcess::~ChildProcess() {
  kill();
}

std::optional<std::string> ChildProcess::ended() {
  int status = 0;
  if (pid_ > 0 && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    pid_ = -1;
    end_ = describe(status);
  }
  return end_;
}

void ChildProcess::kill() {
  if (pid_ > 0 && !ended()) {
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    end_ = "killed";
  }
}

}  // namespace lightmill::cli
