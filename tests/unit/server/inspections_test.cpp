// Scene files that wait for inspection: which worker gets them, and what follows from lost workers.
#include "server/domain/inspections.h"

#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

class InspectionTest : public CoordinatorTest {
 protected:
  SessionId reader(const std::string& name, bool inspects = true) {
    const SessionId session{next_session++};
    WorkerHello hello{name, name, 1, 1, "class-a", kRendererVersion, {}, false, name, inspects};
    coordinator->worker_connected(session, hello, now, effects);
    collect();
    return session;
  }
  Result<InspectionId> ask(const std::string& caller = "ann") {
    const Result<InspectionId> id = coordinator->inspect(caller, {{}, {"box.json"}, ""}, now, effects);
    EXPECT_TRUE(effects.writes.empty()) << "an inspection is in memory alone";
    collect();
    return id;
  }
  void report(SessionId session, InspectionId id) {
    coordinator->worker_message(session, InspectReport{id, std::make_shared<const Inspection>()}, now, unix_ms(),
                                effects);
    collect();
  }
  void lose(SessionId session) {
    coordinator->worker_disconnected(session, now, effects);
    collect();
  }
  void wait(Duration time) {
    const Time until = now + time;
    while (now < until) {
      now = std::min(until, now + std::chrono::seconds(1));
      coordinator->tick(now, unix_ms(), effects);
      collect();
    }
  }
  void collect() {
    answers.insert(answers.end(), effects.inspected.begin(), effects.inspected.end());
    flush();
  }
  std::size_t grants(SessionId session) const { return got<InspectGrant>(session).size(); }
  StatusCode code(std::size_t answer) const {
    return answer < answers.size() ? answers[answer].found.status().code() : StatusCode::kUnknown;
  }

  std::vector<InspectionOutcome> answers;
};

TEST_F(InspectionTest, NeedsAWorkerThatSupportsInspections) {
  EXPECT_EQ(ask().status().code(), StatusCode::kUnavailable);
  const SessionId old = reader("old", false);
  EXPECT_EQ(ask().status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(grants(old), 0u);
}

TEST_F(InspectionTest, IsReadAndAnsweredOnce) {
  const SessionId a = reader("a"), b = reader("b");
  const InspectionId id = *ask();
  ASSERT_EQ(grants(a) + grants(b), 1u);
  const SessionId by = grants(a) == 1 ? a : b, other = by == a ? b : a;
  report(other, id);
  EXPECT_TRUE(answers.empty()) << "only its own worker can report on it";
  report(by, id);
  report(by, id);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_TRUE(answers[0].found.ok());
  EXPECT_EQ(answers[0].id, id);
}

TEST_F(InspectionTest, GoesToTheLeastBusyWorkerOneAtATime) {
  const SessionId busy = reader("a");
  submit(spec("r", 64));
  writes.clear();
  ASSERT_GT(got<LeaseGrant>(busy).size(), 0u);
  const SessionId idle = reader("b");
  // It got the rest of the job, and has no more leases than the first worker.
  const InspectionId first = *ask(), second = *ask();
  EXPECT_EQ(grants(busy), 1u);
  EXPECT_EQ(grants(idle), 1u);
  const InspectionId third = *ask();
  EXPECT_EQ(grants(busy) + grants(idle), 2u);
  report(idle, got<InspectGrant>(idle)[0].inspection);
  EXPECT_EQ(grants(idle), 2u);
  EXPECT_EQ(got<InspectGrant>(idle)[1].inspection, third);
  EXPECT_TRUE(first < second && second < third);
}

TEST_F(InspectionTest, SurvivesOnlyOneLostWorker) {
  const SessionId a = reader("a");
  const InspectionId id = *ask();
  const SessionId b = reader("b"), c = reader("c");
  lose(a);
  ASSERT_EQ(grants(b) + grants(c), 1u);
  EXPECT_TRUE(answers.empty());
  const bool first = grants(b) == 1;
  lose(first ? b : c);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].id, id);
  EXPECT_EQ(code(0), StatusCode::kUnavailable);
  EXPECT_EQ(grants(first ? c : b), 0u) << "a third worker does not get it";
}

TEST_F(InspectionTest, MovesAwayFromASilentWorker) {
  const SessionId a = reader("a");
  ASSERT_TRUE(ask().ok());
  const Time asked = now;
  SessionId b{};
  while (closed.empty() && now < asked + std::chrono::seconds(31)) {
    wait(std::chrono::seconds(1));
  }
  ASSERT_EQ(closed.size(), 1u) << "within 30 s";
  b = reader("b");
  EXPECT_EQ(grants(a), 1u);
  EXPECT_EQ(grants(b), 1u);
}

