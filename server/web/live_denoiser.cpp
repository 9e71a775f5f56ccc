#include "server/web/live_denoiser.h"

#include <chrono>

#include "common/film/film.h"

namespace lightmill {
namespace {

using Seconds = std::chrono::duration<double>;

/// The thread rests this many times as long as it has worked.
constexpr double kRestShare = 3;

FilmToDenoise snapshot_of(const Film& film, const LayerSlice& features) {
  FilmToDenoise out{film.grid().crop(), features, {}};
  for (std::uint32_t tile = 0; tile < film.grid().picture_tiles(); ++tile) {
    out.tiles.push_back(snapshot(film, TileId{tile}));
  }
  return out;
}

}  // namespace

/// Where the farm thread puts a film for the denoiser's thread.
struct LiveDenoiser::Desk {
  /// A film that is not known yet, or why there is none.
  struct Work {
    Result<FilmToDenoise> film = FilmToDenoise{};
    std::uint64_t version = 0;
    Done done;
  };
  Mutex mutex;
  CondVar changed;
  std::optional<Work> work LM_GUARDED_BY(mutex);
  bool stopping LM_GUARDED_BY(mutex) = false;

  void put(Work next) {
    const MutexLock lock(mutex);
    work = std::move(next);
    changed.notify_all();
  }
  /// Waits. Empty once it stops.
  std::optional<Work> take() {
    const MutexLock lock(mutex);
    while (!work && !stopping) {
      changed.wait(mutex);
    }
    return stopping ? std::nullopt : std::exchange(work, std::nullopt);
  }
  void rest(Seconds time) {
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(time);
    const MutexLock lock(mutex);
    while (!stopping && changed.wait_until(mutex, until) != std::cv_status::timeout) {
    }
  }
  void stop() {
    const MutexLock lock(mutex);
    stopping = true;
    changed.notify_all();
  }
};

LiveDenoiser::LiveDenoiser(FarmLoop& loop, OnWebThread on_web_thread)
    : loop_(loop),
      on_web_thread_(std::move(on_web_thread)),
      desk_(std::make_shared<Desk>()),
      thread_([this] { run(); }) {}

LiveDenoiser::~LiveDenoiser() {
  desk_->stop();
  thread_.join();
}

void LiveDenoiser::add(Order order) {
  waiting_.push_back(std::move(order));
  start_next();
}

void LiveDenoiser::start_next() {
  std::erase_if(waiting_, [](const Order& order) { return order.user.expired(); });
  if (busy_ || waiting_.empty()) {
    return;
  }
  busy_ = true;
  const auto order = std::make_shared<const Order>(std::move(waiting_.front()));
  waiting_.pop_front();
  const bool posted = loop_.post([order, desk = desk_](FarmLoop::TaskContext& context) {
    const FilmOutline* const outline = context.farm.outline(order->job);
    if (outline != nullptr && outline->version() == order->known) {
      return desk->put({FilmToDenoise{}, order->known, order->done});
    }
    context.with_film(order->job, [order, desk](FarmLoop::TaskContext& later, const Status& here) {
      if (!here.ok()) {
        return desk->put({here, 0, order->done});
      }
      const Film& film = *later.farm.film(order->job);
      desk->put({snapshot_of(film, order->features), film.version(), order->done});
    });
  });
  if (!posted) {
    desk_->put({resource_exhausted("the farm has too much to do at once: trying again"), 0, order->done});
  }
}

void LiveDenoiser::run() {
  while (std::optional<Desk::Work> work = desk_->take()) {
    const auto begin = std::chrono::steady_clock::now();
    const auto picture = std::make_shared<Result<Picture>>(Picture{work->version, {}});
    if (!work->film.ok()) {
      *picture = work->film.status();
    } else if (!work->film->tiles.empty()) {
      try {
        (*picture)->tiles = denoised_tiles(*work->film);
      } catch (const std::bad_alloc&) {
        *picture = resource_exhausted("the coordinator has too little memory to denoise it");
      }
    }
    on_web_thread_([picture, done = std::move(work->done)] { done(*picture); });
    work.reset();
    desk_->rest(kRestShare * Seconds(std::chrono::steady_clock::now() - begin));
    on_web_thread_([denoiser = std::weak_ptr<LiveDenoiser*>(self_)] {
      if (const auto here = denoiser.lock(); here != nullptr) {
        (*here)->busy_ = false;
        (*here)->start_next();
      }
    });
  }
}

}  // namespace lightmill
