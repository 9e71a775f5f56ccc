// The farm's figures as Prometheus reads them. docs/operate/monitoring.md says what they tell.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/histogram.h"
#include "server/domain/farm_totals.h"
#include "server/runtime/traffic.h"

namespace lightmill {

inline constexpr std::string_view kMetricsPath = "/metrics";
inline constexpr std::string_view kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

/// What the farm thread knows.
struct FarmMetrics {
  FarmTotals totals;
  FarmSnapshot snapshot;
  std::uint32_t wanted_workers = 0;
  bool storing = true;  ///< there is room for what is rendered, and it can be made durable
};

/// What the kernel knows of this process.
struct ProcessFigures {
  double cpu_seconds = 0;
  double started_unix_seconds = 0;  ///< 0 if it does not tell
  std::uint64_t resident_bytes = 0;
  std::uint64_t open_files = 0, most_open_files = 0;
};
ProcessFigures process_figures();

/// In Prometheus' text format, version 0.0.4.
std::string metrics_text(const FarmMetrics& farm, const Histogram& commit_seconds, const Traffic& traffic,
                         const ProcessFigures& process, std::string_view version);

}  // namespace lightmill
