#include "decoder/confined_child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>

#include "common/base/number_text.h"
#include "common/base/sanitizers.h"

namespace lightmill {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kAnswerDescriptor = 5;
constexpr int kFirstFreeDescriptor = 6;
constexpr int kAbove = 10;  ///< above the numbers to which descriptors are moved

/// Bytes of address space when the child started.
std::uint64_t address_space_at_start = 0;

std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

[[noreturn]] void answer(const DecodeReply& reply) {
  [[maybe_unused]] const ssize_t written = ::write(kAnswerDescriptor, &reply, sizeof(reply));
  ::_exit(written == static_cast<ssize_t>(sizeof(reply)) ? 0 : 1);
}

/// Reply code for a forbidden system call. The reply has the call's number, and only the parent makes a text of it.
constexpr std::int32_t kForbiddenCall = -1;
void forbidden_call(int, siginfo_t* info, void*) {
  static DecodeReply reply;
  reply.code = kForbiddenCall;
  reply.width = info->si_syscall;
  answer(reply);
}

/// A limit that cannot be set is omitted, because the rest of the sandbox holds.
void limit(__rlimit_resource resource, std::uint64_t soft, std::uint64_t hard) {
  const rlimit value{soft, hard};
  ::setrlimit(resource, &value);
}

/// Closes all descriptors but the child's own.
bool keep_descriptors(const std::array<int, 2>& given, int answers) {
  std::array<int, 3> kept{given[0], given[1], answers};
  for (int& descriptor : kept) {
    descriptor = ::fcntl(descriptor, F_DUPFD, kAbove);
  }
  const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const int last_standard = kSanitized ? STDOUT_FILENO : STDERR_FILENO;  // so that reports of sanitizers are visible
  bool moved = null >= 0;
  for (int standard = STDIN_FILENO; standard <= last_standard; ++standard) {
    moved = moved && ::dup2(null, standard) >= 0;
  }
  for (int i = 0; i < 3; ++i) {
    moved = moved && ::dup2(kept[static_cast<std::size_t>(i)], kFileDescriptor + i) >= 0;
  }
  if (moved) {
    ::closefrom(kFirstFreeDescriptor);
  }
  return moved;
}

Status confine(const Confinement& confinement, const ChildLimits& limits, const std::array<int, 2>& given,
               int answers) {
  if (!keep_descriptors(given, answers)) {
    return resource_exhausted("cannot set up the descriptors of the sandbox: {}", std::strerror(errno));
  }
  if (!kSanitized) {  // the shadow memory of sanitizers exceeds any limit
    const std::uint64_t most = address_space_at_start + limits.most_memory_bytes;
    limit(RLIMIT_AS, std::min(address_space_at_start + limits.memory_bytes, most), most);
  }
  limit(RLIMIT_FSIZE, limits.file_bytes, limits.file_bytes);
  limit(RLIMIT_CORE, 0, 0);
  ::prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
  struct sigaction action {};
  action.sa_sigaction = forbidden_call;
  action.sa_flags = SA_SIGINFO;
  ::sigaction(SIGSYS, &action, nullptr);
  const Status installed = confinement.filter.install();
  return confinement.unsandboxed ? ok_status() : installed;
}

[[noreturn]] void be_child(const Confinement& confinement, const ChildLimits& limits, pid_t parent,
                           const std::array<int, 2>& given, int answers, const std::function<DecodeReply()>& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) {
    ::_exit(1);
  }
  const Status confined = confine(confinement, limits, given, answers);
  if (!confined.ok()) {
    const bool refused = confined.code() == StatusCode::kFailedPrecondition;
    answer(error_reply(refused ? failed_precondition("{}; allow seccomp, or trust the senders of scenes and give "
                                                     "--unsandboxed-images",
                                                     message_of(confined))
                               : confined));
  }
  DecodeReply reply;
  try {
    reply = work();
  } catch (const std::bad_alloc&) {
    reply = error_reply(resource_exhausted("decoding it needs more memory than its limit of {}; {}",
                                           human_bytes(limits.most_memory_bytes), limits.words.smaller));
  } catch (const std::exception& error) {
    reply = error_reply(
        invalid_argument("{} cannot be decoded: {}; {}", limits.words.what, error.what(), limits.words.again));
  }
  answer(reply);
}

