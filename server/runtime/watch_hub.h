// Watch hub: decides when each watcher of a job gets the newest state, and which tiles changed since its last message.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/ids.h"
#include "common/base/status.h"
#include "common/farm/job.h"
#include "server/assembly/tile_snapshot.h"
#include "server/domain/coordinator.h"

namespace lightmill {

/// Changed tile, shared by all watchers that get it.
struct WatchedTile {
  TileSnapshot tile;
  mutable std::string preview;  ///< its mean_rgb as bytes, made at the first use; only for the farm thread
};

/// Message for one watcher.
struct WatchUpdate {
  JobStatus job;
  std::vector<std::shared_ptr<const WatchedTile>> tiles;
  bool last = false;  ///< the job has ended and everything has been sent
};

/// Stream to one watcher. Thread-safe.
class WatchSink {
 public:
  virtual ~WatchSink() = default;
  /// Whether the stream has ended. Asked at least once a second.
  virtual bool closed() = 0;
  /// Whether the last update was sent, so that another can be offered.
  virtual bool writable() const = 0;
  virtual void offer(const WatchUpdate& update) = 0;
  /// Ends the stream with an error.
  virtual void fail(const Status& status) = 0;
};

/// Not thread-safe: only for the farm thread. A watcher gets the state at once, then after changes, at most 10 times a
/// second. Until every tile has its first sample, the limit is 50 times a second. Nothing is queued. A slow reader gets
/// fewer, newer states, and so do all watchers while the farm thread is busy (FarmLoop).
class WatchHub {
 public:
  void add(JobId job, bool with_tiles, std::shared_ptr<WatchSink> sink);
  /// Sends what is due. Returns when to call again if no event comes.
  std::optional<Time> publish(const Coordinator& farm, Time now);

  /// The job's watchers get its next change at once.
  void hurry(JobId job);

  /// Jobs whose watchers started to wait for tiles, because the film is not in memory.
  std::set<JobId> take_wanted_films() { return std::exchange(wanted_films_, {}); }
  /// The film is in memory, perhaps only during this call. Watchers that wait for its tiles get the first ones.
  void film_loaded(const Coordinator& farm, JobId job, Time now);
  /// The film cannot be read. Ends the streams that wait for its tiles.
  void fail_film(JobId job, const Status& status);

 private:
  struct Watcher {
    JobId job;
    bool with_tiles = false;
    std::shared_ptr<WatchSink> sink;
    std::uint64_t sent_version = 0;
    std::vector<std::uint64_t> sent_tiles;  ///< versions
    bool tiles_left = false;                ///< the last message could not hold all changed tiles
    bool waits_for_film = false;            ///< its film is not in memory
    Time next_time{};
  };
  /// In a round, all watchers of a job start at the same tile, so that they mostly share the snapshots of tiles. Each
  /// full round starts 0.618 of the tiles later. So a watcher gets every tile, whichever rounds it takes part in.
  struct Round {
    std::uint32_t number = 0;  ///< count of earlier rounds with a full message
    bool full = false;         ///< a message of this round could not hold all changed tiles
    std::map<TileId, std::shared_ptr<const WatchedTile>> tiles = {};
  };
  enum class Outcome { keep, remove };
  Outcome publish_to(Watcher& watcher, const Coordinator& farm, Time now, std::optional<Time>& wake);
  bool add_tiles(Watcher& watcher, const Film& film, WatchUpdate& update);

  std::vector<Watcher> watchers_;
  std::map<JobId, Round> rounds_;  ///< for jobs that are watched with tiles
  std::set<JobId> wanted_films_;
};

}  // namespace lightmill
