// The screen of `top`.
#include "client/cli/top_view.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/text_width.h"

namespace lightmill::cli {
namespace {

TopSnapshot farm(int jobs, int workers) {
  TopSnapshot snapshot;
  snapshot.server = "farm:7350";
  snapshot.wanted = 12;
  for (int i = 0; i < jobs; ++i) {
    v1::Job& job = snapshot.jobs.emplace_back();
    job.set_id(static_cast<std::uint64_t>(i + 1));
    job.set_name(fmt::format("job-{}", i + 1));
    job.set_state(i % 2 == 0 ? v1::JOB_STATE_QUEUED : v1::JOB_STATE_RUNNING);
    job.mutable_goal()->set_samples(64);
  }
  for (int i = 0; i < workers; ++i) {
    v1::Worker& worker = snapshot.workers.emplace_back();
    worker.set_name(fmt::format("w{}", i + 1));
    worker.set_threads(4);
    worker.set_leases(i % 3 == 0 ? 0 : 2);
    worker.set_samples_per_second(1e6 * (i + 1));
  }
  return snapshot;
}

std::size_t line_with(const std::vector<std::string>& lines, const std::string& text) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].find(text) != std::string::npos) {
      return i;
    }
  }
  ADD_FAILURE() << "no line has " << text;
  return 0;
}

TEST(Top, SumsUpTheFarm) {
  const std::vector<std::string> lines = top_lines(farm(3, 3), 0, 0);
  EXPECT_EQ(lines[0], "farm     farm:7350");
  EXPECT_EQ(lines[1], "workers  2 working, 1 idle; 12 threads, 6.00 Msamples/s; jobs could keep 12 workers busy");
  EXPECT_EQ(lines[2], "jobs     1 running, 2 queued");
}

TEST(Top, RunningJobsAndTheFastestWorkersComeFirst) {
  TopSnapshot snapshot = farm(4, 3);
  snapshot.jobs.emplace_back().set_state(v1::JOB_STATE_DONE);
  snapshot.jobs.back().set_name("over");
  const std::vector<std::string> lines = top_lines(snapshot, 0, 0);
  EXPECT_LT(line_with(lines, "job-2"), line_with(lines, "job-4"));
  EXPECT_LT(line_with(lines, "job-4"), line_with(lines, "job-1"));
  EXPECT_LT(line_with(lines, "w3"), line_with(lines, "w2"));
  for (const std::string& line : lines) {
    EXPECT_EQ(line.find("over"), std::string::npos);
  }
}

TEST(Top, WorkersThatAreAwayHaveNoNumbersAndHostsAreNamedOnce) {
  std::vector<v1::Worker> workers(2);
  workers[0].set_name("render-1/vm-20320");
  workers[0].set_host("vm");
  workers[0].set_threads(4);
  workers[1].set_name("render-3");
  workers[1].set_host("identity");
  workers[1].set_away(true);
  workers[1].set_quarantine("smoke");
  EXPECT_EQ(worker_rows(workers), (Rows{{"WORKER", "STATE", "THREADS", "RATE", "RESULTS", "LOST", "UP"},
                                        {"render-1/vm-20320", "idle", "4", "0 samples/s", "0", "0", "0.0 s"},
                                        {"render-3", "quarantine, away", "-", "-", "-", "-", "-"}}));
  workers[0].set_host("big");
  EXPECT_EQ(worker_rows(workers)[0].back(), "HOST");
  EXPECT_EQ(worker_rows(workers)[1].back(), "big");
  EXPECT_EQ(worker_rows(workers)[2].back(), "-");
}