/// Whether the whole reply arrived in time.
enum class ReplyOutcome { yes, ended, late, unwanted };
ReplyOutcome read_reply(int answers, int asker, Clock::time_point until, DecodeReply& reply) {
  std::size_t got = 0;
  while (got < sizeof(reply)) {
    std::array<pollfd, 2> ready{pollfd{answers, POLLIN, 0}, pollfd{asker, POLLRDHUP, 0}};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    const int polled = ::poll(ready.data(), ready.size(), static_cast<int>(std::max<std::int64_t>(left, 0)));
    if (polled == 0) {
      return ReplyOutcome::late;
    }
    if (polled > 0 && ready[1].revents != 0) {
      return ReplyOutcome::unwanted;
    }
    if (polled > 0) {
      const ssize_t more = ::read(answers, reinterpret_cast<char*>(&reply) + got, sizeof(reply) - got);
      if (more <= 0) {
        return ReplyOutcome::ended;
      }
      got += static_cast<std::size_t>(more);
    }
  }
  return ReplyOutcome::yes;
}

Status why_no_reply(ReplyOutcome outcome, int status, const ChildLimits& limits) {
  const char* const advice = limits.words.otherwise;
  if (outcome == ReplyOutcome::late) {
    return resource_exhausted("decoding it takes more than {} s; {}",
                              std::chrono::duration<double>(limits.time).count(), advice);
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) {
    return resource_exhausted("its decoder was killed, perhaps because the machine has no memory left; {}", advice);
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ) {
    return resource_exhausted("its decoder writes more than its limit of {}; {}", human_bytes(limits.file_bytes),
                              advice);
  }
  return WIFSIGNALED(status)
             ? invalid_argument("its decoder crashes (signal {}, {}); {}", WTERMSIG(status),
                                ::strsignal(WTERMSIG(status)), advice)
             : invalid_argument("its decoder ends without an answer (exit code {}); {}", WEXITSTATUS(status), advice);
}

}  // namespace

void grow_memory(std::uint64_t memory_bytes) {
  rlimit value{};
  if (!kSanitized && ::getrlimit(RLIMIT_AS, &value) == 0) {
    value.rlim_cur = std::min<rlim_t>(address_space_at_start + memory_bytes, value.rlim_max);
    ::setrlimit(RLIMIT_AS, &value);
  }
}

DecodeReply run_confined(const Confinement& confinement, const ChildLimits& limits,
                         const std::array<int, 2>& descriptors, const std::function<DecodeReply()>& work) {
  while (::waitpid(-1, nullptr, WNOHANG) > 0) {  // earlier children have replied, and have ended or will soon
  }
  const auto close_all = [](const std::array<int, 2>& all) {
    ::close(all[0]);
    ::close(all[1]);
  };
  std::array<int, 2> answers{};
  if (::pipe2(answers.data(), O_CLOEXEC) != 0) {
    const int error = errno;
    close_all(descriptors);
    return error_reply(resource_exhausted("cannot create a pipe for its decoder: {}", std::strerror(error)));
  }
  address_space_at_start = address_space();
  if (address_space_at_start == 0) {
    close_all(descriptors);
    close_all(answers);
    return error_reply(failed_precondition("cannot decode it: the decoder cannot read /proc/self/statm"));
  }
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    be_child(confinement, limits, parent, descriptors, answers[1], work);
  }
  const int error = errno;
  close_all(descriptors);
  ::close(answers[1]);
  if (child < 0) {
    ::close(answers[0]);
    return error_reply(resource_exhausted("cannot start a process for its decoder: {}", std::strerror(error)));
  }
  DecodeReply reply;
  const ReplyOutcome outcome = read_reply(answers[0], confinement.asker, Clock::now() + limits.time, reply);
  ::close(answers[0]);
  ::kill(child, SIGKILL);  // no effect on an ended child; a child that only closed its pipe would run on
  if (outcome != ReplyOutcome::yes) {
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return error_reply(why_no_reply(outcome, status, limits));
  }
  if (reply.code == kForbiddenCall) {
    return error_reply(
        invalid_argument("its decoder was stopped: it tried the system call {}, which decoding does not need; {}",
                         system_call_name(reply.width), limits.words.again));
  }
  return reply;
}

}  // namespace lightmill
