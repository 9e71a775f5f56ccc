// Limits of a child that decodes an image, tested with children that try to do more.
#include "decoder/confined_child.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/base/sanitizers.h"

namespace lightmill::test {
namespace {

constexpr std::uint64_t kMemory = std::uint64_t{64} << 20;

[[noreturn]] void spin() {
  for (;;) {
    asm volatile("");
  }
}

class ConfinedChild : public ::testing::Test {
 protected:
  ~ConfinedChild() override { ::close(file_); }
  DecodeReply reply_of(const std::function<DecodeReply()>& work) {
    return run_confined({*filter_, false, -1}, limits_, {::dup(file_), ::dup(file_)}, work);
  }
  /// The error's text, for work that must not finish.
  std::string text_of(const std::function<void()>& work) {
    return reply_of([&] {
             work();
             return DecodeReply{};
           })
        .text.data();
  }

  const Result<SystemCallFilter> filter_ = SystemCallFilter::make();
  ChildLimits limits_{kMemory, 2 * kMemory, 4096, std::chrono::seconds(20)};
  const int file_ = ::memfd_create("file", MFD_CLOEXEC);
};

TEST_F(ConfinedChild, GivesItsReply) {
  const DecodeReply reply = reply_of([] {
    DecodeReply own;
    own.width = 7;
    return own;
  });
  EXPECT_EQ(reply.code, 0);
  EXPECT_EQ(reply.width, 7);
}

TEST_F(ConfinedChild, AForbiddenSystemCallEndsItAndIsNamed) {
  const std::string end = ", which decoding does not need; save the image again";
  char* const arguments[] = {nullptr};
  const std::vector<std::pair<std::string, std::function<void()>>> attempts{
      {"openat", [] { ::open("/etc/hostname", O_RDONLY); }},
      {"socket", [] { ::socket(AF_INET, SOCK_STREAM, 0); }},
      {"connect", [] { ::connect(kPixelDescriptor, nullptr, 0); }},
      {"execve", [&] { ::execve("/bin/true", arguments, arguments); }},
      {"ptrace", [] { ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr); }},
      {"kill", [] { ::kill(::getpid(), SIGTERM); }},
      {"unlink", [] { ::unlink("/nowhere"); }},
      {"prctl", [] { ::prctl(PR_SET_DUMPABLE, 1, 0, 0, 0); }},
      {"rt_sigaction", [] { ::syscall(SYS_rt_sigaction, SIGSYS, nullptr, nullptr, 8); }},
      {"mmap", [] { ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); }},
  };
  for (const auto& [call, attempt] : attempts) {
    EXPECT_EQ(text_of(attempt), "its decoder was stopped: it tried the system call " + call + end);
  }
  EXPECT_NE(text_of([] { ::fork(); }).find("it tried the system call clone"), std::string::npos);
}

TEST_F(ConfinedChild, HasNoOtherOpenDescriptors) {
  const int secret = ::open("/dev/zero", O_RDONLY);
  ASSERT_GE(secret, 0);
  const DecodeReply reply = reply_of([] {
    DecodeReply own;
    char byte = 0;
    for (int descriptor = 6; descriptor < 1024; ++descriptor) {
      own.width += ::read(descriptor, &byte, 1) >= 0 || errno != EBADF ? 1 : 0;
    }
    own.height = static_cast<std::int32_t>(::read(0, &byte, 1));  // the end of /dev/null
    return own;
  });
  ::close(secret);
  EXPECT_EQ(reply.code, 0) << reply.text.data();
  EXPECT_EQ(reply.width, 0);
  EXPECT_EQ(reply.height, 0);
}

TEST_F(ConfinedChild, HasALimitOfMemoryThatItCannotRaise) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers have more address space than any limit";
  }
  const auto take = [](std::uint64_t bytes) {
    return [bytes] {
      const std::vector<char> memory(bytes, 1);
      DecodeReply own;
      own.width = memory[bytes - 1];
      return own;
    };
  };
  EXPECT_EQ(reply_of(take(kMemory / 2)).width, 1);
  EXPECT_STREQ(reply_of(take(kMemory)).text.data(),
               "decoding it needs more memory than its limit of 128 MiB; save it in another format or smaller");
  const auto grown = [&](std::uint64_t bytes) {
    return reply_of([&] {
      grow_memory(100 * kMemory);
      return take(bytes)();
    });
  };
  EXPECT_EQ(grown(kMemory + kMemory / 2).width, 1);
  EXPECT_EQ(static_cast<StatusCode>(grown(2 * kMemory).code), StatusCode::kResourceExhausted);
}

TEST_F(ConfinedChild, HasATimeLimitAfterItClosedEverything) {
  limits_.time = std::chrono::milliseconds(200);
  const std::string late = "decoding it takes more than 0.2 s; save the image again, or in another format";
  EXPECT_EQ(text_of([] { spin(); }), late);
  limits_.time = std::chrono::seconds(60);
  EXPECT_NE(text_of([] {
              ::close(5);
              spin();
            }),
            "");
}

TEST_F(ConfinedChild, CannotWriteMoreThanItsLimit) {
  EXPECT_EQ(text_of([] {
              if (::ftruncate(kPixelDescriptor, 4097) != 0) {
                ::_exit(3);
              }
            }),
            "its decoder writes more than its limit of 4.00 KiB; save the image again, or in another format");
  EXPECT_EQ(reply_of([] {
              DecodeReply own;
              own.width = ::ftruncate(kPixelDescriptor, 4096) == 0 ? 1 : 0;
              return own;
            }).width,
            1);
}

TEST_F(ConfinedChild, TheErrorStatesHowItEnded) {
  EXPECT_EQ(text_of([] { ::_exit(3); }),
            "its decoder ends without an answer (exit code 3); save the image again, or in another format");
  EXPECT_EQ(text_of([] { throw std::length_error("too long"); }),
            "the image cannot be decoded: too long; save the image again");
  if (!kSanitized) {  // they catch it
    EXPECT_EQ(text_of([] { *reinterpret_cast<volatile int*>(16) = 1; }),
              "its decoder crashes (signal 11, Segmentation fault); save the image again, or in another format");
  }
}

TEST_F(ConfinedChild, EndsWithItsCaller) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()), 0);
  ::close(ends[1]);
  const DecodeReply reply = run_confined({*filter_, false, ends[0]}, limits_, {::dup(file_), ::dup(file_)}, [] {
    spin();
    return DecodeReply{};
  });
  ::close(ends[0]);
  EXPECT_NE(reply.code, 0);
}

}  // namespace
}  // namespace lightmill::test
