// What `lightmill top` shows: pure.
#pragma once

#include <string>
#include <vector>

#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// A farm at one moment.
struct FarmLook {
  std::string server;         ///< HOST:PORT
  std::vector<v1::Job> jobs;  ///< ended ones are not shown
  std::vector<v1::Worker> workers;
  std::uint32_t wanted = 0;          ///< how many workers the farm could use
  std::vector<std::string> notices;  ///< what everybody should know of it
  std::string trouble;               ///< why this is what it was, not what it is; empty: it is
};

/// What a worker does: "working", "idle", "draining", "quarantine", "quarantine, away".
std::string activity(const v1::Worker& worker);

/// What trouble there is, the farm's sums, its jobs that have not ended (those at work first, each kind by number), its
/// workers (the fastest first). `columns`, `rows`: no wider and no more than that; 0: as it comes.
std::vector<std::string> top_lines(const FarmLook& look, int columns, int rows);

}  // namespace lightmill::cli
