// One layer of a watched job as all its viewers share it: the job's state, and the tiles, each encoded once.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/runtime/farm_loop.h"
#include "server/web/change_log.h"
#include "server/web/live_messages.h"

namespace lightmill {

/// Runs something on the web's thread. Thread-safe.
using OnWebThread = std::function<void(std::function<void()>)>;

/// Room for the tiles of all feeds together. A picture that would need more waits until others are looked at no longer.
struct TileRoom {
  static constexpr std::size_t kTileBytes = 32 << 10;
  std::size_t most = 0, taken = 0;  ///< tiles
};

/// Belongs to the web's thread; shared, since what the farm thread has under way for it may come late.
class JobFeed : public std::enable_shared_from_this<JobFeed> {
 public:
  /// `layer`: empty for beauty; one that the film does not have gives no tiles. `on_news` runs after every
  /// change.
  JobFeed(JobId job, std::string layer, FarmLoop& loop, OnWebThread on_web_thread, std::shared_ptr<TileRoom> room,
          std::function<void()> on_news);
  ~JobFeed();

  /// Begins to watch, or begins again. What failed stays said until something comes.
  void watch();
  /// Whether it failed, or its picture did, and may do better.
  bool may_retry() const { return !failure_.ok() || (!picture_failure_.ok() && fits()); }

  const std::string& owner() const { return owner_; }
  const Status& failure() const { return failure_; }                  ///< why it is not watched
  const Status& picture_failure() const { return picture_failure_; }  ///< why it has no tiles, though it is watched
  bool known() const { return !state_.empty(); }
  bool ended() const { return ended_; }
  const std::string& state() const { return state_; }  ///< a lightmill.v1.Job
  std::uint64_t state_version() const { return state_version_; }
  const ChangeLog<std::pair<int, int>>& tiles() const { return tiles_; }  ///< by row and column of the upper left pixel
  bool every_tile_has_samples() const { return every_tile_has_samples_; }

 private:
  class Sink;
  void take(const WatchUpdate& update);
  void fail(const Status& why);
  bool make_room(const JobStatus& job);
  bool fits() const { return room_->taken + picture_tiles_ <= room_->most; }
  std::optional<LayerPlace> layer_place(const JobStatus& job) const;

  const JobId job_;
  const std::string layer_;
  FarmLoop& loop_;
  const OnWebThread on_web_thread_;
  const std::shared_ptr<TileRoom> room_;
  const std::function<void()> on_news_;
  std::shared_ptr<Sink> sink_;
  std::string owner_, state_;
  Status failure_, picture_failure_;
  std::uint64_t state_version_ = 0;
  std::size_t picture_tiles_ = 0;  ///< of the whole picture; 0 until they are known
  bool ended_ = false, every_tile_has_samples_ = false, with_tiles_ = false, has_room_ = false;
  ChangeLog<std::pair<int, int>> tiles_;
};

}  // namespace lightmill
