// Metrics of the farm: totals since the coordinator started, and a snapshot.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/base/histogram.h"
#include "common/farm/job.h"

namespace lightmill {

/// Seconds.
inline constexpr std::array kFirstPictureBounds{0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0};

/// Counters that only grow.
struct FarmTotals {
  std::uint64_t leases_granted = 0;  ///< with copies, pilots and audits
  std::uint64_t leases_lost = 0;
  std::uint64_t results_merged = 0;
  std::uint64_t results_duplicate = 0;  ///< of samples that were merged before
  std::uint64_t results_audited = 0;    ///< an audit gave the same bits
  std::uint64_t results_wrong = 0;      ///< each put a worker into quarantine
  std::uint64_t pixel_samples = 0;      ///< merged
  std::uint64_t jobs_failed = 0;
  Histogram first_picture{kFirstPictureBounds};  ///< seconds from a job's submission until every pixel had a sample
};

/// Why a job waits (WaitReasons). In the order of kWaitReasonNames.
enum class WaitReason {
  storage,        ///< nothing can be stored, or the disk is full
  missing_file,   ///< an asset was lost
  dispute,        ///< two identities differ, and no third is connected
  audit,          ///< it has its samples, and no identity that may audit them is connected
  silent_worker,  ///< its workers have brought no result for long
  quarantine,     ///< the workers that may render it are in quarantine or leave
  leaving,        ///< they leave
  refused,        ///< workers of one identity refused it
  larger_worker,  ///< it exceeds the limits of all workers
  other_kind,     ///< no worker has its renderer version and fingerprint class
  no_worker,      ///< none is connected
};
inline constexpr std::array<std::string_view, 11> kWaitReasonNames{
    "storage", "missing_file", "dispute",       "audit",      "silent_worker", "quarantine",
    "leaving", "refused",      "larger_worker", "other_kind", "no_worker"};

/// State of the farm at one moment.
struct FarmGauges {
  std::array<std::uint64_t, kJobStates.size()> jobs{};         ///< by JobState
  std::array<std::uint64_t, kWaitReasonNames.size()> waits{};  ///< jobs in progress, by WaitReason
  std::uint64_t leases = 0;
  /// Neither rendered nor leased, of jobs in progress. Jobs that end only by time do not count.
  std::uint64_t free_pixel_samples = 0;
  // Workers that are connected.
  std::uint64_t rendering = 0, idle = 0, draining = 0, quarantined = 0;
  std::uint64_t threads = 0;
  double results_rate = 0;  ///< bytes per second that all workers together may send
};

}  // namespace lightmill
