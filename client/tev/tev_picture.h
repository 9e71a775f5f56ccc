// A picture on its way to a viewer: the newest of each tile, and which of them the viewer lacks. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lightmill {

/// A part of a picture, whose top left pixel is 0,0.
struct TevTile {
  std::int64_t x = 0, y = 0;
  int width = 0, height = 0;
  std::vector<float> planes;  ///< all of R, then G, then B, each in rows from the top
};

/// Gives the packets that a viewer is to be sent. Each tile gets its turn, however often others change meanwhile: one
/// that changes while it waits keeps its turn, one that changes later waits behind all others.
class TevPicture {
 public:
  TevPicture(std::string name, int width, int height) : name_(std::move(name)), width_(width), height_(height) {}

  /// Takes the place of the tile that was there. One that is not inside the picture, or has other than
  /// 3 * width * height values, is left out.
  void put(TevTile tile);
  /// Another viewer, which has nothing yet.
  void start_over();
  /// Empty: the viewer has been sent everything.
  std::string next_packet();

 private:
  using Place = std::pair<std::int64_t, std::int64_t>;  ///< y and x
  struct Kept {
    TevTile tile;
    bool waits = false;
  };

  std::string name_;
  int width_, height_;
  bool created_ = false;
  std::map<Place, Kept> tiles_;
  std::deque<Place> waiting_;  ///< each once, those that wait longest first
};

}  // namespace lightmill