TEST(Top, ClassesAreInTheRowsOfTheirWorkers) {
  std::vector<v1::Worker> workers(3);
  workers[0].set_name("liar");  // an identity that its worker shows
  workers[0].set_away(true);
  workers[0].set_quarantine("smoke");
  workers[1].set_name("liar/vm");
  workers[1].set_host("vm");
  workers[1].set_quarantine("smoke");
  workers[1].set_fingerprint_class("one");
  workers[2] = workers[1];
  workers[2].set_name("honest/vm");
  workers[2].clear_quarantine();
  EXPECT_EQ(worker_rows(workers)[0].back(), "UP") << "one class needs no column";
  workers[2].set_fingerprint_class("two");
  const Rows rows = worker_rows(workers);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].back(), "CLASS");
  EXPECT_EQ(std::pair(rows[1].front(), rows[1].back()), std::pair(std::string("liar/vm"), std::string("one")));
  EXPECT_EQ(std::pair(rows[2].front(), rows[2].back()), std::pair(std::string("honest/vm"), std::string("two")));
}

TEST(Top, JobsWithWorkersComeFirstThenHigherPriorities) {
  TopSnapshot snapshot;
  for (int i = 1; i <= 30; ++i) {
    v1::Job& job = snapshot.jobs.emplace_back();
    job.set_id(static_cast<std::uint64_t>(i));
    job.set_name(fmt::format("job-{}.", i));
    job.set_state(v1::JOB_STATE_RUNNING);
    job.set_priority(i / 10);
  }
  snapshot.jobs[4].set_samples_per_second(1e6);
  const std::vector<std::string> lines = top_lines(snapshot, 0, 0);
  EXPECT_LT(line_with(lines, "job-5."), line_with(lines, "job-30."));
  EXPECT_LT(line_with(lines, "job-30."), line_with(lines, "job-20."));
  EXPECT_LT(line_with(lines, "job-20."), line_with(lines, "job-29."));
  EXPECT_LT(line_with(lines, "job-29."), line_with(lines, "job-1."));
}

TEST(Top, AWaitingJobShowsItsReasonAndNoTime) {
  TopSnapshot snapshot = farm(2, 0);
  snapshot.jobs[1].set_eta_seconds(12);
  EXPECT_EQ(top_lines(snapshot, 0, 0)[line_with(top_lines(snapshot, 0, 0), "job-2")].find("12 s"), std::string::npos)
      << "nobody renders it";
  snapshot.jobs[1].set_samples_per_second(1);
  EXPECT_NE(top_lines(snapshot, 0, 0)[line_with(top_lines(snapshot, 0, 0), "job-2")].find("12 s"), std::string::npos);
  snapshot.jobs[1].set_reason("waits for a worker");
  const std::vector<std::string> lines = top_lines(snapshot, 0, 0);
  EXPECT_EQ(lines[line_with(lines, "job-2")].find("12 s"), std::string::npos);
  EXPECT_EQ(lines.back(), "job 2: waits for a worker");
}

TEST(Top, ReasonsOfWaitingJobsLeaveTheirNamesWhole) {
  TopSnapshot snapshot = farm(8, 0);
  for (v1::Job& job : snapshot.jobs) {
    job.set_name(fmt::format("cornell-bench-blocks-{}", job.id()));
    job.set_reason("waits for a worker: none is connected");
  }
  const std::vector<std::string> lines = top_lines(snapshot, 80, 24);
  EXPECT_NE(lines[line_with(lines, "cornell-bench-blocks-7")].find("queued"), std::string::npos);
  EXPECT_EQ(lines.back(), "jobs 2, 4, 6, 8, 1 and 3 more: wait for a worker: none is connected");
  EXPECT_EQ(top_lines(snapshot, 80, 12).back(), "jobs 2, 4, 6, 8, 1 and 3 more: wait for a worker: none is connected");
}

void expect_fits(const TopSnapshot& snapshot, int columns, int rows) {
  const std::vector<std::string> lines = top_lines(snapshot, columns, rows);
  EXPECT_LE(lines.size(), static_cast<std::size_t>(rows)) << columns << "x" << rows;
  for (const std::string& line : lines) {
    EXPECT_LE(columns_of(line), columns) << columns << "x" << rows << ": " << line;
  }
}

TEST(Top, FitsAnyTerminal) {
  for (const int jobs : {0, 1, 7, 500}) {
    for (const int workers : {0, 1, 30, 1000}) {
      for (const int rows : {1, 5, 9, 10, 24, 60}) {
        expect_fits(farm(jobs, workers), 40, rows);
      }
    }
  }
}

