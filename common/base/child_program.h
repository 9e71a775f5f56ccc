// Launcher of Lightmill programs that read untrusted files.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "common/base/status.h"

namespace lightmill {

struct ChildProgram {
  std::filesystem::path path;
  const char* option = nullptr;  ///< the only argument; null: none
  int input = -1, output = -1;   ///< descriptors for its standard streams; −1: /dev/null
  bool bind_now = false;         ///< it resolves all symbols at its start, so that its own children need not
};

/// Starts the program. FAILED_PRECONDITION if that is impossible.
///
/// It inherits standard error and no other descriptors. Its environment has only the variables of the loader and of
/// sanitizers, because others may be secrets. All signals have their defaults. It has its own process group, so that
/// Ctrl-C in a terminal reaches only the caller.
Result<pid_t> start_child(const ChildProgram& child);

/// How a process ended, from the status of waitpid: "signal 9, Killed" or "exit code 1".
std::string end_text(int status);

}  // namespace lightmill
