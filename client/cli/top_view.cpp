#include "client/cli/top_view.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "client/cli/progress.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {
namespace {

/// The lines above the tables are wrapped on screens of this size or larger, and cut on smaller ones.
constexpr int kRowsForWrapping = 16, kColumnsForWrapping = 40;

/// The place of a state in the list.
int rank_of(v1::JobState state) {
  return state == v1::JOB_STATE_RUNNING ? 0 : state == v1::JOB_STATE_QUEUED ? 1 : 2;
}

/// "3 working, 1 idle", in order of first appearance.
std::string counts_text(const std::vector<std::string>& kinds) {
  std::vector<std::pair<std::string, std::size_t>> counts;
  for (const std::string& kind : kinds) {
    const auto found = std::ranges::find(counts, kind, &std::pair<std::string, std::size_t>::first);
    if (found == counts.end()) {
      counts.emplace_back(kind, 1);
    } else {
      ++found->second;
    }
  }
  std::vector<std::string> texts;
  for (const auto& [kind, count] : counts) {
    texts.push_back(fmt::format("{} {}", count, kind));
  }
  return texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, ", "));
}

Rows job_rows(const std::vector<v1::Job>& jobs) {
  Rows rows{{"JOB", "STATE", "DONE", "NAME", "ERROR", "ETA", "RATE", "SAMPLES", "OWNER"}};
  for (const v1::Job& job : jobs) {
    const bool running = job.state() == v1::JOB_STATE_RUNNING;
    rows.push_back({std::to_string(job.id()), state_name(job.state()),
                    fmt::format("{:.0f}%", std::floor(100 * fraction_done(job))),
                    job.reason().empty() ? job.name() : fmt::format("{} ({})", job.name(), job.reason()),
                    error_text(job).empty() ? "-" : error_text(job),
                    running && job.reason().empty() && job.eta_seconds() >= 0 ? rough_seconds(job.eta_seconds()) : "-",
                    running ? human_rate(job.samples_per_second()) : "-", short_samples_count(job), job.owner()});
  }
  return rows;
}

/// Cuts a line to `columns`; 0: no limit.
std::string fitted(const std::string& line, int columns) {
  return columns > 0 ? cut_to_columns(line, columns) : line;
}

/// Adds the table in at most `most` lines with its header; empty: all lines that it needs. The last line says how many
/// rows and columns are left out.
void add_table(Rows rows, int columns, std::optional<std::size_t> most, const Coloring& coloring,
               std::vector<std::string>& lines) {
  if (!most) {
    std::ranges::move(format_table(std::move(rows), columns, coloring), std::back_inserter(lines));
    return;
  }
  const std::string hidden = hidden_columns(rows, columns);
  const bool cut = rows.size() + (hidden.empty() ? 0 : 1) > *most;
  const std::size_t left_out = cut ? rows.size() - std::min(*most - 1, rows.size()) : 0;
  rows.resize(rows.size() - left_out);
  std::ranges::move(format_table_in_lines(std::move(rows), columns, coloring), std::back_inserter(lines));
  std::string end = left_out > 0 ? fmt::format("… and {} more", left_out) : "";
  end += end.empty() || hidden.empty() ? hidden : "; " + hidden;
  if (!end.empty()) {
    lines.push_back(fitted(end, columns));
  }
}

}  // namespace

std::string activity(const v1::Worker& worker) {
  if (!worker.quarantine().empty()) {
    return worker.away() ? "quarantine, away" : "quarantine";
  }
  if (worker.draining()) {
    return "draining";
  }
  return worker.leases() > 0 ? "working" : "idle";
}

int color_of_activity(std::string_view activity) {
  return activity.starts_with("quarantine") ? 31 : activity == "working" ? 32 : 0;
}

Rows worker_rows(const std::vector<v1::Worker>& workers) {
  Rows rows{{"WORKER", "STATE", "THREADS", "RATE", "RESULTS", "LOST", "UP"}};
  const bool hosts = std::ranges::any_of(workers, [](const v1::Worker& worker) {
    return !worker.away() && worker.name().find(worker.host()) == std::string::npos;
  });
  if (hosts) {
    rows.front().emplace_back("HOST");
  }
  for (const v1::Worker& worker : workers) {
    std::vector<std::string>& row = rows.emplace_back();
    row = worker.away() ? std::vector<std::string>{worker.name(), activity(worker), "-", "-", "-", "-", "-"}
                        : std::vector<std::string>{worker.name(),
                                                   activity(worker),
                                                   std::to_string(worker.threads()),
                                                   human_rate(worker.samples_per_second()),
                                                   std::to_string(worker.results()),
                                                   std::to_string(worker.leases_lost()),
                                                   human_seconds(worker.connected_seconds())};
    if (hosts) {
      row.push_back(worker.away() ? "-" : worker.host());
    }
  }
  return rows;
}

