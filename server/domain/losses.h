// Losses: workers that were lost in a row with a tile of one job, or with its pilot: the work itself may be why.
//
// Suspect work goes to workers that have nothing else. It fails its job once too many of those are lost too.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/film/tile_grid.h"
#include "server/domain/lease.h"
#include "server/domain/limits.h"

namespace lightmill {

class Losses {
 public:
  explicit Losses(const CoordinatorLimits& limits)
      : before_alone_(limits.losses_before_alone), alone_(limits.losses_alone) {}

  /// The lease was lost with its worker. Returns why its job is to fail; empty if it continues.
  std::string add(const Lease& lost, const TileGrid& grid);
  bool is_suspect(TileId tile) const;
  bool pilot_is_suspect() const { return pilot_.lost >= before_alone_; }
  /// A result of the tile came. Returns whether workers had been lost with it.
  bool tile_came(TileId tile) { return tiles_.erase(tile) > 0; }
  void pilot_came() { pilot_ = {}; }

 private:
  struct Row {
    std::uint32_t lost = 0;
    std::pair<std::string, Time> last;  ///< worker, and when it had connected: it may lose several leases at once
    std::vector<std::string> alone;     ///< workers that had nothing else
  };
  /// Returns whether the job is to fail.
  bool count(Row& row, const Lease& lost) const;

  std::uint32_t before_alone_, alone_;
  std::map<TileId, Row> tiles_;
  Row pilot_;
};

}  // namespace lightmill
