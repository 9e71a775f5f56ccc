#include "client/tev/tev_picture.h"

#include "client/tev/tev_packets.h"

namespace lightmill {

void TevPicture::put(TevTile tile) {
  const bool inside = tile.width > 0 && tile.height > 0 && tile.x >= 0 && tile.y >= 0 &&
                      tile.x <= width_ - tile.width && tile.y <= height_ - tile.height;
  if (!inside || tile.planes.size() != std::size_t{3} * tile.width * tile.height) {
    return;
  }
  const Place place{tile.y, tile.x};
  Kept& kept = tiles_[place];
  kept.tile = std::move(tile);
  if (!std::exchange(kept.waits, true)) {
    waiting_.push_back(place);
  }
}

void TevPicture::start_over() {
  created_ = false;
  waiting_.clear();
  for (auto& [place, kept] : tiles_) {
    kept.waits = true;
    waiting_.push_back(place);
  }
}

std::string TevPicture::next_packet() {
  if (!std::exchange(created_, true)) {
    return tev_create_image(name_, width_, height_, true);
  }
  if (waiting_.empty()) {
    return "";
  }
  Kept& next = tiles_.at(waiting_.front());
  waiting_.pop_front();
  next.waits = false;
  const TevTile& tile = next.tile;
  return tev_update_image(name_, static_cast<int>(tile.x), static_cast<int>(tile.y), tile.width, tile.height,
                          tile.planes);
}

}  // namespace lightmill
