// Films of ended jobs: which are in memory, and which are to be read from the store.
//
// A film leaves memory when nobody has asked for it for a while, or when the films of active jobs need its place: the
// one that was used least lately goes first. One that somebody still holds a node of stays: it would free nothing. Owns
// the queue of films that are waited for, of which one is read at a time. A film that needs more room than there ever
// is comes alone. Takes: requests for films, ends of jobs, time.
#pragma once

#include <deque>
#include <optional>

#include "server/domain/jobs.h"

namespace lightmill {

class Films {
 public:
  Films(const CoordinatorLimits& limits, const JobTable& jobs) : limits_(limits), jobs_(jobs) {}

  /// Whether the job's film is in memory, which counts as a use of it. If not, it is read, with the next serve() or
  /// tick(); then, or when that takes too long, the effects say so.
  bool use(Job& job, Time now);
  /// The job has ended, or its film has come back.
  void keep(Job& job, Time now);
  /// The store was asked for the film, and has answered. Those who wait for it are told; the next one is read later, as
  /// it may need this one's place.
  void answered(JobId job, const Status& status, const Event& event);
  /// Has the next film read, once there is room for it.
  void serve(const Event& event);
  /// Films leave memory until so much more has room. False if that cannot be.
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
  Time next_serve_{};              ///< while films are wanted, and none is being read
  std::optional<Time> next_look_;  ///< when a film may leave; while some are in memory
};

}  // namespace lightmill
