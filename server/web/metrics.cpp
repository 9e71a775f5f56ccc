#include "server/web/metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <sstream>
#include <utility>

#include "common/farm/job.h"

namespace lightmill {
namespace {

/// Lines of the text format. All labels and help texts are constants, so nothing is escaped.
class MetricLines {
 public:
  using Labelled = std::initializer_list<std::pair<std::string_view, double>>;

  void counter(std::string_view name, std::string_view help, double value) { one(name, help, "counter", value); }
  void gauge(std::string_view name, std::string_view help, double value) { one(name, help, "gauge", value); }
  void counters(std::string_view name, std::string_view help, std::string_view label, const Labelled& values) {
    begin(name, help, "counter");
    all(name, label, values);
  }
  void gauges(std::string_view name, std::string_view help, std::string_view label, const Labelled& values) {
    begin(name, help, "gauge");
    all(name, label, values);
  }
  void histogram(std::string_view name, std::string_view help, const Histogram& histogram) {
    begin(name, help, "histogram");
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < histogram.bounds().size(); ++i) {
      count += histogram.counts()[i];
      line(fmt::format("{}_bucket{{le=\"{}\"}}", name, histogram.bounds()[i]), static_cast<double>(count));
    }
    count += histogram.counts().back();
    line(fmt::format("{}_bucket{{le=\"+Inf\"}}", name), static_cast<double>(count));
    line(fmt::format("{}_sum", name), histogram.sum());
    line(fmt::format("{}_count", name), static_cast<double>(count));
  }
  std::string take() { return std::move(text_); }

