#include "client/cli/top_view.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

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

/// Numbers of waiting jobs that are listed for a reason.
constexpr std::size_t kWaitingNamed = 5;

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
  Rows rows{{"JOB", "NAME", "STATE", "DONE", "ERROR", "ETA", "RATE", "SAMPLES", "OWNER"}};
  for (const v1::Job& job : jobs) {
    const bool running = job.state() == v1::JOB_STATE_RUNNING;
    rows.push_back({std::to_string(job.id()), job.name(), state_name(job.state()),
                    fmt::format("{:.0f}%", std::floor(100 * fraction_done(job))),
                    error_text(job).empty() ? "-" : error_text(job),
                    running && job.reason().empty() && job.samples_per_second() > 0 && job.eta_seconds() >= 0
                        ? rough_seconds(job.eta_seconds())
                        : "-",
                    running ? human_rate(job.samples_per_second()) : "-", short_samples_count(job), job.owner()});
  }
  return rows;
}

/// Cuts a line to `columns`; 0: no limit.
std::string fitted(const std::string& line, int columns) {
  return columns > 0 ? cut_to_columns(line, columns) : line;
}

/// A table, and notes below it.
struct Section {
  std::vector<std::vector<std::string>> rows;  ///< the lines of each row, the header first
  std::vector<std::string> notes;

  std::size_t lines() const {
    return std::accumulate(rows.begin(), rows.end(), notes.size(),
                           [](std::size_t sum, const auto& row) { return sum + row.size(); });
  }
};

/// A header, and one row or the number of rows.
constexpr std::size_t kMinLines = 2;

/// Adds at most `most` lines of the section. If it has more, a line says how many rows are left out.
void add_section(Section section, int columns, std::size_t most, std::vector<std::string>& lines) {
  std::size_t room = section.lines();
  if (room > most) {
    section.notes.resize(std::min(section.notes.size(), (most - kMinLines) / 2));
    room = most - section.notes.size() - 1;
  }
  std::size_t shown = 0;
  for (; shown < section.rows.size() && section.rows[shown].size() <= room; ++shown) {
    room -= section.rows[shown].size();
    std::ranges::move(section.rows[shown], std::back_inserter(lines));
  }
  if (const std::size_t left_out = section.rows.size() - std::max<std::size_t>(shown, 1); left_out > 0) {
    lines.push_back(fitted(fmt::format("… and {} more", left_out), columns));
  }
  std::ranges::move(section.notes, std::back_inserter(lines));
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

bool is_shown_by_others(const v1::Worker& worker, const std::vector<v1::Worker>& workers) {
  return worker.away() && std::ranges::any_of(workers, [&](const v1::Worker& other) {
           return !other.away() && !other.quarantine().empty() && other.name().starts_with(worker.name() + "/");
         });
}

Rows worker_rows(const std::vector<v1::Worker>& workers) {
  Rows rows{{"WORKER", "STATE", "THREADS", "RATE", "RESULTS", "LOST", "UP"}};
  const bool hosts = std::ranges::any_of(workers, [](const v1::Worker& worker) {
    return !worker.away() && worker.name().find(worker.host()) == std::string::npos;
  });
  if (hosts) {
    rows.front().emplace_back("HOST");
  }
  std::set<std::string> classes;
  for (const v1::Worker& worker : workers) {
    if (!worker.away()) {
      classes.insert(worker.fingerprint_class());
    }
  }
  if (classes.size() > 1) {
    rows.front().emplace_back("CLASS");
  }
  for (const v1::Worker& worker : workers) {
    if (is_shown_by_others(worker, workers)) {
      continue;
    }
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
    if (classes.size() > 1) {
      row.push_back(worker.away() ? "-" : worker.fingerprint_class());
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
    worker_kinds.push_back((worker.quarantine().empty() ? "" : "in ") + activity(worker));
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

  Section job_section{format_rows(job_rows(jobs), columns, color ? Coloring{2, color_of_state} : Coloring()), {}};
  for (const std::string& reason : wait_texts(jobs, kWaitingNamed)) {
    const std::string text = printable(reason);
    std::ranges::move(columns > 1 ? wrap_to_columns(text, columns) : std::vector{text},
                      std::back_inserter(job_section.notes));
  }
  const Section worker_section{
      format_rows(worker_rows(workers), columns, color ? Coloring{1, color_of_activity} : Coloring()), {}};
  // Each table gets the lines that the other leaves, and at least half.
  std::size_t most_jobs = job_section.lines(), most_workers = worker_section.lines();
  if (rows > 0) {
    const std::size_t blank = 2;
    const std::size_t used = lines.size() + blank;
    const std::size_t room = std::max(static_cast<std::size_t>(rows) > used ? rows - used : 0, 2 * kMinLines);
    most_jobs = std::min(most_jobs, std::max(room / 2, room - std::min(room - kMinLines, most_workers)));
    most_workers = std::min(most_workers, room - most_jobs);
  }
  if (!jobs.empty()) {
    lines.emplace_back();
    add_section(std::move(job_section), columns, most_jobs, lines);
  }
  if (!workers.empty()) {
    lines.emplace_back();
    add_section(worker_section, columns, most_workers, lines);
  }
  if (rows > 0 && lines.size() > static_cast<std::size_t>(rows)) {
    lines.resize(static_cast<std::size_t>(rows));
  }
  return lines;
}

}  // namespace lightmill::cli
