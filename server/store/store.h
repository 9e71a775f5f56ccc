// Where a coordinator's state outlives it: progress and pixels, committed together.
#pragma once

#include <memory>
#include <span>

#include "common/base/status.h"
#include "server/domain/effects.h"

namespace lightmill {

/// A transactional store. One user at a time, from one thread.
class Store {
 public:
  virtual ~Store() = default;
  /// Reads everything and takes the next epoch. Call once, first. Damaged nodes are not stored any more then.
  virtual Result<StoredState> load() = 0;
  /// DATA_LOSS, saying what is wrong, if the database is damaged as such, whatever its rows hold. Takes as long as
  /// reading it all.
  virtual Status check_structure() = 0;
  /// Applies `ops` in order in one transaction; durable when it returns. On an error nothing of it is stored.
  virtual Status commit(std::span<const StoreOp> ops) = 0;
  /// Gives the disk back a part of what deleted jobs have left, in some 0.1 s; whether there is more of it.
  virtual bool tidy() { return false; }
};

}  // namespace lightmill