  void begin(std::string_view name, std::string_view help, std::string_view type) {
    fmt::format_to(std::back_inserter(text_), "# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
  }
  void line(std::string_view what, double value) { fmt::format_to(std::back_inserter(text_), "{} {}\n", what, value); }

 private:
  void one(std::string_view name, std::string_view help, std::string_view type, double value) {
    begin(name, help, type);
    line(name, value);
  }
  void all(std::string_view name, std::string_view label, const Labelled& values) {
    for (const auto& [which, value] : values) {
      line(fmt::format("{}{{{}=\"{}\"}}", name, label, which), value);
    }
  }

  std::string text_;
};

void add_work(const FarmTotals& totals, MetricLines& out) {
  const auto number = [](std::uint64_t count) { return static_cast<double>(count); };
  out.counter("lightmill_leases_granted_total", "Leases granted to workers, with repeated units and audits.",
              number(totals.leases_granted));
  out.counter("lightmill_leases_lost_total", "Leases that expired, or whose worker left.", number(totals.leases_lost));
  out.counters("lightmill_results_total", "Tiles from workers: merged, or dropped because they had been merged before.",
               "outcome", {{"merged", number(totals.results_merged)}, {"repeated", number(totals.results_duplicate)}});
  out.counters("lightmill_audits_total",
               "Results that another identity rendered again: right, or wrong, which quarantines a worker.", "outcome",
               {{"right", number(totals.results_audited)}, {"wrong", number(totals.results_wrong)}});
  out.counter("lightmill_pixel_samples_total", "Merged samples of all pixels. Its rate is the farm's speed.",
              number(totals.pixel_samples));
  out.counter("lightmill_jobs_failed_total", "Failed jobs, with those deleted since.", number(totals.jobs_failed));
  out.histogram("lightmill_first_picture_seconds",
                "Time from a job's submission until each of its pixels had a sample.", totals.first_picture);
}

void add_farm(const MetricValues& farm, MetricLines& out) {
  const FarmGauges& gauges = farm.gauges;
  out.begin("lightmill_jobs", "Jobs by state.", "gauge");
  for (std::size_t i = 0; i < gauges.jobs.size(); ++i) {
    out.line(fmt::format("lightmill_jobs{{state=\"{}\"}}", name_of(kJobStates[i])),
             static_cast<double>(gauges.jobs[i]));
  }
  out.begin("lightmill_jobs_waiting", "Jobs that wait, by the reason that lightmill show gives.", "gauge");
  for (std::size_t i = 0; i < gauges.waits.size(); ++i) {
    out.line(fmt::format("lightmill_jobs_waiting{{reason=\"{}\"}}", kWaitReasonNames[i]),
             static_cast<double>(gauges.waits[i]));
  }
  out.gauge("lightmill_leases", "Leases that workers have now.", static_cast<double>(gauges.leases));
  out.gauge("lightmill_queue_pixel_samples",
            "Samples of all pixels that are wanted now and not given to a worker. Without jobs that end only by time.",
            static_cast<double>(gauges.free_pixel_samples));
  out.gauges("lightmill_workers", "Connected workers by state.", "state",
             {{"rendering", static_cast<double>(gauges.rendering)},
              {"idle", static_cast<double>(gauges.idle)},
              {"draining", static_cast<double>(gauges.draining)},
              {"quarantined", static_cast<double>(gauges.quarantined)}});
  out.gauge("lightmill_worker_threads", "Threads of all connected workers.", static_cast<double>(gauges.threads));
  out.gauge("lightmill_results_rate_bytes",
            "Limit of the results of all workers, per second: --results-rate, or less while results wait long.",
            gauges.results_rate);
  out.gauge("lightmill_wanted_workers", "Workers that the farm could use now.", farm.wanted_workers);
  out.gauge("lightmill_storing",
            "0 while no work is leased because nothing can be stored: the database is away, or the disk has less "
            "than --reserve-gib left. Else 1.",
            farm.storing ? 1 : 0);
}

void add_traffic(const Traffic& traffic, MetricLines& out) {
  const auto number = [](const std::atomic<std::uint64_t>& count) { return static_cast<double>(count.load()); };
  out.counters("lightmill_received_bytes_total", "Received bytes: workers' results and uploaded assets.", "what",
               {{"results", number(traffic.results_in)}, {"assets", number(traffic.assets_in)}});
  out.counters("lightmill_sent_bytes_total", "Sent bytes: assets, films, live pictures and replies of the JSON API.",
               "what",
               {{"assets", number(traffic.assets_out)},
                {"films", number(traffic.films_out)},
                {"previews", number(traffic.previews_out)},
                {"answers", number(traffic.answers_out)}});
}

/// proc(5): field 22 of stat counts clock ticks since the system's start, which is btime of /proc/stat. The name before
/// it is in parentheses and may have spaces.
double started_unix_seconds() {
  std::string stat, word;
  std::ifstream own("/proc/self/stat");
  std::getline(own, stat);
  std::istringstream fields(stat.substr(std::min(stat.size(), stat.rfind(')') + 1)));
  for (int field = 3; field < 22 && fields >> word; ++field) {
  }
  double ticks = 0;
  fields >> ticks;
  std::ifstream system("/proc/stat");
  while (system >> word && word != "btime") {
  }
  double booted = 0;
  system >> booted;
  return fields && system ? booted + ticks / static_cast<double>(sysconf(_SC_CLK_TCK)) : 0;
}

}  // namespace

ProcessFigures process_figures() {
  ProcessFigures figures;
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  figures.cpu_seconds = static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec);
  figures.started_unix_seconds = started_unix_seconds();
  std::uint64_t pages = 0, resident_pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages >> resident_pages) {
    figures.resident_bytes = resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  }
  std::error_code error;
  for (std::filesystem::directory_iterator at("/proc/self/fd", error), end; !error && at != end; at.increment(error)) {
    ++figures.open_files;
  }
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  figures.most_open_files = files.rlim_cur;
  return figures;
}

std::string metrics_text(const MetricValues& farm, const Histogram& commit_seconds, const Traffic& traffic,
                         const ProcessFigures& process, std::string_view version) {
  MetricLines out;
  out.gauges("lightmill_build_info", "1, with the program's version.", "version", {{version, 1.0}});
  add_work(farm.totals, out);
  add_farm(farm, out);
  out.histogram("lightmill_commit_seconds", "Time until a transaction is durable.", commit_seconds);
  add_traffic(traffic, out);
  out.counter("process_cpu_seconds_total", "Processor time of the coordinator.", process.cpu_seconds);
  out.gauge("process_start_time_seconds", "Start of the coordinator in Unix time.", process.started_unix_seconds);
  out.gauge("process_resident_memory_bytes", "Resident memory of the coordinator.",
            static_cast<double>(process.resident_bytes));
  out.gauge("process_open_fds", "Open files and connections.", static_cast<double>(process.open_files));
  out.gauge("process_max_fds", "Limit of open files and connections.", static_cast<double>(process.most_open_files));
  return out.take();
}

}  // namespace lightmill
