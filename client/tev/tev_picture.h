// A picture for a viewer: the newest version of each tile, and the tiles that the viewer lacks. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lightmill {

/// A part of a picture. The picture's top left pixel is (0, 0).
struct TevTile {
  std::int64_t x = 0, y = 0;
  int width = 0, height = 0;
  std::vector<float> planes;  ///< all of R, then G, then B, each in rows from the top
};

/// Makes packets for a viewer. Changed tiles wait in a queue. A tile that changes while it waits keeps its place. A
/// tile that changes later joins at the end.
class TevPicture {
 public:
  TevPicture(std::string name, int width, int height) : name_(std::move(name)), width_(width), height_(height) {}

  /// Replaces the tile at this place. Ignores a tile that is not inside the picture, or does not have 3 * width *
  /// height values.
  void put(TevTile tile);
  /// Starts with another viewer, which has nothing yet.
  void start_over();
  /// Empty once everything was sent.
  std::string next_packet();

 private:
  using Place = std::pair<std::int64_t, std::int64_t>;  ///< y, x
  struct Kept {
    TevTile tile;
    bool waits = false;
  };

  std::string name_;
  int width_, height_;
  bool created_ = false;
  std::map<Place, Kept> tiles_;
  std::deque<Place> waiting_;  ///< each place once, longest wait first
};

}  // namespace lightmill
