// Limits of the coordinator. Every queue and every retry has one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "common/base/clock.h"

namespace lightmill {

struct CoordinatorLimits {
  Duration heartbeat_interval = std::chrono::seconds(2);
  Duration lease_duration = std::chrono::seconds(20);  ///< without renewal a lease is lost
  /// A worker's session ends after this time of silence, because TCP does not detect every dead link.
  Duration silence = std::chrono::seconds(30);
  double unit_seconds =
      1.0;  ///< target time of a unit at its worker's measured speed; longer if results would be too many
  double result_bytes_per_second = 192.0 * 1024 * 1024;  ///< limit of all workers together
  std::uint32_t leases_per_worker = 2;                   ///< one to render, one ahead
  /// The threads that a worker claims are believed up to this number, or up to the number of results that it delivered
  /// in this session.
  std::uint32_t threads_at_first = 16;
  /// Tiles of one sample of a job that a worker may hold. It may hold more if it recently delivered more of the job.
  std::uint32_t tiles_at_first = 64;
  Duration disconnect_grace = std::chrono::seconds(3);   ///< leases of a broken stream expire after this time
  Duration restart_grace = std::chrono::seconds(2);      ///< after a restart, workers may come back with their leases
  Duration copy_after = std::chrono::milliseconds(100);  ///< least age of a lease that is copied to an idle worker
  Duration copy_pilot_after = std::chrono::milliseconds(500);  ///< the same for pilots, whose time is unknown
  /// Memory for nodes that are leased or wait for their sibling. At least four nodes per tile.
  std::uint64_t film_bytes_per_job = std::uint64_t{1} << 30;
  /// Memory for all films. Active jobs count with their finished size, and jobs that exceed the limit are refused.
  /// The rest is a cache for films of ended jobs.
  std::uint64_t film_bytes = std::uint64_t{8} << 30;
  /// Disk for one owner's films, with those of ended jobs. Active jobs count with their finished size.
  std::uint64_t film_bytes_per_owner = std::numeric_limits<std::uint64_t>::max();
  Duration film_idle = std::chrono::minutes(10);  ///< an unused film of an ended job leaves memory after this time
  /// After `losses_before_alone` lost workers in a row, a tile or pilot goes only to workers without other leases. An
  /// identity that loses `losses_alone` of those gets no more of the job. It fails after that number of identities.
  std::uint32_t losses_before_alone = 2, losses_alone = 3;
  /// CPU time of a thread for one range of a tile, or for a pilot. Beyond it, the range is cut to one sample. The pilot
  /// is ended, and counts as refused.
  double tile_cpu_seconds = 600;
  /// A lease is lost after this time without a result, even if its worker sends heartbeats.
  Duration result_timeout() const { return 2 * from_seconds(tile_cpu_seconds); }
  std::uint32_t refusals = 2;         ///< a job fails after refusals by this number of identities
  std::uint32_t max_bad_results = 3;  ///< a session ends after this number of invalid results of its identity
  /// A job with a complete film waits for auditors that sent a message within this time.
  Duration auditor_timeout = std::chrono::seconds(45);
  /// Size of the scenes of all jobs, with ended ones. Those of one owner may have half of it.
  std::uint64_t scene_bytes = std::uint64_t{4} << 30;
  std::uint32_t max_jobs = 10'000;
  std::uint32_t max_jobs_per_owner = 2'000;
  std::uint32_t max_workers = 10'000;
  Duration keep_ended{};  ///< ended jobs are deleted after this time; 0: never
};

/// Delay before a worker gets work again after it failed at that work (exponential backoff). Zero after the first
/// failure, 0.5 s after the second, then doubled by each further one, at most 32 s.
inline Duration retry_delay(std::uint32_t times) {
  constexpr Duration kMin = std::chrono::milliseconds(500), kMax = std::chrono::seconds(32);
  return times < 2 ? Duration::zero() : std::min(kMin * (1 << std::min(times - 2, 16u)), kMax);
}

}  // namespace lightmill
