// A child process with little memory.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <functional>

namespace lightmill::test {

/// The exit code of `what` in a child that can take only `bytes_more` more address space than this process has. It is
/// -1 if a signal ended the child. A child that hangs is ended after a minute.
inline int run_in_little_memory(std::uint64_t bytes_more, const std::function<int()>& what) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(60);
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit limit{};
    limit.rlim_cur = limit.rlim_max = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) + bytes_more;
    ::setrlimit(RLIMIT_AS, &limit);
    std::_Exit(what());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace lightmill::test
