#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/base/check.h"

namespace lightmill::test {
namespace {

constexpr int kExecFailed = 127;

int exit_code_of(int status) {
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

/// Forks and runs the program. Its output goes to the two descriptors.
pid_t spawn(const std::vector<std::string>& arguments, const Environment& environment, int out, int err) {
  std::vector<char*> pointers;
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));
  }
  pointers.push_back(nullptr);
  const pid_t pid = ::fork();
  LM_CHECK(pid >= 0);
  if (pid > 0) {
    return pid;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const auto& [name, value] : environment) {
    value.empty() ? ::unsetenv(name.c_str()) : ::setenv(name.c_str(), value.c_str(), 1);
  }
  const int null = ::open("/dev/null", O_RDONLY);
  ::dup2(null, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  ::execv(pointers[0], pointers.data());
  ::_exit(kExecFailed);
}

}  // namespace

CommandResult run_command(const std::vector<std::string>& arguments, const Environment& environment,
                          std::chrono::seconds limit) {
  std::array<int, 2> out{}, err{};
  LM_CHECK(::pipe2(out.data(), O_CLOEXEC) == 0 && ::pipe2(err.data(), O_CLOEXEC) == 0);
  const pid_t pid = spawn(arguments, environment, out[1], err[1]);
  ::close(out[1]);
  ::close(err[1]);
  CommandResult result;
  std::array<pollfd, 2> sources{pollfd{out[0], POLLIN, 0}, pollfd{err[0], POLLIN, 0}};
  const std::array<std::string*, 2> texts{&result.out, &result.err};
  const auto until = std::chrono::steady_clock::now() + limit;
  while (sources[0].fd >= 0 || sources[1].fd >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    if (left.count() <= 0 || ::poll(sources.data(), sources.size(), static_cast<int>(left.count())) == 0) {
      ::kill(pid, SIGKILL);
      break;
    }
    for (std::size_t i = 0; i < sources.size(); ++i) {
      std::array<char, 4096> buffer;
      if (sources[i].fd >= 0 && sources[i].revents != 0) {
        const ssize_t got = ::read(sources[i].fd, buffer.data(), buffer.size());
        if (got > 0) {
          texts[i]->append(buffer.data(), static_cast<std::size_t>(got));
        } else {
          sources[i].fd = -1;
        }
      }
    }
  }
  ::close(out[0]);
  ::close(err[0]);
  int status = 0;
  const bool ended =
      eventually([&] { return ::waitpid(pid, &status, WNOHANG) == pid; },
                 std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now()));
  if (!ended) {  // it has closed its output, and hangs
    ::kill(pid, SIGKILL);
    ::waitpid(pid, &status, 0);
  }
  result.exit_code = exit_code_of(status);
  return result;
}

BackgroundProcess::BackgroundProcess(const std::vector<std::string>& arguments, const std::string& log,
                                     const Environment& environment) {
  const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  LM_CHECK(file >= 0, "{}", log);
  pid_ = spawn(arguments, environment, file, file);
  ::close(file);
}

BackgroundProcess::~BackgroundProcess() {
  send(SIGKILL);
  wait();
}

void BackgroundProcess::send(int signal) const {
  if (!exit_code_) {
    ::kill(pid_, signal);
    if (signal == SIGSTOP) {
      siginfo_t stopped;
      ::waitid(P_PID, static_cast<id_t>(pid_), &stopped, WSTOPPED | WEXITED | WNOWAIT);
    }
  }
}

std::optional<int> BackgroundProcess::wait(std::chrono::milliseconds limit) {
  eventually(
      [&] {
        int status = 0;
        if (!exit_code_ && ::waitpid(pid_, &status, WNOHANG) == pid_) {
          exit_code_ = exit_code_of(status);
        }
        return exit_code_.has_value();
      },
      limit);
  return exit_code_;
}

std::vector<pid_t> processes_with(const std::string& name, const std::string& value) {
  const std::string wanted = name + "=" + value;
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string number = entry.path().filename().string();
    pid_t pid = 0;
    if (std::from_chars(number.data(), number.data() + number.size(), pid).ec != std::errc()) {
      continue;
    }
    std::ifstream file(entry.path() / "environ", std::ios::binary);  // empty for zombies and for processes of others
    const std::string all((std::istreambuf_iterator<char>(file)), {});
    if (('\0' + all).find('\0' + wanted + '\0') != std::string::npos) {
      found.push_back(pid);
    }
  }
  return found;
}

}  // namespace lightmill::test
