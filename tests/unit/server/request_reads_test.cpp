#include "server/api/request_reads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/step_clock.h"

namespace lightmill {
namespace {

/// A call that counts what happens to it.
struct TestCall {
  TestCall(RequestReads& reads, const std::string& caller)
      : turn(reads.add(
            {caller, "10.0.0.7"}, [this] { ++begun; }, [this] { ++given_up; })) {}
  ~TestCall() { turn->end(); }
  int begun = 0, given_up = 0;
  const std::shared_ptr<ReadTurn> turn;
};

class RequestReadsTest : public ::testing::Test {
 protected:
  TestCall& call(const std::string& caller) {
    TestCall& made = *calls_.emplace_back(std::make_unique<TestCall>(reads, caller));
    made.turn->begin();
    return made;
  }

  test::StepClock clock;
  RequestReads reads{4, 20, clock};

 private:
  std::vector<std::unique_ptr<TestCall>> calls_;
};

TEST_F(RequestReadsTest, OneCallerReadsHalfOfThemAtATime) {
  TestCall& first = call("ada");
  TestCall& second = call("ada");
  TestCall& third = call("ada");
  TestCall& fourth = call("ada");
  EXPECT_EQ(std::tie(first.begun, second.begun, third.begun), std::tuple(1, 1, 0));
  EXPECT_FALSE(second.turn->end()) << "it was read";
  EXPECT_EQ(std::tie(third.begun, fourth.begun), std::tuple(1, 0)) << "the first that waits is next";
  EXPECT_EQ(first.given_up + second.given_up + third.given_up, 0);
}

TEST_F(RequestReadsTest, ACallThatEndsBeforeItsTurnIsNotRead) {
  TestCall& first = call("ada");
  call("ada");
  TestCall& third = call("ada");
  TestCall& fourth = call("ada");
  EXPECT_TRUE(third.turn->end());
  EXPECT_FALSE(first.turn->end());
  EXPECT_EQ(std::tie(third.begun, fourth.begun), std::tuple(0, 1));
  EXPECT_FALSE(first.turn->end()) << "a second time";
  third.turn->begin();
  EXPECT_FALSE(fourth.turn->end());
  EXPECT_EQ(third.begun, 1) << "its next message";
}

TEST_F(RequestReadsTest, AReadThatTakesLongGivesWay) {
  TestCall& first = call("ada");
  TestCall& second = call("ada");
  clock.pass(SlotPool::kTimeout / 2);
  TestCall& third = call("ada");
  EXPECT_EQ(first.given_up, 0);
  clock.pass(SlotPool::kTimeout / 2);
  TestCall& fourth = call("ada");
  EXPECT_EQ(std::tie(first.given_up, second.given_up), std::tuple(1, 1));
  EXPECT_EQ(std::tie(third.begun, fourth.begun), std::tuple(1, 1));
  EXPECT_FALSE(first.turn->end());
  EXPECT_EQ(third.given_up + fourth.given_up, 0);
}

TEST_F(RequestReadsTest, OneCallerHasHalfOfThePlacesToWait) {
  for (int i = 0; i < 12; ++i) {
    call("ada");
  }
  TestCall one_more(reads, "ada");
  EXPECT_FALSE(one_more.turn->begin());
  EXPECT_TRUE(one_more.turn->end());
  EXPECT_EQ(call("bob").begun, 1);
}

TEST_F(RequestReadsTest, AnotherCallerNeedNotWait) {
  std::vector<TestCall*> taken;
  for (const char* caller : {"ada", "ada", "bob", "bob"}) {
    taken.push_back(&call(caller));
  }
  TestCall& eve = call("eve");
  EXPECT_EQ(eve.begun, 1);
  int given_up = 0;
  for (const TestCall* each : taken) {
    given_up += each->given_up;
  }
  EXPECT_EQ(given_up, 1);
}

TEST_F(RequestReadsTest, ManyThreadsNeverExceedTheLimit) {
  std::atomic<int> reading = 0, most = 0, read = 0;
  constexpr int kThreads = 8, kCalls = 300;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] {
        for (int n = 0; n < kCalls; ++n) {
          std::atomic<bool> counted = false, over = false;
          const auto leave = [&] { reading -= counted.exchange(false) ? 1 : 0; };
          const auto turn = reads.add(
              {fmt::format("caller {}", i % 4), "10.0.0.7"},
              [&] {
                counted = true;
                const int now = ++reading;
                for (int before = most; now > before && !most.compare_exchange_weak(before, now);) {
                }
                ++read;
                over = true;
              },
              [&] {
                leave();
                over = true;
              });
          turn->begin();
          while (!over) {
            std::this_thread::yield();
          }
          std::this_thread::sleep_for(std::chrono::microseconds(100));
          leave();
          turn->end();
        }
      });
    }
  }
  EXPECT_EQ(reading, 0);
  EXPECT_GT(read, kThreads * kCalls / 2);
  EXPECT_LE(most, 4);
  EXPECT_GE(most, 2);
}

}  // namespace
}  // namespace lightmill
