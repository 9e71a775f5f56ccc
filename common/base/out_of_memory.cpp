#include "common/base/out_of_memory.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <system_error>

#include "common/base/openjd.h"

namespace lightmill {
namespace {

/// An abort with less address space left than this counts as out of memory. Libraries ask for as much at once.
constexpr rlim_t kNearlyAll = rlim_t{128} << 20;

/// Prepared while there is memory.
std::string last_words, last_output;
int last_code = 1;
std::atomic<bool> has_ended = false;

rlim_t address_space_limit() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_AS, &limit) == 0 ? limit.rlim_cur : RLIM_INFINITY;
}

std::string allowed_text() {
  const rlim_t limit = address_space_limit();
  return limit == RLIM_INFINITY ? "this process may have (its control group, or the machine)"
                                : fmt::format("the {} MiB that this process may have (ulimit -v)", limit >> 20);
}

/// Allocates nothing.
[[noreturn]] void end_now() {
  if (!has_ended.exchange(true)) {
    (void)!::write(STDERR_FILENO, last_words.data(), last_words.size());
    (void)!::write(STDOUT_FILENO, last_output.data(), last_output.size());
  }
  ::_exit(last_code);
}

/// Whether the uncaught exception means out of memory. Threads need memory for their stacks.
bool wants_memory() {
  try {
    if (const std::exception_ptr thrown = std::current_exception()) {
      std::rethrow_exception(thrown);
    }
  } catch (const std::bad_alloc&) {
    return true;
  } catch (const std::system_error& error) {
    return error.code() == std::errc::resource_unavailable_try_again || error.code() == std::errc::not_enough_memory;
  } catch (...) {
  }
  return false;
}

/// Bytes of address space in use. 0 if they cannot be read. Allocates nothing.
rlim_t used_address_space() {
  std::array<char, 64> text{};
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  const ssize_t size = file < 0 ? -1 : ::read(file, text.data(), text.size() - 1);
  if (file >= 0) {
    ::close(file);
  }
  return size <= 0 ? 0 : std::strtoull(text.data(), nullptr, 10) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

extern "C" void on_abort(int signal) {
  const rlim_t limit = address_space_limit();
  if (limit != RLIM_INFINITY && used_address_space() + kNearlyAll > limit) {
    end_now();
  }
  std::signal(signal, SIG_DFL);
  (void)std::raise(signal);
}

}  // namespace

Status out_of_memory(std::string_view what) {
  return resource_exhausted("{} needs more memory than {}: run it on a machine with more memory", what, allowed_text());
}

void exit_on_out_of_memory(std::string_view program, int exit_code, bool openjd) {
  const std::string message = message_of(out_of_memory("it"));
  last_words = fmt::format("{}: {}\n", program, message);
  last_output = openjd ? openjd_fail(message) + "\n" : "";
  last_code = exit_code;
  static const std::terminate_handler before = std::get_terminate();
  std::set_terminate([] {
    if (wants_memory()) {
      end_now();
    }
    before();
  });
  std::signal(SIGABRT, on_abort);
}

}  // namespace lightmill
