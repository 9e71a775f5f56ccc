// Lease: a unit lent to a worker until a deadline. Plain value; LeaseTable owns them.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/farm/messages.h"

namespace lightmill {

/// A lease without tiles is a pilot's.
struct Lease {
  LeaseId id = {};
  Unit unit = {};               ///< tiles ascending
  bool copy = false;            ///< second lease of late work; it is not copied again
  bool alone = false;           ///< its unit is suspect (losses.h), and its worker has no other lease
  bool audits = false;          ///< renders results again for an audit
  std::string worker = {};      ///< its name
  Time worker_since = {};       ///< when that worker connected
  std::vector<bool> done = {};  ///< for each tile of the unit: merged, or no longer wanted from this lease
  std::uint32_t remaining = 0;  ///< count of tiles that are not done
  Time granted = {};            ///< when its grant was sent
  Time last_progress = {};      ///< a result, the sent grant, or that it became its worker's oldest
  Time deadline = {};           ///< when it expires; Time::max(): never
  bool abandoned = false;       ///< its worker's stream is broken
  bool sent = true;             ///< false while its grant waits for a commit, and the worker does not know it
  SessionId waits_for = {};     ///< session that an unsent grant goes to

  /// The thread time that a worker claims for a result, limited to the time since the grant plus 15 s. The worker may
  /// have begun the result before this lease, for an earlier one.
  double possible_seconds(double said, Time now) const {
    constexpr double kEarlierSeconds = 15;
    return std::min(said, to_seconds(now - granted) + kEarlierSeconds);
  }
  bool is_pilot() const { return unit.tiles.empty(); }
  /// Whether it has this tile, and the tile is not done.
  bool wants(TileId tile) const {
    const auto at = std::ranges::lower_bound(unit.tiles, tile);
    return at != unit.tiles.end() && *at == tile && !done[static_cast<std::size_t>(at - unit.tiles.begin())];
  }
};

}  // namespace lightmill
