// Limits of the coordinator: every queue has one.
#pragma once

#include <cstdint>

#include "common/base/clock.h"

namespace lightmill {

struct CoordinatorLimits {
  Duration heartbeat_interval = std::chrono::seconds(2);
  Duration lease_duration = std::chrono::seconds(20);  ///< without renewal a lease is lost
  /// The session of a worker that is silent for so long ends: TCP does not detect every dead link.
  Duration silence = std::chrono::seconds(30);
  double unit_seconds = 1.0;  ///< aim of a unit, at its worker's measured speed; longer if results would be too many
  double result_bytes_per_second = 192.0 * 1024 * 1024;  ///< that all workers send together, at most
  std::uint32_t leases_per_worker = 2;                   ///< one to work on, one ahead
  Duration disconnect_grace = std::chrono::seconds(3);   ///< leases of a broken stream expire after so long
  Duration restart_grace = std::chrono::seconds(2);      ///< after a start, workers may come back with what they hold
  Duration copy_after = std::chrono::milliseconds(100);  ///< a lease is copied to an idle worker from this age on
  Duration copy_pilot_after = std::chrono::milliseconds(500);  ///< the same of pilots, whose time cannot be foreseen
  /// Of nodes that are leased or wait to be joined; never below four nodes a tile.
  std::uint64_t film_bytes_per_job = std::uint64_t{1} << 30;
  /// Of all films in memory: those of active jobs when they are done, more of which is refused, and in what they leave
  /// those of ended jobs that were used last.
  std::uint64_t film_bytes = std::uint64_t{8} << 30;
  Duration film_idle = std::chrono::minutes(10);  ///< an ended job's film leaves memory, unused for so long
  /// A tile (or pilot) with which `losses_before_alone` workers were lost in a row goes to workers that have nothing
  /// else. Its job fails once `losses_alone` of those are lost too.
  std::uint32_t losses_before_alone = 2, losses_alone = 3;
  /// CPU time that a thread may take for one range of a tile. Beyond it, the range is cut to one sample.
  double tile_cpu_seconds = 600;
  /// A lease of which no result comes for so long is lost, however often its worker is heard.
  Duration result_patience() const { return 2 * from_seconds(tile_cpu_seconds); }
  std::uint32_t refusals = 2;         ///< identities that say that nobody can render a job, until it fails
  std::uint32_t max_bad_results = 3;  ///< a worker that sends so many damaged results is dismissed
  /// A job whose film is complete waits for identities that could audit some of it and were here so lately.
  Duration auditor_patience = std::chrono::seconds(45);
  std::uint32_t max_jobs = 10'000;
  std::uint32_t max_jobs_per_owner = 2'000;
  std::uint32_t max_workers = 10'000;
  Duration keep_ended{};  ///< jobs that have ended are deleted after so long; 0: never
};

}  // namespace lightmill
