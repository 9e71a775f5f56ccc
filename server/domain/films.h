// Films of ended jobs: which are in memory, and which are read from the store.
//
// A film leaves memory when it was unused for `film_idle`, or when active jobs need its place. The least recently used
// film leaves first. A film with a shared node stays, because dropping it frees nothing. Owns the queue of requested
// films. One film is read at a time. A film larger than the whole limit is read when no other film of an ended job is
// in memory. Takes requests for films, ends of jobs, and time.
#pragma once

#include <deque>
#include <optional>

#include "server/domain/job_table.h"

namespace lightmill {

class Films {
 public:
  Films(const CoordinatorLimits& limits, const JobTable& jobs) : limits_(limits), jobs_(jobs) {}

  /// Whether the job's film is in memory. Counts as a use. If it is not, the next serve() or tick() has it read. The
  /// effects tell when it is there, or that reading takes too long.
  bool use(Job& job, Time now);
  /// The job has ended, or its film is in memory again.
  void keep(Job& job, Time now);
  /// The store has answered a request for the film. The effects notify the waiting clients. The next film is read
  /// later, because it may need the place of this one.
  void answered(JobId job, const Status& status, const Event& event);
  /// Starts to read the next film, if there is room for it.
  void serve(const Event& event);
  /// Drops films until `bytes` more fit. False if they cannot.
  bool make_room(std::uint64_t bytes, Time now);

  void tick(const Event& event);
  std::optional<Time> next_deadline() const;

 private:
  struct Wanted {
    JobId job;
    Time since;
  };
  void give_up(const Event& event);
  std::uint64_t bytes_of(JobId job) const;

  const CoordinatorLimits& limits_;
  const JobTable& jobs_;
  std::deque<Wanted> wanted_;  ///< the first one is being read if `reading_`
  bool reading_ = false;
  Time next_serve_{};               ///< when to try the next read; used while films are wanted and none is being read
  std::optional<Time> next_check_;  ///< when a film may leave memory; set while some are there
};

}  // namespace lightmill
