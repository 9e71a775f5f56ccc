#include "server/web/job_feed.h"

namespace lightmill {

/// Takes one update at a time: the farm keeps the newest until the web's thread has encoded the one before.
class JobFeed::Sink final : public WatchSink, public std::enable_shared_from_this<Sink> {
 public:
  Sink(std::weak_ptr<JobFeed> feed, FarmLoop& loop, OnWebThread on_web_thread)
      : feed_(std::move(feed)), loop_(loop), on_web_thread_(std::move(on_web_thread)) {}

  bool closed() const override { return closed_; }
  bool writable() const override { return !busy_ && !closed_; }
  void offer(const WatchUpdate& update) override {
    busy_ = true;
    on_web_thread_([self = shared_from_this(), update] {
      if (const auto feed = self->feed(); feed != nullptr) {
        feed->take(update);
      }
      self->busy_ = false;
      if (!self->closed_) {
        self->loop_.poke();
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
  /// Null if the feed is gone, or has begun again.
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
                 std::shared_ptr<std::size_t> tiles_held, std::function<void()> on_news)
    : job_(job),
      layer_(std::move(layer)),
      loop_(loop),
      on_web_thread_(std::move(on_web_thread)),
      tiles_held_(std::move(tiles_held)),
      on_news_(std::move(on_news)) {}

JobFeed::~JobFeed() {
  forget_tiles();
  if (sink_ != nullptr) {
    sink_->close();
  }
}

void JobFeed::watch() {
  if (sink_ != nullptr) {
    sink_->close();
  }
  sink_ = std::make_shared<Sink>(weak_from_this(), loop_, on_web_thread_);
  ended_ = false;
  if (!loop_.post([job = job_, sink = sink_](FarmLoop::Turn& turn) { turn.watchers.add(job, true, sink); })) {
    failure_ = resource_exhausted("the farm has too much to do at once: trying again");
  }
}

void JobFeed::take(const WatchUpdate& update) {
  failure_ = ok_status();
  owner_ = update.job.owner;
  every_tile_has_samples_ = update.job.min_tile_samples > 0;
  ended_ = update.last;
  if (std::string state = job_bytes(update.job, true); state != state_) {
    state_ = std::move(state);
    ++state_version_;
  }
  const std::size_t before = tiles_.size();
  if (const std::optional<LayerPlace> place = layer_place(update.job)) {
    for (const TileSnapshot& tile : update.tiles) {
      tiles_.put({tile.rect.y, tile.rect.x}, tile_field(job_, layer_, *place, tile));
    }
  }
  *tiles_held_ += tiles_.size() - before;
  if (*tiles_held_ > kMostTiles) {
    sink_->close();
    forget_tiles();
    given_up_ = true;
    fail(resource_exhausted("the pictures that are watched have more than {} tiles together: this one is not shown",
                            kMostTiles));
    return;
  }
  on_news_();
}

/// Where the layer lies in the film; none if it is not there, or holds no colours.
std::optional<LayerPlace> JobFeed::layer_place(const JobStatus& job) const {
  if (layer_.empty()) {
    return LayerPlace{};
  }
  const Result<std::vector<LayerSpec>> layers = film_layers(job.layers);
  const std::optional<LayerPlace> place = layers.ok() ? place_of(layer_, *layers) : std::nullopt;
  return place && place->kind != LayerKind::first_samples ? place : std::nullopt;
}

void JobFeed::forget_tiles() {
  *tiles_held_ -= tiles_.size();
  tiles_ = ChangeLog<std::pair<int, int>>();
}

void JobFeed::fail(const Status& why) {
  failure_ = why;
  on_news_();
}

}  // namespace lightmill
