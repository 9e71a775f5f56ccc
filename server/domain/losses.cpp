#include "server/domain/losses.h"

#include <fmt/ranges.h>

#include <utility>

namespace lightmill {

bool Losses::count(Row& row, const Lease& lost) const {
  const std::pair worker(lost.worker, lost.worker_since);
  if (std::exchange(row.last, worker) == worker) {
    return false;
  }
  if (lost.alone && row.lost >= before_alone_) {  // else a result came after it was granted
    row.alone.push_back(lost.worker);
  }
  ++row.lost;
  return row.alone.size() >= alone_;
}

std::string Losses::add(const Lease& lost, const TileGrid& grid) {
  const auto say = [](const Row& row, const std::string& work) {
    return fmt::format("{} workers were lost in a row, the last ones ({}) while they had nothing to do but {}",
                       row.lost, fmt::join(row.alone, ", "), work);
  };
  std::string reason = lost.is_pilot() && count(pilot_, lost) ? say(pilot_, "to try the job's methods") : "";
  for (std::size_t i = 0; i < lost.unit.tiles.size(); ++i) {
    if (lost.done[i]) {
      continue;
    }
    if (Row& row = tiles_[lost.unit.tiles[i]]; count(row, lost)) {
      const PixelRect rect = grid.tile_rect(lost.unit.tiles[i]);
      reason = say(row, fmt::format("to render samples [{}, {}) of the {}x{} pixels at {}, {}", lost.unit.range.first(),
                                    lost.unit.range.end(), rect.width, rect.height, rect.x, rect.y));
    }
  }
  return reason;
}

bool Losses::is_suspect(TileId tile) const {
  const auto found = tiles_.find(tile);
  return found != tiles_.end() && found->second.lost >= before_alone_;
}

}  // namespace lightmill