TEST_F(InspectionTest, MovesFromTwoSilentWorkersToALiveOne) {
  const SessionId a = reader("a"), b = reader("b");
  ASSERT_TRUE(ask().ok());
  while (closed.size() < 2) {
    wait(std::chrono::seconds(1));
    ASSERT_LT(now, Time{} + std::chrono::hours(1));
  }
  EXPECT_TRUE(answers.empty()) << "one of them had it, and it survives one lost worker";
  EXPECT_EQ(grants(a) + grants(b), 1u);
  const SessionId c = reader("c");
  EXPECT_EQ(grants(c), 1u);
}

TEST_F(InspectionTest, ALeavingWorkerDoesNotCountAsLost) {
  for (int i = 0; i < 4; ++i) {
    const SessionId leaving = reader("w" + std::to_string(i));
    if (i == 0) {
      ASSERT_TRUE(ask().ok());
    }
    ASSERT_EQ(grants(leaving), 1u) << i;
    say(leaving, WorkerDraining{});
    lose(leaving);
  }
  EXPECT_TRUE(answers.empty());
  const SessionId last = reader("last");
  report(last, got<InspectGrant>(last).at(0).inspection);
  EXPECT_EQ(answers.size(), 1u);
}

TEST_F(InspectionTest, AForgottenInspectionKeepsItsWorkerBusyUntilItsReport) {
  const SessionId a = reader("a");
  const InspectionId first = *ask();
  coordinator->forget_inspection(first);
  const InspectionId second = *ask();
  EXPECT_EQ(grants(a), 1u);
  report(a, first);
  EXPECT_TRUE(answers.empty());
  ASSERT_EQ(grants(a), 2u);
  EXPECT_EQ(got<InspectGrant>(a)[1].inspection, second);
}

TEST_F(InspectionTest, OneCallersInspectionsDoNotDelayThoseOfAnother) {
  const SessionId a = reader("a");
  std::vector<InspectionId> anns;
  for (int i = 0; i < 4; ++i) {
    anns.push_back(*ask("ann"));
  }
  const InspectionId bobs = *ask("bob");
  report(a, anns[0]);
  ASSERT_EQ(grants(a), 2u);
  EXPECT_EQ(got<InspectGrant>(a)[1].inspection, bobs);
  report(a, bobs);
  EXPECT_EQ(got<InspectGrant>(a)[2].inspection, anns[1]);
}

TEST_F(InspectionTest, HasALimitPerCallerAndInTotal) {
  reader("a");
  const InspectionLimits limits;
  for (std::size_t i = 0; i < limits.most_per_caller; ++i) {
    EXPECT_TRUE(ask("ann").ok());
  }
  EXPECT_EQ(ask("ann").status().code(), StatusCode::kResourceExhausted);
  for (std::size_t i = limits.most_per_caller; i < limits.most; ++i) {
    EXPECT_TRUE(ask("caller " + std::to_string(i)).ok());
  }
  EXPECT_EQ(ask("bob").status().code(), StatusCode::kResourceExhausted);
}

TEST_F(InspectionTest, MovesFromAReaderThatDoesNotReport) {
  const SessionId a = reader("a");
  const InspectionId id = ask().value();
  const SessionId b = reader("b"), c = reader("c");
  const auto wait_for = [&](int seconds) {
    for (int i = 0; i < seconds; ++i) {
      for (const SessionId each : {a, b, c}) {
        say(each, WorkerHeartbeat{});
      }
      wait(std::chrono::seconds(1));
    }
  };
  wait_for(80);
  EXPECT_TRUE(answers.empty());
  EXPECT_EQ(grants(a), 1u);
  ASSERT_EQ(grants(b) + grants(c), 1u);
  const SessionId second = grants(b) == 1 ? b : c;
  lose(a);
  EXPECT_EQ(grants(b) + grants(c), 1u) << "the second one continues";
  report(second, id);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(code(0), StatusCode::kOk);
  const SessionId again = reader("a");
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(ask("caller " + std::to_string(i)).ok());
  }
  EXPECT_EQ(grants(again), 0u) << "its identity comes last";
}

TEST_F(InspectionTest, TwoReadersThatDoNotReportEndAnInspection) {
  const SessionId a = reader("a"), b = reader("b"), c = reader("c");
  ASSERT_TRUE(ask().ok());
  for (int i = 0; i < 170; ++i) {
    for (const SessionId each : {a, b, c}) {
      say(each, WorkerHeartbeat{});
    }
    wait(std::chrono::seconds(1));
  }
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(code(0), StatusCode::kDeadlineExceeded);
  EXPECT_EQ(grants(a) + grants(b) + grants(c), 2u);
}

TEST_F(InspectionTest, TimesOut) {
  const SessionId a = reader("a");
  ASSERT_TRUE(ask().ok());
  ASSERT_TRUE(ask().ok());
  for (int i = 0; i < 95; ++i) {
    say(a, WorkerHeartbeat{});
    wait(std::chrono::seconds(1));
  }
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_EQ(code(0), StatusCode::kDeadlineExceeded) << "the first takes too long";
  EXPECT_EQ(code(1), StatusCode::kUnavailable) << "no worker had time for the second";
}

}  // namespace
}  // namespace lightmill::test
