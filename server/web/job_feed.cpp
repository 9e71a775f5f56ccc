#include "server/web/job_feed.h"

#include "common/film/reconstruct.h"

namespace lightmill {

/// Takes one update at a time. The farm keeps only the newest one until the web thread has encoded the last one.
class JobFeed::Sink final : public WatchSink, public std::enable_shared_from_this<Sink> {
 public:
  Sink(std::weak_ptr<JobFeed> feed, FarmLoop& loop, OnWebThread on_web_thread)
      : feed_(std::move(feed)), loop_(loop), on_web_thread_(std::move(on_web_thread)) {}

  bool closed() override { return closed_; }
  bool writable() const override { return !busy_ && !closed_; }
  void offer(const WatchUpdate& update) override {
    busy_ = true;
    on_web_thread_([self = shared_from_this(), update] {
      if (const auto feed = self->feed(); feed != nullptr) {
        feed->take(update);
      }
      self->busy_ = false;
      if (!self->closed_) {
        self->loop_.wake();
      }
    });
  }
  void fail(const Status& status) override {
    closed_ = true;
    on_web_thread_([self = shared_from_this(), status] {
      if (const auto feed = self->feed_.lock(); feed != nullptr && feed->sink_ == self) {
        feed->fail(status);
      }
    });
  }
  void close() { closed_ = true; }

 private:
  /// Null if the feed is gone or was started again.
  std::shared_ptr<JobFeed> feed() const {
    const std::shared_ptr<JobFeed> feed = feed_.lock();
    return feed != nullptr && feed->sink_.get() == this && !closed_ ? feed : nullptr;
  }

  const std::weak_ptr<JobFeed> feed_;
  FarmLoop& loop_;
  const OnWebThread on_web_thread_;
  std::atomic<bool> busy_ = false, closed_ = false;
};

JobFeed::JobFeed(JobId job, std::string layer, FarmLoop& loop, OnWebThread on_web_thread,
                 std::shared_ptr<TileBudget> tile_budget, LiveDenoiser& denoiser, std::function<void()> on_change)
    : job_(job),
      layer_(std::move(layer)),
      loop_(loop),
      on_web_thread_(std::move(on_web_thread)),
      tile_budget_(std::move(tile_budget)),
      denoiser_(denoiser),
      on_change_(std::move(on_change)) {}

JobFeed::~JobFeed() {
  if (has_room_) {
    tile_budget_->taken -= picture_tiles_;
  }
  close();
}

void JobFeed::close() {
  if (sink_ != nullptr) {
    sink_->close();
  }
}

void JobFeed::watch() {
  close();
  sink_ = std::make_shared<Sink>(weak_from_this(), loop_, on_web_thread_);
  ended_ = false;
  with_tiles_ = picture_failure_.ok() || fits();
  const bool sends_tiles = with_tiles_ && layer_ != kDenoisedLayer;
  if (!loop_.post([job = job_, with_tiles = sends_tiles, sink = sink_](FarmLoop::TaskContext& context) {
        context.watchers.add(job, with_tiles, sink);
      })) {
    failure_ = resource_exhausted("the farm has too much to do at once: trying again");
  }
}

void JobFeed::take(const WatchUpdate& update) {
  failure_ = ok_status();
  const bool first = !known();
  owner_ = update.job.spec.owner;
  every_tile_has_samples_ = update.job.min_tile_samples > 0;
  ended_ = update.last;
  if (std::string state = job_bytes(update.job, true); state != state_) {
    state_ = std::move(state);
    ++state_version_;
  }
  if (first) {
    on_change_();
    if (sink_->closed()) {
      return;  // nobody who watches it may see the job
    }
  }
  const std::optional<LayerSlice> slice = slice_of_layer(update.job);
  if (slice && layer_ == kDenoisedLayer) {
    denoise(update.job, *slice);
  } else if (slice && with_tiles_ && make_room(update.job)) {
    for (const auto& shared : update.tiles) {
      const TileSnapshot& tile = shared->tile;
      tiles_.put({tile.rect.y, tile.rect.x},
                 tile_field(job_, layer_, tile.rect, tile.samples, view_pixels(tile, *slice)));
    }
  }
  on_change_();
}

/// Reserves room for the whole picture, so a picture that is shown can be completed. Without room, the job is watched
/// without tiles.
bool JobFeed::make_room(const JobStatus& job) {
  picture_tiles_ = TileGrid(job.spec.settings.crop).picture_tiles();
  if (!has_room_ && fits()) {
    has_room_ = true;
    tile_budget_->taken += picture_tiles_;
    picture_failure_ = ok_status();
  }
  if (!has_room_) {
    picture_failure_ = resource_exhausted(
        "it has {} tiles. The pictures on all open pages of this farm may have {} together, and others have {}. "
        "{}`lightmill fetch` gets it",
        picture_tiles_, tile_budget_->most, tile_budget_->taken,
        picture_tiles_ <= tile_budget_->most ? "It appears when those pages are closed. " : "");
    watch();
  }
  return has_room_;
}

/// The picture's tiles come from the denoiser. While it makes one, updates only note that the film has changed.
void JobFeed::denoise(const JobStatus& job, const LayerSlice& features) {
  const std::int64_t pixels = job.spec.settings.crop.pixel_count(), most = tile_budget_->most_denoised();
  if (pixels > most) {
    picture_failure_ = failed_precondition(
        "it has {} pixels, and the page denoises {} at most. `lightmill fetch {} --denoise` denoises it", pixels, most,
        job_.value);
    return;
  }
  if (!with_tiles_ || !make_room(job)) {
    return;
  }
  features_ = features;
  denoise_again_ = denoising_;
  if (!denoising_) {
    order_denoised();
  }
}

void JobFeed::order_denoised() {
  denoising_ = true;
  denoiser_.add({job_, features_, denoised_version_, weak_from_this(),
                 [feed = weak_from_this()](const Result<LiveDenoiser::Picture>& picture) {
                   if (const auto here = feed.lock(); here != nullptr) {
                     here->take_denoised(picture);
                   }
                 }});
}

void JobFeed::take_denoised(const Result<LiveDenoiser::Picture>& picture) {
  denoising_ = false;
  picture_failure_ = picture.status();
  if (picture.ok()) {
    denoised_version_ = picture->film_version;
    for (const DenoisedTile& tile : picture->tiles) {
      const std::pair corner{tile.rect.y, tile.rect.x};
      if (tile.samples > 0 || tiles_.has(corner)) {  // its samples may have been wrong
        tiles_.put(corner, tile_field(job_, layer_, tile.rect, tile.samples, tile.pixels));
      }
    }
  }
  if (std::exchange(denoise_again_, false)) {
    order_denoised();
  }
  on_change_();
}

/// Place of the layer in the film: of `features` for the denoised picture. None if the layer does not exist or has no
/// colours.
std::optional<LayerSlice> JobFeed::slice_of_layer(const JobStatus& job) const {
  if (layer_.empty()) {
    return LayerSlice{};
  }
  if (layer_ == kDenoisedLayer) {
    return layer_slice(kFeaturesLayer, job.spec.settings.layers);
  }
  const std::optional<LayerSlice> slice = layer_slice(layer_, job.spec.settings.layers);
  return slice && slice->kind != LayerKind::first_samples ? slice : std::nullopt;
}

void JobFeed::fail(const Status& why) {
  failure_ = why;
  on_change_();
}

}  // namespace lightmill
