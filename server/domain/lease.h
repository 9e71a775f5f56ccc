// Lease: a unit lent to a worker until a deadline. Plain value; LeaseTable owns them.
#pragma once

#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/farm/messages.h"

namespace lightmill {

/// A lease without tiles is a pilot's.
struct Lease {
  LeaseId id = {};
  Unit unit = {};               ///< tiles ascending
  bool copy = false;            ///< of another lease, which is late. It is not copied again
  bool alone = false;           ///< its unit is suspect (losses.h): the worker has no other lease
  bool audits = false;          ///< renders again what the film has
  std::string worker = {};      ///< its name
  Time worker_since = {};       ///< when that worker had connected
  std::vector<bool> done = {};  ///< by tile of the unit: merged, or not wanted from this lease any more
  std::uint32_t remaining = 0;  ///< tiles that are not done
  Time granted = {};            ///< when its grant was sent
  Time got_on = {};             ///< when a result of it came, its grant was sent, or it became its worker's oldest
  Time deadline = {};           ///< it expires then; Time::max(): never
  bool abandoned = false;       ///< its worker's stream is broken
  bool sent = true;             ///< false while its grant waits for a commit: the worker does not know of it
  SessionId waits_for = {};     ///< the session to which an unsent grant goes

  bool is_pilot() const { return unit.tiles.empty(); }
};

}  // namespace lightmill
