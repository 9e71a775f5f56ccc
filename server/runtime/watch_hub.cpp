#include "server/runtime/watch_hub.h"

#include "common/film/film.h"

namespace lightmill {
namespace {

constexpr Duration kInterval = std::chrono::milliseconds(100);
/// Interval until every tile has its first sample.
constexpr Duration kFirstRoundInterval = std::chrono::milliseconds(20);
/// A tile has 48 KiB, so a message stays below gRPC's default limit of 4 MiB.
constexpr std::size_t kTilesPerMessage = 40;
/// 2^32 divided by the golden ratio. Its multiples modulo 2^32 are spread evenly, and so is every n-th of them.
constexpr std::uint32_t kGoldenSection = 0x9e3779b9;

}  // namespace

void WatchHub::add(JobId job, bool with_tiles, std::shared_ptr<WatchSink> sink) {
  Watcher& watcher = watchers_.emplace_back();
  watcher.job = job;
  watcher.with_tiles = with_tiles;
  watcher.sink = std::move(sink);
}

void WatchHub::hurry(JobId job) {
  for (Watcher& watcher : watchers_) {
    if (watcher.job == job) {
      watcher.next_time = Time{};
    }
  }
}

void WatchHub::film_loaded(const Coordinator& farm, JobId job, Time now) {
  std::optional<Time> wake;
  std::erase_if(watchers_, [&](Watcher& watcher) {
    return watcher.job == job && std::exchange(watcher.waits_for_film, false) &&
           publish_to(watcher, farm, now, wake) == Outcome::remove;
  });
}

void WatchHub::fail_film(JobId job, const Status& status) {
  std::erase_if(watchers_, [&](const Watcher& watcher) {
    const bool waits = watcher.job == job && watcher.waits_for_film;
    if (waits) {
      watcher.sink->fail(status);
    }
    return waits;
  });
}

std::optional<Time> WatchHub::publish(const Coordinator& farm, Time now) {
  std::optional<Time> wake;
  std::erase_if(watchers_, [&](Watcher& watcher) {
    return watcher.sink->closed() || publish_to(watcher, farm, now, wake) == Outcome::remove;
  });
  std::set<JobId> watched;
  for (const Watcher& watcher : watchers_) {
    watched.insert(watcher.job);
  }
  std::erase_if(rounds_, [&](const auto& entry) { return !watched.contains(entry.first); });
  for (auto& [job, round] : rounds_) {
    round = {round.number + (round.full ? 1 : 0)};
  }
  return wake;
}

WatchHub::Outcome WatchHub::publish_to(Watcher& watcher, const Coordinator& farm, Time now, std::optional<Time>& wake) {
  const std::uint64_t version = farm.version(watcher.job);
  if (version == 0) {
    watcher.sink->fail(not_found("there is no job {}", watcher.job.value));
    return Outcome::remove;
  }
  // A stream that is still writing calls FarmLoop::wake when it is done.
  if ((version == watcher.sent_version && !watcher.tiles_left) || !watcher.sink->writable()) {
    return Outcome::keep;
  }
  if (now < watcher.next_time) {
    wake = wake ? std::min(*wake, watcher.next_time) : watcher.next_time;
    return Outcome::keep;
  }
  const Film* const film = farm.film(watcher.job);
  const bool waits = watcher.with_tiles && film == nullptr;
  if (waits && !watcher.waits_for_film) {
    wanted_films_.insert(watcher.job);
  }
  watcher.waits_for_film = waits;
  if (waits && version == watcher.sent_version) {
    return Outcome::keep;  // only tiles are left to send
  }
  Result<JobStatus> status = farm.status(watcher.job, now);
  if (!status.ok()) {
    watcher.sink->fail(status.status());
    return Outcome::remove;
  }
  WatchUpdate update{std::move(*status), {}, false};
  watcher.tiles_left = waits || (watcher.with_tiles && add_tiles(watcher, *film, update));
  watcher.sent_version = version;
  watcher.next_time =
      watcher.tiles_left ? now : now + (update.job.min_tile_samples > 0 ? kInterval : kFirstRoundInterval);
  update.last = has_ended(update.job.state) && !watcher.tiles_left;
  watcher.sink->offer(update);
  return update.last ? Outcome::remove : Outcome::keep;
}

/// Adds as many changed tiles to the update as fit. True if some are left.
bool WatchHub::add_tiles(Watcher& watcher, const Film& film, WatchUpdate& update) {
  const std::uint32_t count = film.grid().picture_tiles();
  watcher.sent_tiles.resize(count);
  Round& round = rounds_[watcher.job];
  const std::uint32_t offset = round.number * kGoldenSection;  // as a fraction of 2^32
  const auto start = static_cast<std::uint32_t>((std::uint64_t{offset} * count) >> 32);
  for (std::uint32_t i = 0; i < count; ++i) {
    const TileId tile{(start + i) % count};
    const std::uint64_t version = film.version(tile);
    if (version == watcher.sent_tiles[tile.value]) {
      continue;
    }
    if (update.tiles.size() == kTilesPerMessage) {
      round.full = true;
      return true;
    }
    watcher.sent_tiles[tile.value] = version;
    std::shared_ptr<const WatchedTile>& shared = round.tiles[tile];
    if (shared == nullptr) {
      shared = std::make_shared<const WatchedTile>(WatchedTile{snapshot(film, tile), {}});
    }
    update.tiles.push_back(shared);
  }
  return false;
}

}  // namespace lightmill
