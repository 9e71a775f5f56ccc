#include "server/domain/losses.h"

#include <fmt/ranges.h>

#include <utility>

namespace lightmill {

Losses::Blame Losses::count(Row& row, const Lease& lost, const std::string& identity, const std::string& work) const {
  const std::pair worker(lost.worker, lost.worker_since);
  if (std::exchange(row.last, worker) == worker) {
    return {};
  }
  if (++row.lost <= before_alone_ || !lost.alone) {  // or a result came after it was granted
    return {};
  }
  row.alone.push_back(lost.worker);
  const std::uint32_t of_identity = ++row.alone_by[identity];
  const bool agreed = row.alone_by.size() >= alone_;
  if (!agreed && of_identity < alone_) {
    return {};
  }
  return {fmt::format("{} workers were lost in a row, the last ones ({}) while they had nothing to do but {}", row.lost,
                      fmt::join(row.alone, ", "), work),
          agreed};
}

Losses::Blame Losses::add(const Lease& lost, const std::string& identity, const TileGrid& grid) {
  if (lost.is_pilot()) {
    return count(pilot_, lost, identity, "to try the job's methods");
  }
  Blame blame;
  for (std::size_t i = 0; i < lost.unit.tiles.size(); ++i) {
    if (!lost.done[i]) {
      const PixelRect rect = grid.tile_rect(lost.unit.tiles[i]);
      const std::string work =
          fmt::format("to render samples [{}, {}) of the {}x{} pixels at {}, {}", lost.unit.range.first(),
                      lost.unit.range.end(), rect.width, rect.height, rect.x, rect.y);
      if (Blame found = count(tiles_[lost.unit.tiles[i]], lost, identity, work); !found.reason.empty()) {
        blame = std::move(found);
      }
    }
  }
  return blame;
}

bool Losses::is_suspect(TileId tile) const {
  const auto found = tiles_.find(tile);
  return found != tiles_.end() && found->second.lost >= before_alone_;
}

}  // namespace lightmill
