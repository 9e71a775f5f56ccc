#include "server/web/metrics.h"

#include <gtest/gtest.h>

#include <sstream>

namespace lightmill {
namespace {

bool has_line(const std::string& text, const std::string& line) {
  std::istringstream lines(text);
  for (std::string each; std::getline(lines, each);) {
    if (each == line) {
      return true;
    }
  }
  return false;
}

TEST(Histogram, AValueBelongsToTheFirstBucketThatHoldsIt) {
  const std::array bounds{1.0, 2.5};
  Histogram histogram(bounds);
  for (const double value : {0.0, 1.0, 1.5, 2.5, 3.0, 1e9}) {
    histogram.add(value);
  }
  EXPECT_EQ(histogram.counts(), (std::vector<std::uint64_t>{2, 2, 2}));
  EXPECT_DOUBLE_EQ(histogram.sum(), 1e9 + 8);
}

TEST(Metrics, FollowTheTextFormat) {
  MetricValues farm;
  farm.totals.leases_granted = 3;
  farm.totals.pixel_samples = 123'456'789'012;
  farm.totals.first_picture.add(0.2);
  farm.totals.first_picture.add(0.25);
  farm.totals.first_picture.add(7000);
  farm.gauges.jobs[static_cast<std::size_t>(JobState::failed)] = 2;
  farm.totals.jobs_failed = 4;
  farm.gauges.waits[static_cast<std::size_t>(WaitReason::no_worker)] = 3;
  farm.gauges.results_rate = 12'582'912;
  farm.storing = false;
  Traffic traffic;
  traffic.assets_in = 5;
  const std::array bounds{0.5};
  const std::string text = metrics_text(farm, Histogram(bounds), traffic, {.cpu_seconds = 1.5}, "1.2.3");
  for (const char* const line : {"# TYPE lightmill_leases_granted_total counter",
                                 "lightmill_leases_granted_total 3",
                                 "lightmill_pixel_samples_total 123456789012",
                                 "# TYPE lightmill_jobs gauge",
                                 "lightmill_jobs{state=\"failed\"} 2",
                                 "lightmill_jobs{state=\"done\"} 0",
                                 "lightmill_storing 0",
                                 "lightmill_jobs_waiting{reason=\"no_worker\"} 3",
                                 "lightmill_jobs_waiting{reason=\"storage\"} 0",
                                 "lightmill_results_rate_bytes 12582912",
                                 "# TYPE lightmill_first_picture_seconds histogram",
                                 "lightmill_first_picture_seconds_bucket{le=\"0.1\"} 0",
                                 "lightmill_first_picture_seconds_bucket{le=\"0.25\"} 2",
                                 "lightmill_first_picture_seconds_bucket{le=\"1800\"} 2",
                                 "lightmill_first_picture_seconds_bucket{le=\"+Inf\"} 3",
                                 "lightmill_first_picture_seconds_sum 7000.45",
                                 "lightmill_first_picture_seconds_count 3",
                                 "lightmill_received_bytes_total{what=\"assets\"} 5",
                                 "lightmill_jobs_failed_total 4",
                                 "process_cpu_seconds_total 1.5",
                                 "lightmill_build_info{version=\"1.2.3\"} 1"}) {
    EXPECT_TRUE(has_line(text, line)) << line << "\n" << text;
  }
  EXPECT_TRUE(text.ends_with("\n"));
}

TEST(Metrics, TheStartTimeIsRecent) {
  const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  const double started = process_figures().started_unix_seconds;
  EXPECT_LT(started, now + 2) << "the system's start is known to a second";
  EXPECT_GT(started, now - 3600);
}

}  // namespace
}  // namespace lightmill
