// Losses: workers that were lost in a row with the same tile of a job, or with its pilot. The work may be the cause.
//
// Suspect work goes only to workers without other leases. If it is lost there too, with workers of several identities,
// the job fails. If they all have one identity, it gets no more of the job, because it may lose workers on purpose.
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

  struct Blame {
    std::string reason = {};  ///< empty: the job continues
    bool agreed = false;      ///< the job must fail; else the identity gets no more of it
  };
  /// The lease was lost with its worker, of this identity.
  Blame add(const Lease& lost, const std::string& identity, const TileGrid& grid);
  bool is_suspect(TileId tile) const;
  bool pilot_is_suspect() const { return pilot_.lost >= before_alone_; }
  /// A result of the tile came. Returns whether workers were lost with the tile before.
  bool tile_received(TileId tile) { return tiles_.erase(tile) > 0; }
  void pilot_received() { pilot_ = {}; }

 private:
  struct Row {
    std::uint32_t lost = 0;
    std::pair<std::string, Time> last;  ///< worker, and when it connected: it may lose several leases at once
    std::vector<std::string> alone;     ///< workers without other leases
    std::map<std::string, std::uint32_t> alone_by;  ///< how many of them each identity has
  };
  /// Counts the loss. `work`: what the workers had to do.
  Blame count(Row& row, const Lease& lost, const std::string& identity, const std::string& work) const;

  std::uint32_t before_alone_, alone_;
  std::map<TileId, Row> tiles_;
  Row pilot_;
};

}  // namespace lightmill
