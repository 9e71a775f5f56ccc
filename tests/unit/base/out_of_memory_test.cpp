// The end of a program that cannot get the memory it needs.
#include "common/base/out_of_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include "common/base/sanitizers.h"

namespace lightmill {
namespace {

/// Limits a resource of this process to `bytes`, including what it already has.
void limit(__rlimit_resource_t resource, rlim_t bytes) {
  const rlimit limit{bytes, RLIM_INFINITY};
  ASSERT_EQ(::setrlimit(resource, &limit), 0);
}

template <class Work>
void end_in_a_thread(const Work& work) {
  exit_on_out_of_memory("program", 7);
  std::thread(work).join();
}

TEST(MemoryEnd, AFailedAllocationInAnyThreadEndsTheProgramWithAMessage) {
  EXPECT_EXIT(end_in_a_thread([] { throw std::bad_alloc(); }), ::testing::ExitedWithCode(7),
              "^program: it needs more memory than this process may have .*: run it on a machine with more memory\n$");
}

/// The compiler knows nothing of this size.
volatile std::size_t too_many = std::size_t{1} << 62;
void allocate_too_much() noexcept {
  ::operator delete(::operator new(too_many));
}
struct Local {
  [[gnu::noinline]] ~Local() { too_many = too_many; }
};
/// GCC cleans up, and then ends the program without telling which exception it was.
void allocate_too_much_and_catch_another_error() noexcept {
  const Local outer;
  try {
    const Local inner;
    ::operator delete(::operator new(too_many));
  } catch (const std::logic_error&) {
  }
}
struct AllocatesAtItsEnd {
  ~AllocatesAtItsEnd() { ::operator delete(::operator new(too_many)); }
};

TEST(MemoryEnd, AFailedAllocationInANoexceptFunctionEndsTheProgramWithAMessage) {
  if (kSanitized) {
    GTEST_SKIP() << "a sanitizer ends the program itself";
  }
  const auto end_here = [](const auto& work) {  // as in main(): a handler further up changes what GCC does
    exit_on_out_of_memory("program", 7);
    work();
  };
  const auto expect_words = [&](const auto& work) {
    constexpr const char* kWords = "^program: it needs more memory than ";
    EXPECT_EXIT(end_here(work), ::testing::ExitedWithCode(7), kWords);
    EXPECT_EXIT(end_in_a_thread(work), ::testing::ExitedWithCode(7), kWords);
  };
  expect_words([] { allocate_too_much(); });
  expect_words([] { allocate_too_much_and_catch_another_error(); });
  expect_words([] { const AllocatesAtItsEnd end; });
}

TEST(MemoryEnd, AnotherExceptionInANoexceptFunctionStillAborts) {
  if (kSanitized) {
    GTEST_SKIP() << "a sanitizer ends the program itself";
  }
  const auto fail = []() noexcept {
    EXPECT_THROW(::operator delete(::operator new(too_many)), std::bad_alloc);  // it was no end
    const Local outer;
    try {
      const Local inner;
      (void)std::string().at(too_many);
    } catch (const std::bad_alloc&) {
    }
  };
  EXPECT_EXIT(end_in_a_thread(fail), ::testing::KilledBySignal(SIGABRT), "");
}

TEST(MemoryEnd, AFailedThreadStartCountsAsOutOfMemory) {
  EXPECT_EXIT(
      end_in_a_thread([] { throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)); }),
      ::testing::ExitedWithCode(7), "^program: it needs more memory");
}

TEST(MemoryEnd, OtherExceptionsStillAbort) {
  EXPECT_EXIT(end_in_a_thread([] { throw std::runtime_error("a mistake"); }), ::testing::KilledBySignal(SIGABRT),
              "a mistake");
}

TEST(MemoryEnd, AnAbortOrCrashWithLittleMemoryLeftCountsAsOutOfMemory) {
  if (kSanitized) {
    GTEST_SKIP() << "a sanitizer takes all addresses";
  }
  const auto end_with = [](int signal, __rlimit_resource_t resource, rlim_t bytes) {
    limit(resource, bytes);
    exit_on_out_of_memory("program", 7);
    (void)std::raise(signal);
  };
  for (const int signal : {SIGABRT, SIGSEGV}) {
    EXPECT_EXIT(end_with(signal, RLIMIT_AS, rlim_t{64} << 20), ::testing::ExitedWithCode(7),
                "^program: it needs more memory than the 64 MiB that this process may have \\(ulimit -v\\)");
    EXPECT_EXIT(end_with(signal, RLIMIT_DATA, rlim_t{64} << 20), ::testing::ExitedWithCode(7),
                "^program: it needs more memory than this process may have");
    EXPECT_EXIT(end_with(signal, RLIMIT_AS, rlim_t{1} << 40), ::testing::KilledBySignal(signal), "^$");
    EXPECT_EXIT(end_with(signal, RLIMIT_DATA, RLIM_INFINITY), ::testing::KilledBySignal(signal), "^$");
  }
}

TEST(MemoryEnd, TheErrorNamesTheConsumer) {
  const Status status = out_of_memory("a.json: reading it");
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(status).find("a.json: reading it needs more memory than "), 0u) << status;
}

}  // namespace
}  // namespace lightmill
