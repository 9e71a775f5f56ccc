#include "server/runtime/stream_slots.h"

#include <algorithm>
#include <utility>

namespace lightmill {
namespace {

constexpr std::array<std::string_view, static_cast<std::size_t>(StreamKind::count)> kKinds{
    "asset transfers", "film transfers", "watched jobs", "listening autoscalers", "open pages"};

}  // namespace

std::optional<StreamKind> stream_kind(const Rpc& rpc) {
  return rpc == kUploadAsset || rpc == kDownloadAsset ? std::optional(StreamKind::asset)
         : rpc == kGetFilm                            ? std::optional(StreamKind::film)
         : rpc == kWatchJob                           ? std::optional(StreamKind::watch)
         : rpc == kStreamIsActive                     ? std::optional(StreamKind::scaler)
                                                      : std::nullopt;
}

StreamSlot::~StreamSlot() {
  call_ended();
}

void StreamSlot::on_evict(std::function<void()> end) {
  const MutexLock lock(mutex_);
  if (evicted_) {
    end();
  } else {
    end_ = std::move(end);
  }
}

void StreamSlot::call_ended() {
  {
    const MutexLock lock(mutex_);
    end_ = nullptr;
  }
  const MutexLock lock(slots_.mutex_);
  StreamSlots::Kind& kind = slots_.of(kind_);
  kind.slots.release(id_);
  kind.held.erase(id_);
}

void StreamSlot::evict() {
  const MutexLock lock(mutex_);  // call_ended() waits meanwhile
  evicted_ = true;
  if (const auto end = std::exchange(end_, nullptr)) {
    end();
  }
}

void StreamSlot::set_stalled() {
  const Time now = slots_.clock_.now();
  const MutexLock lock(slots_.mutex_);
  slots_.of(kind_).slots.set_stalled(id_, now);
}

void StreamSlot::set_active() {
  const MutexLock lock(slots_.mutex_);
  slots_.of(kind_).slots.set_active(id_);
}

StreamSlots::Kind StreamSlots::kind_of(std::size_t most) const {
  const std::size_t of_caller = std::min<std::size_t>(options_.streams_per_caller, most);
  return {SlotPool(most, of_caller), most, of_caller};
}

StreamSlots::StreamSlots(const CallLimitOptions& options, const Clock& clock)
    : options_(options),
      clock_(clock),
      kinds_{kind_of(options.streams), kind_of(kMaxFilms), kind_of(kMaxWatches), kind_of(kMaxScalers),
             kind_of(kMaxPages)} {}

Result<std::shared_ptr<StreamSlot>> StreamSlots::take(StreamKind kind, const Holder& holder) {
  const std::string_view name = kKinds[static_cast<std::size_t>(kind)];
  const Time now = clock_.now();
  std::shared_ptr<StreamSlot> slot, evicted;
  {
    const MutexLock lock(mutex_);
    Kind& all = of(kind);
    const SlotPool::Id id = next_id_++;
    const SlotPool::Arrival arrival = all.slots.acquire(id, holder, now);
    if (arrival.answer == SlotPool::Answer::full) {
      return resource_exhausted("the farm serves at most {} {} at a time: try again later", all.most, name);
    }
    if (arrival.answer == SlotPool::Answer::holder_limit) {
      return resource_exhausted("the farm takes {} {} of one caller (--caller-streams): try again when one has ended",
                                all.of_caller, name);
    }
    slot = std::make_shared<StreamSlot>(*this, kind, id);
    all.held.emplace(id, slot);
    if (arrival.evicted) {
      evicted = all.held.at(*arrival.evicted).lock();
    }
  }
  if (evicted != nullptr) {
    evicted->evict();
  }
  return slot;
}

}  // namespace lightmill
