// A job's progress in one line.
#include "client/cli/progress.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/cli/job_json.h"
#include "common/base/text_width.h"

namespace lightmill::cli {
namespace {

v1::Job running_job() {
  v1::Job job;
  job.set_id(7);
  job.set_state(v1::JOB_STATE_RUNNING);
  job.mutable_goal()->set_samples(64);
  job.set_samples_done(250);
  job.set_samples_wanted(1000);
  job.set_frame_samples(16);
  job.set_samples_per_second(3'200'000);
  job.set_eta_seconds(83);
  job.mutable_error()->set_rel_mse(0.0004);
  job.mutable_error()->set_half_width(0.0001);
  return job;
}

TEST(Progress, ShowsShareErrorSpeedAndTimeLeft) {
  const std::string text = progress_text(running_job(), 200);
  for (const char* part : {"25%", "16/64 spp", "±2.0%", "3.20 Msamples/s", "ETA 1 min 23 s"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
  }
}

TEST(Progress, AJobWithoutResultsHasNoVerdictOnItsAudits) {
  v1::Job job = running_job();
  job.set_audit_share(0.01);
  EXPECT_EQ(audits_text(job), "no audits yet");
  job.mutable_counters()->set_results_merged(3);
  EXPECT_EQ(audits_text(job), "unaudited: none of 3 results was selected at a share of 1%");
  job.set_state(v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(audits_text(job), "unaudited: it ended before an audit");
  job.set_one_identity(true);
  EXPECT_TRUE(audits_text(job).starts_with("unaudited: one identity")) << audits_text(job);
  job.set_one_identity(false);
  job.set_state(v1::JOB_STATE_DONE);
  job.set_results_unaudited(2);
  EXPECT_EQ(audits_text(job), "unaudited: no other identity was connected; 2 results could not be audited");
  job.set_audits_lost(2);
  EXPECT_EQ(audits_text(job), "unaudited: 2 audits lost with their workers; 2 results could not be audited");
}

TEST(Progress, SamplesAreThoseOfTheFrame) {
  v1::Job adaptive = running_job();
  adaptive.mutable_goal()->set_adaptive(true);
  adaptive.mutable_goal()->set_samples(128);
  adaptive.set_state(v1::JOB_STATE_DONE);
  adaptive.set_frame_samples(128);
  adaptive.set_min_tile_samples(32);
  adaptive.set_max_tile_samples(512);
  EXPECT_EQ(samples_text(adaptive), "128/128 spp");
  adaptive.mutable_goal()->set_samples(0);
  EXPECT_EQ(samples_text(adaptive), "128 spp");
  EXPECT_EQ(to_json(adaptive)["frame_samples"], 128);
}

TEST(Progress, FitsEveryWidthAndDropsThePercentageLast) {
  for (int width = 4; width < 140; ++width) {
    const std::string line = progress_line(running_job(), width, false);
    EXPECT_LE(columns_of(line), width) << line;
    EXPECT_NE(line.find("25%"), std::string::npos) << line;
  }
}

TEST(Progress, BarIsAsFullAsTheJob) {
  v1::Job job = running_job();
  for (const auto& [done, filled] : {std::pair{0, 0}, {500, 20}, {1000, 40}}) {
    job.set_samples_done(static_cast<std::uint64_t>(done));
    const std::string line = progress_line(job, 200, false);
    EXPECT_EQ(std::ranges::count(line, '='), filled) << line;
  }
}

TEST(Progress, TheBarKeepsItsWidthWhileNumbersComeAndGrow) {
  v1::Job early = running_job();
  early.clear_error();
  early.set_samples_per_second(0);
  early.set_eta_seconds(-1);
  early.set_frame_samples(0);
  v1::Job late = running_job();
  late.set_eta_seconds(3 * 86400);
  late.set_frame_samples(64);
  late.set_samples_per_second(950);
  for (int width = 20; width < 140; ++width) {
    const std::size_t end = progress_line(running_job(), width, false).find(']');
    EXPECT_EQ(progress_line(early, width, false).find(']'), end) << width;
    EXPECT_EQ(progress_line(late, width, false).find(']'), end) << width;
  }
  EXPECT_NE(progress_line(running_job(), 41, false).find('['), std::string::npos);
}

TEST(Progress, TheRateIsDroppedBeforeTheBar) {
  v1::Job job = running_job();
  job.mutable_goal()->set_samples(20'000'000);
  job.set_frame_samples(16'300'000);
  const std::string line = progress_line(job, 80, false);
  EXPECT_NE(line.find('['), std::string::npos) << line;
  EXPECT_EQ(line.find("samples/s"), std::string::npos) << line;
}

TEST(Progress, ALineEndsWithoutBlanks) {
  v1::Job job = running_job();
  job.set_samples_per_second(1);
  for (int width = 4; width < 140; ++width) {
    EXPECT_NE(progress_line(job, width, false).back(), ' ') << width;
  }
}

TEST(Progress, JobsThatWaitForTheSameAreNamedTogether) {
  std::vector<v1::Job> jobs(5);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    jobs[i].set_id(i + 1);
    jobs[i].set_state(v1::JOB_STATE_QUEUED);
    jobs[i].set_reason("waits for a worker");
  }
  jobs[1].set_state(v1::JOB_STATE_FAILED);
  jobs[4].set_reason("waits for space");
  using Lines = std::vector<std::string>;
  EXPECT_EQ(wait_texts(jobs, 5), (Lines{"jobs 1, 3, 4: wait for a worker", "job 5: waits for space"}));
  EXPECT_EQ(wait_texts(jobs, 2), (Lines{"jobs 1, 3 and 1 more: wait for a worker", "job 5: waits for space"}));
}

TEST(Progress, EachReasonForAMethodHasALine) {
  v1::Job job = running_job();
  job.set_method("caustic");
  job.mutable_method_notes()->add_reasons("path and caustic find all light");
  job.mutable_method_notes()->add_reasons("caustic has less noise");
  EXPECT_EQ(method_lines(job),
            (std::vector<std::string>{"method caustic: path and caustic find all light", "  caustic has less noise"}));
}

TEST(Progress, ColourIsUsedOnlyOnRequest) {
  EXPECT_EQ(progress_line(running_job(), 120, false).find('\x1b'), std::string::npos);
  EXPECT_NE(progress_line(running_job(), 120, true).find('\x1b'), std::string::npos);
}

constexpr Time kStart{std::chrono::hours(5)};

Time at(double seconds) {
  return kStart + from_seconds(seconds);
}

TEST(TimeLeft, CountsDownWhileTheEstimatesAgree) {
  TimeLeft left;
  for (double second = 0; second < 100; second += 0.25) {
    EXPECT_NEAR(left.update(100 - second, at(second)), 100 - second, 1e-6);
  }
}

TEST(TimeLeft, AJumpOfTheEstimateIsFollowedSlowly) {
  TimeLeft left;
  EXPECT_EQ(left.update(80, at(0)), 80);
  double shown = 80;
  for (double second = 0.5; second <= 40; second += 0.5) {
    const double now = left.update(160 - second, at(second));
    EXPECT_LT(std::abs(now - shown), 80 * 0.5 / 4) << second << ": at most its part of the jump";
    shown = now;
  }
  EXPECT_NEAR(shown, 120, 15);
}

TEST(TimeLeft, ShortTimesFollowQuickly) {
  TimeLeft left;
  left.update(4, at(0));
  EXPECT_NEAR(left.update(1, at(2)), 1, 0.2);
  EXPECT_GE(left.update(0, at(10)), 0);
}

TEST(TimeLeft, AnUnknownEstimateIsUnknownAndTheNextOneIsTakenAsItIs) {
  TimeLeft left;
  EXPECT_LT(left.update(-1, at(0)), 0);
  EXPECT_EQ(left.update(3600, at(1)), 3600);
  EXPECT_LT(left.update(-1, at(2)), 0);
  EXPECT_EQ(left.update(10, at(3)), 10);
}

TEST(Progress, NearestLimitCounts) {
  v1::Job job = running_job();
  job.mutable_goal()->set_seconds(10);
  job.set_active_seconds(8);
  EXPECT_DOUBLE_EQ(fraction_done(job), 0.8);
  job.set_active_seconds(11);
  EXPECT_DOUBLE_EQ(fraction_done(job), 1.0);
}

TEST(Progress, ProgressToAnErrorFollowsOneOverSamples) {
  v1::Job job = running_job();
  job.mutable_goal()->set_samples(0);
  job.set_samples_wanted(0);
  job.mutable_goal()->set_error(0.0002);  // 0.0004 ± 0.0001 is known
  EXPECT_DOUBLE_EQ(fraction_done(job), 0.4);
  const std::string text = progress_text(job, 200);
  for (const char* part : {"40%", "16 spp", "relMSE ≤0.00050 (95%, goal 0.0002)", "±2.0%"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
  }
  job.mutable_error()->set_rel_mse(0.00001);
  job.mutable_error()->set_half_width(0.00001);
  EXPECT_LT(fraction_done(job), 1) << "it ends where the error is read, not before";
  EXPECT_EQ(error_goal_text(job), "relMSE ≤2.0e-05 (95%, goal 0.0002, next checked at 24 spp)");
  job.set_frame_samples(46);
  EXPECT_EQ(error_goal_text(job), "relMSE ≤2.0e-05 (95%, goal 0.0002, next checked at 48 spp)");
  job.set_state(v1::JOB_STATE_DONE);
  EXPECT_DOUBLE_EQ(fraction_done(job), 1);
  job.clear_error();
  EXPECT_EQ(error_goal_text(job), "");
}

TEST(Progress, ErrorHasTwoDigitsOrIsWhole) {
  v1::Job job = running_job();
  for (const auto& [rel_mse, text] : {std::pair{4.0, "±200%"},
                                      {0.015, "±12%"},
                                      {0.00995, "±10%"},
                                      {0.0049, "±7.0%"},
                                      {0.00001764, "±0.42%"},
                                      {9.92e-7, "±0.10%"}}) {
    job.mutable_error()->set_rel_mse(rel_mse);
    EXPECT_EQ(error_text(job), text);
  }
}

TEST(Progress, UnknownErrorIsNotShown) {
  v1::Job job = running_job();
  job.clear_error();
  EXPECT_EQ(error_text(job), "");
  EXPECT_EQ(progress_text(job, 200).find("error"), std::string::npos);
}

TEST(JobJson, UnknownValuesAreNull) {
  v1::Job job;
  job.set_id(3);
  job.set_eta_seconds(-1);
  const nlohmann::json object = to_json(job);
  EXPECT_EQ(object["id"], 3);
  for (const char* field :
       {"eta_seconds", "error", "samples_wanted", "finished_unix_ms", "render_digest", "parent", "reached"}) {
    EXPECT_TRUE(object[field].is_null()) << field;
  }
  EXPECT_DOUBLE_EQ(to_json(running_job())["error"]["rel_mse"], 0.0004);
  EXPECT_EQ(to_json(running_job())["state"], "running");
  job.mutable_goal()->set_error(0.01);
  job.set_reached(v1::GOAL_LIMIT_ERROR);
  EXPECT_EQ(to_json(job)["goal"]["error"], 0.01);
  EXPECT_EQ(to_json(job)["reached"], "error");
}

}  // namespace
}  // namespace lightmill::cli
