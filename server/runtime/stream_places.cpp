#include "server/runtime/stream_places.h"

#include <algorithm>
#include <utility>

namespace lightmill {
namespace {

constexpr std::array<std::string_view, static_cast<std::size_t>(StreamKind::count)> kKinds{
    "assets under way", "films under way", "watched jobs", "autoscalers that listen", "open pages"};

}  // namespace

std::optional<StreamKind> stream_kind(Rpc rpc) {
  switch (rpc) {
    case Rpc::upload_asset:
    case Rpc::download_asset:
      return StreamKind::asset;
    case Rpc::get_film:
      return StreamKind::film;
    case Rpc::watch_job:
      return StreamKind::watch;
    case Rpc::stream_is_active:
      return StreamKind::scaler;
    default:
      return std::nullopt;
  }
}

StreamPlace::~StreamPlace() {
  const MutexLock lock(places_.mutex_);
  StreamPlaces::Kind& kind = places_.of(kind_);
  kind.places.leave(id_);
  kind.held.erase(id_);
}

void StreamPlace::on_give_way(std::function<void()> end) {
  const MutexLock lock(mutex_);
  if (gives_way_) {
    end();
  } else {
    end_ = std::move(end);
  }
}

void StreamPlace::call_ended() {
  const MutexLock lock(mutex_);
  end_ = nullptr;
}

void StreamPlace::give_way() {
  const MutexLock lock(mutex_);  // call_ended() waits meanwhile
  gives_way_ = true;
  if (const auto end = std::exchange(end_, nullptr)) {
    end();
  }
}

void StreamPlace::stands_still() {
  const Time now = places_.clock_.now();
  const MutexLock lock(places_.mutex_);
  places_.of(kind_).places.stands_still(id_, now);
}

void StreamPlace::moves() {
  const MutexLock lock(places_.mutex_);
  places_.of(kind_).places.moves(id_);
}

StreamPlaces::Kind StreamPlaces::kind_of(std::size_t most) const {
  const std::size_t of_caller = std::min<std::size_t>(options_.streams_per_caller, most);
  return {Places(most, of_caller), most, of_caller};
}

StreamPlaces::StreamPlaces(const CallLimitOptions& options, const Clock& clock)
    : options_(options),
      clock_(clock),
      kinds_{kind_of(options.streams), kind_of(kMostFilms), kind_of(kMostWatches), kind_of(kMostScalers),
             kind_of(kMostPages)} {}

Result<std::shared_ptr<StreamPlace>> StreamPlaces::take(StreamKind kind, const Holder& holder) {
  const std::string_view name = kKinds[static_cast<std::size_t>(kind)];
  const Time now = clock_.now();
  std::shared_ptr<StreamPlace> place, gives_way;
  {
    const MutexLock lock(mutex_);
    Kind& all = of(kind);
    const Places::Id id = next_id_++;
    const Places::Arrival arrival = all.places.arrive(id, holder, now);
    if (arrival.answer == Places::Answer::all_are_taken) {
      return resource_exhausted("the farm has places for {} {}, and all are taken: try again later", all.most, name);
    }
    if (arrival.answer == Places::Answer::holder_has_its_share) {
      return resource_exhausted("the farm takes {} {} of one caller (--caller-streams): try again when one has ended",
                                all.of_caller, name);
    }
    place = std::make_shared<StreamPlace>(*this, kind, id);
    all.held.emplace(id, place);
    if (arrival.gives_way) {
      gives_way = all.held.at(*arrival.gives_way).lock();
    }
  }
  if (gives_way != nullptr) {
    gives_way->give_way();
  }
  return place;
}

}  // namespace lightmill
