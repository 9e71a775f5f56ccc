#include "server/web/job_pictures.h"

#include "common/wire/film_assembly.h"
#include "server/runtime/action_records.h"
#include "server/web/byte_budget.h"

namespace lightmill {
namespace {

/// Upper limits: beauty, halves, errors and counts; values of one layer.
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

/// A picture to be made.
struct JobPictures::Order {
  FilmSnapshot film;
  PictureFormat format = PictureFormat::exr;
  std::int64_t unix_ms = 0;
  ByteBudget::Reservation reservation;  ///< kept until the file has no user
  PendingReply back;
};

/// Shared with functions on the farm thread.
struct JobPictures::Queue {
  explicit Queue(std::uint64_t most_bytes)
      : budget(most_bytes), most_bytes_of_one(std::min(most_bytes / 2, kMaxBytesOfOne)) {}

  Mutex mutex;
  CondVar changed;
  std::deque<Order> orders LM_GUARDED_BY(mutex);
  bool stopping LM_GUARDED_BY(mutex) = false;
  CallersBudget budget;  ///< used on the farm thread
  const std::uint64_t most_bytes_of_one;

  /// Reserves memory for the picture of this film. RESOURCE_EXHAUSTED says what to do.
  Result<ByteBudget::Reservation> reserve(const Call& call, const v1::FilmHeader& film) {
    const std::uint64_t wanted = bytes_of(film);
    if (wanted > most_bytes_of_one) {
      return resource_exhausted("the picture's film has more than {} MiB: `lightmill fetch {} -o FILE` gets it",
                                most_bytes_of_one >> 20, film.job().id());
    }
    if (film.job().max_tile_samples() == 0 && film.job().state() != v1::JOB_STATE_DONE) {
      return failed_precondition("job {} has no samples yet", film.job().id());
    }
    ByteBudget::Reservation reservation = budget.take(holder_of(call.caller, call.peer), wanted);
    return reservation == nullptr
               ? Result<ByteBudget::Reservation>(resource_exhausted("too many pictures are fetched at once: try again"))
               : std::move(reservation);
  }
  void push(Order order) {
    const MutexLock lock(mutex);
    if (stopping) {
      return;
    }
    orders.push_back(std::move(order));
    changed.notify_all();
  }
  /// Waits. Empty once it stops.
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

JobPictures::JobPictures(FarmRequests& farm_requests, const AccessControl& access, std::uint64_t most_bytes)
    : farm_requests_(farm_requests),
      access_(access),
      queue_(std::make_shared<Queue>(most_bytes)),
      thread_([this] { run(); }) {}

JobPictures::~JobPictures() {
  queue_->stop();
  thread_.join();
}

void JobPictures::send(const Call& call, JobId job, PictureFormat format, Reply reply) {
  farm_requests_.post(std::move(reply), [call, job, format, &access = access_, queue = queue_](
                                            FarmLoop::TaskContext& context, const PendingReply& back) {
    const Status status = check_job_call(context, access, call, job);
    const Result<v1::FilmHeader> header = status.ok() ? film_header(context.farm, job, context.now) : status;
    const Result<ByteBudget::Reservation> reservation = header.ok() ? queue->reserve(call, *header) : header.status();
    if (!reservation.ok()) {
      return back(error_reply(reservation.status()));
    }
    context.with_film(
        job, [job, format, queue, back, reservation = *reservation](FarmLoop::TaskContext& later, const Status& here) {
          Result<FilmSnapshot> film = here.ok() ? snapshot(later.farm, job, later.now) : here;
          if (!film.ok()) {
            return back(error_reply(film.status()));
          }
          queue->push({*std::move(film), format, later.unix_ms, reservation, back});
        });
  });
}

void JobPictures::run() {
  while (std::optional<Order> order = queue_->pop()) {
    Result<std::string> file = encoded(order->film, order->format, order->unix_ms);
    if (!file.ok()) {
      order->back(error_reply(file.status()));
      continue;
    }
    const bool exr = order->format == PictureFormat::exr;
    ApiReply reply{200, exr ? "image/x-exr" : "image/png", ""};
    reply.file_name = fmt::format("job-{}.{}", order->film.header.job().id(), exr ? "exr" : "png");
    reply.file = bytes_with_reservation(*std::move(file), std::move(order->reservation));
    order->back(std::move(reply));
  }
}

}  // namespace lightmill
