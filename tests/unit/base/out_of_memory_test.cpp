// The end of a program that cannot get the memory it needs.
#include "common/base/out_of_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "common/base/sanitizers.h"

namespace lightmill {
namespace {

/// Limits the address space of this process to `bytes`, including what it already has.
void limit_address_space(rlim_t bytes) {
  const rlimit limit{bytes, RLIM_INFINITY};
  ASSERT_EQ(::setrlimit(RLIMIT_AS, &limit), 0);
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

TEST(MemoryEnd, AFailedThreadStartCountsAsOutOfMemory) {
  EXPECT_EXIT(
      end_in_a_thread([] { throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)); }),
      ::testing::ExitedWithCode(7), "^program: it needs more memory");
}

TEST(MemoryEnd, OtherExceptionsAbortAsBefore) {
  EXPECT_EXIT(end_in_a_thread([] { throw std::runtime_error("a mistake"); }), ::testing::KilledBySignal(SIGABRT),
              "a mistake");
}

TEST(MemoryEnd, AnAbortWithAFullAddressSpaceCountsAsOutOfMemory) {
  if (kSanitized) {
    GTEST_SKIP() << "a sanitizer takes all addresses";
  }
  const auto abort_with = [](rlim_t bytes) {
    limit_address_space(bytes);
    exit_on_out_of_memory("program", 7);
    std::abort();
  };
  EXPECT_EXIT(abort_with(rlim_t{64} << 20), ::testing::ExitedWithCode(7),
              "^program: it needs more memory than the 64 MiB that this process may have \\(ulimit -v\\)");
  EXPECT_EXIT(abort_with(rlim_t{1} << 40), ::testing::KilledBySignal(SIGABRT), "^$");
  EXPECT_EXIT(abort_with(RLIM_INFINITY), ::testing::KilledBySignal(SIGABRT), "^$");
}

TEST(MemoryEnd, TheErrorNamesTheConsumer) {
  const Status status = out_of_memory("a.json: reading it");
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(status).find("a.json: reading it needs more memory than "), 0u) << status;
}

}  // namespace
}  // namespace lightmill
