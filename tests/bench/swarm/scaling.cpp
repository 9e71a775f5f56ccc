// Time of a job with more and more workers, compared with the time if none of them ever waited.
//
// The workers are simulated, each with its own connection. Each farm gets a job with the same seconds of work for each
// worker. Speeds may differ, and workers may come and go. Then the ideal is that each works from its start until it is
// killed.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <deque>

#include "client/chart/chart.h"
#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/machine_memory.h"
#include "common/base/number_text.h"
#include "tests/bench/swarm/swarm.h"
#include "tests/support/farm.h"

namespace {

using namespace lightmill;
using SteadyClock = std::chrono::steady_clock;

/// Workers that come and go do so in this many groups.
constexpr std::uint32_t kGroups = 10;

struct Size {
  int width = 512, height = 512;
  friend std::istream& operator>>(std::istream& in, Size& size) {
    char by = 0;
    in >> size.width >> by >> size.height;
    if (by != 'x' || size.width < 1 || size.height < 1) {
      in.setstate(std::ios::failbit);
    }
    return in;
  }
  friend std::ostream& operator<<(std::ostream& out, const Size& size) {
    return out << size.width << 'x' << size.height;
  }
};

struct Options {
  std::vector<std::uint32_t> workers{1, 4, 16, 64, 256, 1024};
  std::vector<Size> sizes{{512, 512}, {3840, 2160}};
  double speed = 300'000, spread = 1, seconds = 30, churn_seconds = 0;
  std::string chart, traffic_chart;
};

/// A swarm in groups. The oldest group is replaced from time to time.
class Crew {
 public:
  Crew(std::string server, const Options& options, std::uint32_t workers)
      : options_({std::move(server), workers, 1, options.speed, options.spread}), groups_(1) {
    if (options.churn_seconds > 0) {
      groups_ = std::min(kGroups, workers);
      options_.workers = workers / groups_;
    }
    while (crew_.size() < groups_) {
      add();
    }
  }
  void replace_oldest() {
    gone_ += crew_.front().pixel_samples_until(SteadyClock::now());
    lost_ = take(crew_.front().swarm->counts(), lost_);
    crew_.pop_front();
    add();
  }
  /// Pixel samples that all workers could have rendered so far.
  double pixel_samples() const {
    double sum = gone_;
    for (const Group& group : crew_) {
      sum += group.pixel_samples_until(SteadyClock::now());
    }
    return sum;
  }
  bench::SwarmCounts counts() const {
    bench::SwarmCounts sum = lost_;
    for (const Group& group : crew_) {
      sum = take(group.swarm->counts(), sum);
    }
    return sum;
  }
  std::uint32_t size() const { return groups_ * options_.workers; }
  bool all_connected() const { return counts().connected == size(); }

 private:
  struct Group {
    std::unique_ptr<bench::Swarm> swarm;
    double speed = 0;
    SteadyClock::time_point since;
    double pixel_samples_until(SteadyClock::time_point until) const {
      return speed * std::chrono::duration<double>(until - since).count();
    }
  };
  static bench::SwarmCounts take(const bench::SwarmCounts& from, bench::SwarmCounts sum) {
    sum.connected += from.connected;
    sum.disconnects += from.disconnects;
    sum.results += from.results;
    sum.result_bytes += from.result_bytes;
    return sum;
  }
  void add() {
    crew_.push_back({std::make_unique<bench::Swarm>(options_), bench::speed_of(options_), SteadyClock::now()});
    options_.first += options_.workers;
  }

