// Who watches which job: decides when each watcher gets the newest state, and which tiles changed since its last
// message.
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

/// A tile that has changed: one for all watchers that are told of it.
struct WatchedTile {
  TileSnapshot tile;
  mutable std::string preview;  ///< its mean_rgb as bytes, kept by the first who makes them; the farm thread's own
};

/// One message for one watcher.
struct WatchUpdate {
  JobStatus job;
  std::vector<std::shared_ptr<const WatchedTile>> tiles;
  bool last = false;  ///< the job has ended and everything has been sent
};

/// The stream to one watcher. Thread-safe.
class WatchSink {
 public:
  virtual ~WatchSink() = default;
  virtual bool closed() const = 0;
  /// Whether the last update has left, so that another may be offered.
  virtual bool writable() const = 0;
  virtual void offer(const WatchUpdate& update) = 0;
  /// Ends the stream with an error.
  virtual void fail(const Status& status) = 0;
};

/// Not thread-safe; belongs to the farm thread. A watcher gets the state at once, then whenever it changed: at most ten
/// times a second, faster until every tile has its first sample, at once when the job ends. Nothing is queued: who
/// reads slowly gets fewer, newer states, and so does everybody while the farm has much else to do (FarmLoop).
class WatchHub {
 public:
  void add(JobId job, bool with_tiles, std::shared_ptr<WatchSink> sink);
  /// Sends what is due; returns when to call again if nothing else happens.
  std::optional<Time> publish(const Coordinator& farm, Time now);

  /// Sends nothing of the job until release: its end is not durable yet. False if nobody watches it.
  bool hold(JobId job);
  void release(JobId job);

  /// Jobs of which watchers begin to wait for tiles, as their film is not in memory.
  std::set<JobId> take_wanted_films() { return std::exchange(wanted_films_, {}); }
  /// The film is in memory, perhaps only now: those who wait for its tiles get the first ones.
  void film_came(const Coordinator& farm, JobId job, Time now);
  /// The film cannot be read: ends the streams that wait for its tiles.
  void fail_film(JobId job, const Status& status);

 private:
  struct Watcher {
    JobId job;
    bool with_tiles = false;
    std::shared_ptr<WatchSink> sink;
    std::uint64_t sent_version = 0;
    std::vector<std::uint64_t> sent_tiles;  ///< versions
    bool tiles_left = false;                ///< the last message could not hold all that changed
    bool waits_for_film = false;            ///< which is not in memory
    Time next_time{};
  };
  /// All watchers of a job start to look at the same tile, so that most often they are told of the same ones. Each
  /// round starts a golden section further: whichever rounds a watcher takes part in, no tile is passed by for ever.
  struct Round {
    std::uint32_t number = 0;  ///< how many with a full message there were
    bool full = false;         ///< a message of this one cannot hold all that has changed
    std::map<TileId, std::shared_ptr<const WatchedTile>> tiles = {};
  };
  enum class Outcome { keep, remove };
  Outcome publish_to(Watcher& watcher, const Coordinator& farm, Time now, std::optional<Time>& wake);
  bool add_tiles(Watcher& watcher, const Film& film, WatchUpdate& update);

  std::vector<Watcher> watchers_;
  std::map<JobId, Round> rounds_;  ///< of jobs that are watched with tiles
  std::map<JobId, int> held_;      ///< ends that are being committed
  std::set<JobId> wanted_films_;
};

}  // namespace lightmill
