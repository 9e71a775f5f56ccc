#include "server/web/job_pictures.h"

#include "common/wire/film_assembly.h"
#include "server/api/records.h"
#include "server/web/byte_budget.h"

namespace lightmill {
namespace {

/// Beauty, halves, errors and counts, and what a layer takes at most.
constexpr std::uint64_t kValuesPerPixel = 16, kValuesPerLayer = 12;

std::uint64_t bytes_of(const v1::FilmHeader& header) {
  const v1::PixelRect& crop = header.settings().crop();
  const std::uint64_t pixels = static_cast<std::uint64_t>(crop.width()) * static_cast<std::uint64_t>(crop.height());
  const auto layers = static_cast<std::uint64_t>(header.settings().layers_size());
  return pixels * (kValuesPerPixel + kValuesPerLayer * layers) * sizeof(float) + header.ByteSizeLong();
}

Result<std::string> encoded(const FilmSnapshot& film, PictureFormat format, std::int64_t now_unix_ms) {
  LM_ASSIGN_OR_RETURN(FilmAssembly assembly, FilmAssembly::begin(film.header, now_unix_ms));
  for (const TileSnapshot& tile : film.tiles) {
    LM_RETURN_IF_ERROR(assembly.add(film_tile(tile)));
  }
  LM_ASSIGN_OR_RETURN(const AssembledFilm assembled, assembly.finish());
  return encode_picture(assembled.picture, format, {});
}

}  // namespace

/// A picture that is to be made.
struct JobPictures::Order {
  FilmSnapshot film;
  PictureFormat format = PictureFormat::exr;
  std::int64_t unix_ms = 0;
  ByteBudget::Place place;  ///< until nobody holds the file any more
  std::optional<FarmReply> back;
};

/// Shared with what the farm thread has under way.
struct JobPictures::Queue {
  Mutex mutex;
  CondVar changed;
  std::deque<Order> orders LM_GUARDED_BY(mutex);
  bool stopping LM_GUARDED_BY(mutex) = false;
  const ByteBudget budget{kMostBytes};

  /// RESOURCE_EXHAUSTED says what to do.
  Status take_place(Order& order) const {
    const std::uint64_t wanted = bytes_of(order.film.header);
    if (wanted > kMostBytesOfOne) {
      return resource_exhausted("the picture's film has more than {} MiB: `lightmill fetch {} -o FILE` gets it",
                                kMostBytesOfOne >> 20, order.film.header.job().id());
    }
    order.place = budget.take(wanted);
    return order.place == nullptr ? resource_exhausted("too many pictures are fetched at once: try again")
                                  : ok_status();
  }
  void push(Order order) {
    const MutexLock lock(mutex);
    if (stopping) {
      return;
    }
    orders.push_back(std::move(order));
    changed.notify_all();
  }
  /// Waits; none once it stops.
  std::optional<Order> pop() {
    const MutexLock lock(mutex);
    while (orders.empty() && !stopping) {
      changed.wait(mutex);
    }
    if (stopping) {
      return std::nullopt;
    }
    Order order = std::move(orders.front());
    orders.pop_front();
    return order;
  }
  void stop() {
    const MutexLock lock(mutex);
    stopping = true;
    orders.clear();
    changed.notify_all();
  }
};

JobPictures::JobPictures(FarmDesk& desk, const Gate& gate)
    : desk_(desk), gate_(gate), queue_(std::make_shared<Queue>()), thread_([this] { run(); }) {}

JobPictures::~JobPictures() {
  queue_->stop();
  thread_.join();
}

void JobPictures::send(const Call& call, JobId job, PictureFormat format, Reply reply) {
  desk_.ask(std::move(reply),
            [call, job, format, &gate = gate_, queue = queue_](FarmLoop::Turn& turn, const FarmReply& back) {
              const Status status = check_job_call(turn, gate, call, job);
              Result<FilmSnapshot> film = status.ok() ? snapshot(turn.farm, job, turn.now) : status;
              if (!film.ok()) {
                return back(error_reply(film.status()));
              }
              Order order{*std::move(film), format, turn.unix_ms, nullptr, back};
              if (const Status place = queue->take_place(order); !place.ok()) {
                return back(error_reply(place));
              }
              const v1::Job& header = order.film.header.job();
              if (header.max_tile_samples() == 0 && header.state() != v1::JOB_STATE_DONE) {
                return back(error_reply(failed_precondition("job {} has no samples yet", job.value)));
              }
              queue->push(std::move(order));
            });
}

void JobPictures::run() {
  while (std::optional<Order> order = queue_->pop()) {
    Result<std::string> file = encoded(order->film, order->format, order->unix_ms);
    if (!file.ok()) {
      (*order->back)(error_reply(file.status()));
      continue;
    }
    const bool exr = order->format == PictureFormat::exr;
    ApiReply reply{200, exr ? "image/x-exr" : "image/png", ""};
    reply.file_name = fmt::format("job-{}.{}", order->film.header.job().id(), exr ? "exr" : "png");
    reply.file = placed_bytes(*std::move(file), std::move(order->place));
    (*order->back)(std::move(reply));
  }
}

}  // namespace lightmill
