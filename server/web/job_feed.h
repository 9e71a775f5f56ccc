// Feed of one layer of a watched job, shared by all its viewers. It has the job's state and its tiles, each encoded
// once.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/runtime/farm_loop.h"
#include "server/web/change_log.h"
#include "server/web/live_denoiser.h"
#include "server/web/live_messages.h"

namespace lightmill {

/// Limit for the tiles of all feeds. A picture that exceeds it waits until others are closed.
struct TileBudget {
  static constexpr std::size_t kTileBytes = 32 << 10;
  std::size_t most = 0, taken = 0;  ///< tiles
  /// Pixels of a picture that is denoised. Its memory is half of that of all tiles at most.
  std::int64_t most_denoised() const {
    constexpr std::size_t kBytesOfPixel = 256;
    return std::min(kMaxDenoisedPixels, static_cast<std::int64_t>(most * kTileBytes / 2 / kBytesOfPixel));
  }
};

/// Used on the web thread. It is shared, because functions on the farm thread may end later than the feed.
class JobFeed : public std::enable_shared_from_this<JobFeed> {
 public:
  /// `layer`: empty for beauty. kDenoisedLayer is made by `denoiser`. A layer that the film does not have gives no
  /// tiles. `on_change` runs after each change.
  JobFeed(JobId job, std::string layer, FarmLoop& loop, OnWebThread on_web_thread,
          std::shared_ptr<TileBudget> tile_budget, LiveDenoiser& denoiser, std::function<void()> on_change);
  ~JobFeed();

  /// Starts to watch, or starts again. An earlier failure stays until an update arrives.
  void watch();
  /// Stops, because nobody watches it any more.
  void close();
  /// Whether it or its picture failed, and another attempt may succeed.
  bool may_retry() const {
    const bool too_large = picture_failure_.code() == StatusCode::kFailedPrecondition;
    return !failure_.ok() || (!picture_failure_.ok() && !too_large && (has_room_ || fits()));
  }

  const std::string& owner() const { return owner_; }
  const Status& failure() const { return failure_; }  ///< why the job is not watched
  /// why it has no tiles, although the job is watched
  const Status& picture_failure() const { return picture_failure_; }
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
  void denoise(const JobStatus& job, const LayerSlice& features);
  void order_denoised();
  void take_denoised(const Result<LiveDenoiser::Picture>& picture);
  bool fits() const { return tile_budget_->taken + picture_tiles_ <= tile_budget_->most; }
  std::optional<LayerSlice> slice_of_layer(const JobStatus& job) const;

  const JobId job_;
  const std::string layer_;
  FarmLoop& loop_;
  const OnWebThread on_web_thread_;
  const std::shared_ptr<TileBudget> tile_budget_;
  LiveDenoiser& denoiser_;
  const std::function<void()> on_change_;
  std::shared_ptr<Sink> sink_;
  std::string owner_, state_;
  Status failure_, picture_failure_;
  std::uint64_t state_version_ = 0;
  std::size_t picture_tiles_ = 0;       ///< of the whole picture; 0: unknown yet
  std::uint64_t denoised_version_ = 0;  ///< of the film whose denoised picture is shown
  LayerSlice features_;
  bool denoising_ = false, denoise_again_ = false;
  bool ended_ = false, every_tile_has_samples_ = false, with_tiles_ = false, has_room_ = false;
  ChangeLog<std::pair<int, int>> tiles_;
};

}  // namespace lightmill
