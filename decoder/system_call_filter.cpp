#include "decoder/system_call_filter.h"

#include <linux/seccomp.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "common/base/sanitizers.h"

namespace lightmill {
namespace {

/// Calls that reach only the process' memory, its open descriptors, the clock and the amount of memory (qsort asks for
/// it).
constexpr std::array kAllowed{
    SCMP_SYS(read),          SCMP_SYS(pread64),        SCMP_SYS(write),        SCMP_SYS(lseek),  SCMP_SYS(fstat),
    SCMP_SYS(ftruncate),     SCMP_SYS(close),          SCMP_SYS(brk),          SCMP_SYS(munmap), SCMP_SYS(mremap),
    SCMP_SYS(madvise),       SCMP_SYS(futex),          SCMP_SYS(getrandom),    SCMP_SYS(getpid), SCMP_SYS(gettid),
    SCMP_SYS(clock_gettime), SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn), SCMP_SYS(exit),   SCMP_SYS(exit_group),
    SCMP_SYS(sysinfo),
};
/// Further calls of the runtimes of sanitizers. They use a pipe to test whether memory can be read.
constexpr std::array kAllowedToSanitizers{
    SCMP_SYS(sigaltstack), SCMP_SYS(sched_yield), SCMP_SYS(nanosleep), SCMP_SYS(clock_nanosleep),
    SCMP_SYS(getrlimit),   SCMP_SYS(pipe),        SCMP_SYS(pipe2)};

bool add_rules(scmp_filter_ctx context) {
  const auto allow = [&](int call) { return ::seccomp_rule_add(context, SCMP_ACT_ALLOW, call, 0) == 0; };
  bool all = std::ranges::all_of(kAllowed, allow);
  if (kSanitized) {
    all = all && std::ranges::all_of(kAllowedToSanitizers, allow);
  }
  // Memory that is not executable.
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)}) {
    all =
        all && ::seccomp_rule_add(context, SCMP_ACT_ALLOW, call, 1, SCMP_A2_64(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)) == 0;
  }
  // Its own memory limit, up to the hard limit.
  return all && ::seccomp_rule_add(context, SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), 2, SCMP_A0_64(SCMP_CMP_EQ, 0, 0),
                                   SCMP_A1_64(SCMP_CMP_EQ, RLIMIT_AS, 0)) == 0;
}

/// The filter in the kernel's form.
std::vector<sock_filter> steps_of(scmp_filter_ctx context) {
  const int file = ::memfd_create("filter", MFD_CLOEXEC);
  struct stat facts {};
  std::vector<sock_filter> steps;
  if (file >= 0 && ::seccomp_export_bpf(context, file) == 0 && ::fstat(file, &facts) == 0) {
    steps.resize(static_cast<std::size_t>(facts.st_size) / sizeof(sock_filter));
    const std::size_t size = steps.size() * sizeof(sock_filter);
    if (::pread(file, steps.data(), size, 0) != static_cast<ssize_t>(size)) {
      steps.clear();
    }
  }
  if (file >= 0) {
    ::close(file);
  }
  return steps;
}

}  // namespace

Result<SystemCallFilter> SystemCallFilter::make() {
  const std::unique_ptr<void, void (*)(scmp_filter_ctx)> context(::seccomp_init(SCMP_ACT_TRAP), ::seccomp_release);
  SystemCallFilter filter;
  // A system call of another architecture kills the only thread, which is libseccomp's default. Killing the process
  // would be the same, but for this libseccomp needs the system call seccomp (see install).
  if (context != nullptr && add_rules(context.get())) {
    filter.steps_ = steps_of(context.get());
  }
  if (filter.steps_.empty()) {
    return internal_error("libseccomp cannot make the filter of system calls");
  }
  return filter;
}

Status SystemCallFilter::install() const {
  const sock_fprog program{static_cast<unsigned short>(steps_.size()), const_cast<sock_filter*>(steps_.data())};
  // Not by the system call seccomp, which the filters of systemd units exclude.
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) != 0) {
    return failed_precondition("the kernel refuses the sandbox (seccomp): {}", std::strerror(errno));
  }
  return ok_status();
}

std::string system_call_name(int number) {
  const std::unique_ptr<char, void (*)(void*)> name(::seccomp_syscall_resolve_num_arch(SCMP_ARCH_NATIVE, number),
                                                    ::free);
  return name == nullptr ? fmt::format("number {}", number) : name.get();
}

}  // namespace lightmill