  bench::SwarmOptions options_;  ///< of the next group
  std::uint32_t groups_;
  std::deque<Group> crew_;
  double gone_ = 0;          ///< pixel samples that the replaced workers could have rendered
  bench::SwarmCounts lost_;  ///< of the replaced workers
};

struct Row {
  std::uint32_t workers = 0;
  double ideal = 0, took = 0;  ///< seconds
  double megabytes = 0;        ///< of results per second
};

Row measure(const Options& options, const Size& size, std::uint32_t workers) {
  test::Farm farm({"--max-workers", "20000", "--films-gib", "64", "--film-gib", "8", "--log-level", "warn"});
  test::FarmClient client = farm.client();
  client.upload_assets();
  Crew crew(farm.address(), options, workers);
  LM_CHECK(test::eventually([&] { return crew.all_connected(); }, std::chrono::seconds(120)),
           "not all workers are connected after two minutes");

  test::Picture picture;
  picture.side = size.width;
  picture.height = size.height;
  const double pixels = static_cast<double>(size.width) * size.height;
  // A power of two, as in most jobs. Other numbers have a few more results per tile.
  const double exponent = std::round(std::log2(options.seconds * options.speed * crew.size() / pixels));
  picture.samples = std::uint64_t{1} << static_cast<std::uint32_t>(std::max(exponent, 0.0));
  const double work = pixels * static_cast<double>(picture.samples);
  const double before = crew.pixel_samples();
  const auto begun = SteadyClock::now();
  const std::uint64_t id = client.submit(picture).id();
  const auto pause =
      std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(options.churn_seconds));
  auto next_change = begun + pause;
  v1::Job job;
  while ((job = client.job(id)).finished_unix_ms() == 0) {
    if (options.churn_seconds > 0 && SteadyClock::now() >= next_change) {
      crew.replace_oldest();
      next_change += pause;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const double polled = std::chrono::duration<double>(SteadyClock::now() - begun).count();
  const double offered = crew.pixel_samples() - before;
  LM_CHECK(job.state() == v1::JOB_STATE_DONE, "job: {}", job.ShortDebugString());
  const double took = static_cast<double>(job.finished_unix_ms() - job.submitted_unix_ms()) / 1000;
  const bench::SwarmCounts counts = crew.counts();
  LM_CHECK(counts.disconnects == 0, "{} of workers that stayed were lost", counted(counts.disconnects, "connection"));
  const Row row{crew.size(), work * polled / offered, took, static_cast<double>(counts.result_bytes) / took / 1e6};
  fmt::print("| {}x{} | {} | {} | {:.2f} | {:.2f} | {:.1f} % | {:.0f} | {:.1f} |\n", size.width, size.height,
             row.workers, picture.samples, row.ideal, row.took, 100 * row.ideal / row.took,
             static_cast<double>(counts.results) / row.took, row.megabytes);
  std::fflush(stdout);
  return row;
}

ChartPoint point_at(double x, double y) {
  ChartPoint point;
  point.x = x;
  point.y = y;
  return point;
}

void write_chart(const std::string& path, const Chart& chart) {
  if (!path.empty()) {
    const Status written = write_file_atomically(path, as_byte_view(chart_file(chart)));
    LM_CHECK(written.ok(), "{}", message_of(written));
  }
}

int run(const Options& options) {
  raise_file_limit();
  Chart speed, traffic;
  speed.title = "Busy workers";
  speed.x_label = traffic.x_label = "workers";
  speed.y_label = "workers that would never be idle";
  speed.series.push_back({"ideal", {}});
  traffic.title = "Sent results";
  traffic.y_label = "MB per second";
  fmt::print("| picture | workers | samples per pixel | ideal, s | took, s | efficiency | results/s | MB/s |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Size& size : options.sizes) {
    const std::string name = fmt::format("{}x{}", size.width, size.height);
    ChartSeries at_work{name, {}}, sent{name, {}};
    for (const std::uint32_t workers : options.workers) {
      const Row row = measure(options, size, workers);
      at_work.points.push_back(point_at(row.workers, row.workers * row.ideal / row.took));
      sent.points.push_back(point_at(row.workers, row.megabytes));
    }
    speed.series.push_back(std::move(at_work));
    traffic.series.push_back(std::move(sent));
  }
  for (const ChartPoint& point : speed.series.back().points) {
    speed.series.front().points.push_back(point_at(point.x, point.x));
  }
  write_chart(options.chart, speed);
  write_chart(options.traffic_chart, traffic);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Time of a job with more and more simulated workers, compared with the ideal. Each worker has the same seconds "
      "of work.");
  Options options;
  app.add_option("--workers", options.workers, "workers of each farm, with one thread each")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(1, 20'000));
  app.add_option("--sizes", options.sizes, "sizes of the pictures, WIDTHxHEIGHT")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "approximate seconds of work for each worker")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 3600.0));
  app.add_option("--speed", options.speed, "pixel samples per second of a worker")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e9));
  app.add_option("--spread", options.spread, "ratio of the fastest to the slowest worker")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 100.0));
  app.add_option("--churn", options.churn_seconds, "seconds after which a tenth of the workers is replaced; 0: never")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 3600.0));
  app.add_option("--chart", options.chart, "write a chart of busy workers to this SVG file");
  app.add_option("--traffic-chart", options.traffic_chart, "write a chart of sent results to this SVG file");
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
