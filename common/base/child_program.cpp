#include "common/base/child_program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <string_view>
#include <vector>

namespace lightmill {
namespace {

constexpr int kFirstOtherDescriptor = 3;

std::vector<char*> environment_of(const ChildProgram& child) {
  static char bind_now[] = "LD_BIND_NOW=1";
  std::vector<char*> variables;
  if (child.bind_now) {
    variables.push_back(bind_now);
  }
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    if (text.starts_with("LD_LIBRARY_PATH=") || text.substr(0, text.find('=')).ends_with("SAN_OPTIONS")) {
      variables.push_back(*variable);
    }
  }
  variables.push_back(nullptr);
  return variables;
}

}  // namespace

Result<pid_t> start_child(const ChildProgram& child) {
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  for (const auto& [from, to] : {std::pair{child.input, STDIN_FILENO}, std::pair{child.output, STDOUT_FILENO}}) {
    if (from >= 0) {
      ::posix_spawn_file_actions_adddup2(&files, from, to);
    } else {
      ::posix_spawn_file_actions_addopen(&files, to, "/dev/null", O_RDWR, 0);
    }
  }
  ::posix_spawn_file_actions_addclosefrom_np(&files, kFirstOtherDescriptor);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t signals;
  ::sigemptyset(&signals);
  ::posix_spawnattr_setsigmask(&attributes, &signals);
  ::sigfillset(&signals);
  ::posix_spawnattr_setsigdefault(&attributes, &signals);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::string program = child.path.string(), option = child.option == nullptr ? "" : child.option;
  const std::array<char*, 3> arguments{program.data(), child.option == nullptr ? nullptr : option.data(), nullptr};
  std::vector<char*> environment = environment_of(child);
  pid_t pid = 0;
  const int error = ::posix_spawn(&pid, program.c_str(), &files, &attributes, arguments.data(), environment.data());
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  if (error != 0) {
    return failed_precondition("cannot start {}: {}. Install it beside this program", program, std::strerror(error));
  }
  return pid;
}

std::string end_text(int status) {
  return WIFSIGNALED(status) ? fmt::format("signal {}, {}", WTERMSIG(status), ::strsignal(WTERMSIG(status)))
                             : fmt::format("exit code {}", WEXITSTATUS(status));
}

}  // namespace lightmill