std::vector<std::string> top_lines(const TopSnapshot& snapshot, int columns, int rows, bool color) {
  std::vector<v1::Job> jobs = snapshot.jobs;
  std::erase_if(jobs, [](const v1::Job& job) { return has_ended(job.state()); });
  // Within a state: jobs in work first, then those that come next.
  std::ranges::sort(jobs, {}, [](const v1::Job& job) {
    return std::tuple(rank_of(job.state()), job.samples_per_second() <= 0, -job.priority(), job.id());
  });
  std::vector<v1::Worker> workers = snapshot.workers;
  std::ranges::sort(workers, [](const v1::Worker& a, const v1::Worker& b) {
    return std::tuple(-a.samples_per_second(), a.name()) < std::tuple(-b.samples_per_second(), b.name());
  });

  std::vector<std::string> job_kinds, worker_kinds;
  for (const v1::Job& job : jobs) {
    job_kinds.push_back(state_name(job.state()));
  }
  std::uint64_t threads = 0;
  double rate = 0;
  for (const v1::Worker& worker : workers) {
    worker_kinds.push_back(activity(worker));
    threads += worker.away() ? 0 : worker.threads();
    rate += worker.samples_per_second();
  }
  std::ranges::sort(worker_kinds, std::greater());
  std::vector<std::string> lines{
      fmt::format("farm     {}", snapshot.server),
      fmt::format("workers  {}; {}, {}; jobs could keep {} busy", counts_text(worker_kinds), counted(threads, "thread"),
                  human_rate(rate), counted(snapshot.wanted, "worker")),
      fmt::format("jobs     {}", counts_text(job_kinds)),
  };
  if (!snapshot.trouble.empty()) {
    lines.insert(lines.begin(), "out of date: " + printable(snapshot.trouble));
  }
  for (const std::string& notice : snapshot.notices) {
    lines.push_back("note     " + printable(notice));
  }
  std::vector<std::string> fitting;
  for (const std::string& line : lines) {
    const bool wrapped = columns > 0 && columns_of(line) > columns &&
                         (rows == 0 || (rows >= kRowsForWrapping && columns >= kColumnsForWrapping));
    std::ranges::move(wrapped ? wrap_to_columns(line, columns) : std::vector{fitted(line, columns)},
                      std::back_inserter(fitting));
  }
  lines = std::move(fitting);

  const Rows job_table = job_rows(jobs), worker_table = worker_rows(workers);
  // Each table gets the rows that the other leaves, and at least half.
  constexpr std::size_t kMin = 2;  // a header, and one row or the number of rows
  std::optional<std::size_t> most_jobs, most_workers;
  if (rows > 0) {
    const std::size_t blank = 2;
    const std::size_t used = lines.size() + blank;
    const std::size_t room = std::max(static_cast<std::size_t>(rows) > used ? rows - used : 0, 2 * kMin);
    const std::size_t half = room / 2;
    const auto lines_of = [&](const Rows& table) {
      return table.size() == 1 ? 1 : table.size() + (hidden_columns(table, columns).empty() ? 0 : 1);
    };
    most_jobs = std::min(lines_of(job_table), std::max(half, room - std::min(room - kMin, lines_of(worker_table))));
    most_workers = std::min(lines_of(worker_table), room - *most_jobs);
  }
  if (!jobs.empty()) {
    lines.emplace_back();
    add_table(job_table, columns, most_jobs, color ? Coloring{1, color_of_state} : Coloring(), lines);
  }
  if (!workers.empty()) {
    lines.emplace_back();
    add_table(worker_table, columns, most_workers, color ? Coloring{1, color_of_activity} : Coloring(), lines);
  }
  if (rows > 0 && lines.size() > static_cast<std::size_t>(rows)) {
    lines.resize(static_cast<std::size_t>(rows));
  }
  return lines;
}

}  // namespace lightmill::cli