TEST(Top, FitsTheSmallestTerminals) {
  for (const int many : {0, 1, 20}) {
    TopSnapshot snapshot = farm(many, many);
    for (int i = 0; i < many; ++i) {
      snapshot.jobs[static_cast<std::size_t>(i)].set_name("冷却塔 🚀 e\u0301té");
      snapshot.workers[static_cast<std::size_t>(i)].set_name("工作者");
    }
    snapshot.notices.push_back("全部");
    for (const char* trouble : {"", "cannot reach the farm 農場"}) {
      snapshot.trouble = trouble;
      for (int rows = 1; rows <= 16; ++rows) {
        for (int columns = 2; columns <= 100; ++columns) {
          expect_fits(snapshot, columns, rows);
        }
      }
    }
  }
}

TEST(Top, AnUnreachableFarmIsReportedFirst) {
  TopSnapshot snapshot = farm(3, 3);
  snapshot.trouble = "no\x1b[2Janswer";
  EXPECT_EQ(top_lines(snapshot, 80, 1), std::vector<std::string>{"out of date: no\\x1b[2Janswer"});
  EXPECT_EQ(top_lines(snapshot, 80, 24)[1], "farm     farm:7350");
}

TEST(Top, WithoutALimitOfRowsNothingIsCut) {
  TopSnapshot snapshot = farm(3, 3);
  snapshot.notices.push_back("this farm lets everyone who reaches it do everything (--insecure)");
  for (const int columns : {30, 60, 80}) {
    std::string all;
    for (std::string line : top_lines(snapshot, columns, 0)) {
      EXPECT_LE(columns_of(line), columns) << line;
      std::erase(line, ' ');
      all += line;
    }
    for (const char* text :
         {"job-1", "job-3", "queued", "0/64", "w1", "w3", "working", "3.00Msamples/s", "(--insecure)"}) {
      EXPECT_NE(all.find(text), std::string::npos) << columns << ": " << text;
    }
  }
}

TEST(Top, CountsOmittedRowsAndFillsTheScreen) {
  const std::vector<std::string> lines = top_lines(farm(3, 100), 0, 24);
  EXPECT_EQ(lines.size(), 24u);
  EXPECT_EQ(lines.back(), "… and 87 more");
  const std::vector<std::string> both = top_lines(farm(100, 100), 0, 25);
  EXPECT_EQ(both.size(), 25u);
  EXPECT_NE(both[line_with(both, "WORKER") - 2].find("… and"), std::string::npos);
}

TEST(Top, ColumnsThatDoNotFitStandBelowTheirRows) {
  TopSnapshot snapshot = farm(2, 0);
  snapshot.jobs[0].set_name("a-job-with-a-name-of-forty-six-characters-here");
  snapshot.jobs[0].set_owner("ada");
  const std::vector<std::string> lines = top_lines(snapshot, 60, 24);
  EXPECT_EQ(lines.back(), "    samples 0/64; owner ada");
  const std::vector<std::string> low = top_lines(farm(50, 0), 40, 12);
  EXPECT_EQ(low.back(), "… and 48 more");
}

TEST(Top, ColoursStatesOnRequest) {
  const std::vector<std::string> lines = top_lines(farm(2, 2), 80, 24, true);
  EXPECT_NE(lines[line_with(lines, "job-2")].find("\x1b[36mrunning\x1b[0m"), std::string::npos);
  EXPECT_NE(lines[line_with(lines, "w2")].find("\x1b[32mworking\x1b[0m"), std::string::npos);
}

TEST(Top, ShowsNoControlCharacters) {
  TopSnapshot snapshot = farm(1, 1);
  snapshot.jobs[0].set_name("a\x1b[2Jb");
  snapshot.notices.push_back("c\x1b[2Jd");
  for (const std::string& line : top_lines(snapshot, 0, 0)) {
    EXPECT_EQ(line.find('\x1b'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace lightmill::cli
