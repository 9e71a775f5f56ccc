#include "tests/support/process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
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
#include <iostream>
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

namespace {

constexpr std::array kFaults{"WARNING: ThreadSanitizer", "ERROR: AddressSanitizer", "ERROR: LeakSanitizer",
                             ": runtime error: ",        ": check failed: ",        "terminate called"};
constexpr std::size_t kShownOfLog = 4000;  // bytes

/// The file from `begin` to its end.
std::string read_from(int file, off_t begin) {
  std::string text;
  std::array<char, 1 << 16> piece;
  for (ssize_t got = 0;
       (got = ::pread(file, piece.data(), piece.size(), begin + static_cast<off_t>(text.size()))) > 0;) {
    text.append(piece.data(), static_cast<std::size_t>(got));
  }
  return text;
}

/// Fails the test. Fails the program if no test runs, because a failure would have no effect there.
void fail(const std::string& why) {
  ADD_FAILURE() << why;
  if (::testing::UnitTest::GetInstance()->current_test_suite() == nullptr) {
    std::cout.flush();
    std::_Exit(EXIT_FAILURE);
  }
}

}  // namespace

BackgroundProcess::BackgroundProcess(const std::vector<std::string>& arguments, const std::string& log,
                                     const Environment& environment)
    : program_(arguments.front()), log_(::open(log.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0600)) {
  LM_CHECK(log_ >= 0, "{}", log);
  log_begin_ = ::lseek(log_, 0, SEEK_END);
  pid_ = spawn(arguments, environment, log_, log_);
}

BackgroundProcess::~BackgroundProcess() {
  if (const char* limit_ms = std::getenv("LIGHTMILL_LEAVE_MS"); limit_ms != nullptr && runs()) {
    send(SIGTERM);
    send(SIGCONT);  // it may be stopped
    wait(std::chrono::milliseconds(std::atoi(limit_ms)));
  }
  send(SIGKILL);
  eventually([this] { return !runs(); });
  const std::string why = crash();
  ::close(log_);
  if (!why.empty()) {
    fail(program_ + ' ' + why);
  }
}

bool BackgroundProcess::runs() {
  int status = 0;
  if (!end_ && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    end_ = status;
  }
  return !end_;
}

void BackgroundProcess::send(int signal) {
  if (runs()) {
    sent_.insert(signal);
    ::kill(pid_, signal);
    if (signal == SIGSTOP) {
      siginfo_t stopped;
      ::waitid(P_PID, static_cast<id_t>(pid_), &stopped, WSTOPPED | WEXITED | WNOWAIT);
    }
  }
}

std::optional<int> BackgroundProcess::wait(std::chrono::milliseconds limit) {
  if (!eventually([this] { return !runs(); }, limit)) {
    return {};
  }
  asked_ = true;
  return exit_code_of(*end_);
}

std::string BackgroundProcess::crash() const {
  const std::string log = read_from(log_, log_begin_);
  for (const char* const fault : kFaults) {
    if (const std::size_t at = log.find(fault); !faults_allowed_ && at != std::string::npos) {
      return "reports a fault: " + log.substr(at, kShownOfLog);
    }
  }
  const std::string tail = ":\n" + log.substr(log.size() - std::min(log.size(), kShownOfLog));
  if (!end_) {
    return "has not ended" + tail;
  }
  if (WIFSIGNALED(*end_)) {
    return sent_.contains(WTERMSIG(*end_)) ? "" : fmt::format("was ended by signal {}{}", WTERMSIG(*end_), tail);
  }
  return asked_ || WEXITSTATUS(*end_) == 0 ? "" : fmt::format("ended with code {}{}", WEXITSTATUS(*end_), tail);
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
