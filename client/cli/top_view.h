// The screen of `lightmill top`. Pure.
#pragma once

#include <string>
#include <vector>

#include "client/cli/table.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// A farm at one moment.
struct TopSnapshot {
  std::string server;         ///< HOST:PORT
  std::vector<v1::Job> jobs;  ///< the view leaves out ended jobs
  std::vector<v1::Worker> workers;
  std::uint32_t wanted = 0;          ///< the number of workers that the farm could use
  std::vector<std::string> notices;  ///< facts about the farm that every user should know
  std::string trouble;               ///< why this state is old; empty: it is current
};

/// A worker's activity: "working", "idle", "draining", "quarantine", "quarantine, away".
std::string activity(const v1::Worker& worker);
/// The SGR code for an activity: red, green. 0: none.
int color_of_activity(std::string_view activity);

/// Whether the row is only an identity in quarantine, and workers of it are connected and in quarantine, too.
bool is_shown_by_others(const v1::Worker& worker, const std::vector<v1::Worker>& workers);

/// A header, and a row for each worker except those that is_shown_by_others. HOST is there only if a worker's name does
/// not have its host, and CLASS if there are several fingerprint classes.
Rows worker_rows(const std::vector<v1::Worker>& workers);

/// The lines: trouble, the farm's totals, its jobs that have not ended (active ones first, each state by number), its
/// workers (the fastest first). They fit `columns` and `rows`; 0: no limit. Without a limit of rows, lines are wrapped
/// instead of cut.
std::vector<std::string> top_lines(const TopSnapshot& snapshot, int columns, int rows, bool color = false);

}  // namespace lightmill::cli
