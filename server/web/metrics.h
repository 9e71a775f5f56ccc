// The farm's metrics for Prometheus. docs/reference/metrics.md lists them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/histogram.h"
#include "server/domain/farm_metrics.h"
#include "server/runtime/traffic.h"

namespace lightmill {

inline constexpr std::string_view kMetricsPath = "/metrics";
inline constexpr std::string_view kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

/// Values from the farm thread.
struct MetricValues {
  FarmTotals totals;
  FarmGauges gauges;
  std::uint32_t wanted_workers = 0;
  bool storing = true;  ///< results can be stored durably, and there is space for them
};

/// Values of this process from the kernel.
struct ProcessFigures {
  double cpu_seconds = 0;
  double started_unix_seconds = 0;  ///< 0: unknown
  std::uint64_t resident_bytes = 0;
  std::uint64_t open_files = 0, most_open_files = 0;
};
ProcessFigures process_figures();

/// Prometheus text format, version 0.0.4.
std::string metrics_text(const MetricValues& farm, const Histogram& commit_seconds, const Traffic& traffic,
                         const ProcessFigures& process, std::string_view version);

}  // namespace lightmill
