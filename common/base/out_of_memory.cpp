#include "common/base/out_of_memory.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <exception>
#include <new>
#include <string>
#include <system_error>

#include "common/base/openjd.h"
#include "common/base/sanitizers.h"

namespace lightmill {
namespace {

/// If less memory than this is left, an abort or a null pointer counts as out of memory. Libraries allocate blocks of
/// about this size.
constexpr rlim_t kNearlyAll = rlim_t{128} << 20;

/// Address space for each heap of the C library. A heap reserves 64 MiB.
constexpr rlim_t kPerHeap = rlim_t{1} << 30;

/// The last message, prepared while there is memory.
std::string last_words, last_output;
int last_code = 1;
std::atomic<bool> has_ended = false;

/// The exception of a failed allocation. It counts its living objects.
class FailedAllocation final : public std::bad_alloc {
 public:
  FailedAllocation() { ++alive_; }
  FailedAllocation(const FailedAllocation& other) : std::bad_alloc(other) { ++alive_; }
  FailedAllocation& operator=(const FailedAllocation&) = default;
  ~FailedAllocation() override { --alive_; }
  static int alive() { return alive_; }

 private:
  static inline std::atomic<int> alive_ = 0;
};

rlim_t limit_of(__rlimit_resource_t resource) {
  rlimit limit{};
  return ::getrlimit(resource, &limit) == 0 ? limit.rlim_cur : RLIM_INFINITY;
}

std::string allowed_text() {
  const rlim_t limit = limit_of(RLIMIT_AS);
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
  // An exception is leaving a noexcept function. GCC may not tell which exception it is.
  if (std::uncaught_exceptions() > 0 && FailedAllocation::alive() > 0) {
    return true;
  }
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

/// Whether little is left of the address space (ulimit -v) or of the data (ulimit -d). Allocates nothing.
bool is_memory_nearly_used() {
  std::array<char, 128> text{};
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  const ssize_t size = file < 0 ? -1 : ::read(file, text.data(), text.size() - 1);
  if (file >= 0) {
    ::close(file);
  }
  // In pages: address space, resident, shared, code, 0, data and stack.
  std::array<rlim_t, 6> pages{};
  char* next = text.data();
  for (rlim_t& number : pages) {
    number = size <= 0 ? 0 : std::strtoull(next, &next, 10);
  }
  const auto page_bytes = static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
  const auto is_used = [&](rlim_t used, rlim_t limit) {
    return limit != RLIM_INFINITY && used * page_bytes + kNearlyAll > limit;
  };
  return is_used(pages[0], limit_of(RLIMIT_AS)) || is_used(pages[5], limit_of(RLIMIT_DATA));
}

extern "C" void on_crash(int signal) {
  if (is_memory_nearly_used()) {
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
  // Otherwise the heaps of a few threads take the addresses that the stacks of other threads need. gRPC hangs if it
  // cannot start a thread.
  if (const rlim_t limit = limit_of(RLIMIT_AS); limit != RLIM_INFINITY) {
    ::mallopt(M_ARENA_MAX, static_cast<int>(std::clamp<rlim_t>(limit / kPerHeap, 1, 1'000)));
  }
  static const std::terminate_handler before = std::get_terminate();
  std::set_terminate([] {
    if (wants_memory()) {
      end_now();
    }
    before();
  });
  std::set_new_handler([] { throw FailedAllocation(); });
  std::signal(SIGABRT, on_crash);
  if (!kSanitized) {                 // a sanitizer reports the place
    std::signal(SIGSEGV, on_crash);  // libraries that do not check what they allocate
  }
}

}  // namespace lightmill
