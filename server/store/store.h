// Store interface: keeps a coordinator's state, with progress and pixels in one transaction.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "common/base/status.h"
#include "server/domain/stored_rows.h"

namespace lightmill {

/// Key of a node within its film, as in the rows.
struct FilmPosition {
  std::int64_t tile = -1, level = -1, index = -1;
};
/// Some nodes of a film. `last` is the place of the last one, if more may follow.
struct FilmPiece {
  StoredFilm nodes;
  std::optional<FilmPosition> last = {};
};

/// A transactional store, used by one thread.
class Store {
 public:
  virtual ~Store() = default;
  /// Reads everything except the values of ended jobs' films, and begins the next epoch. Call it once, before
  /// everything else. It removes damaged nodes from the store.
  virtual Result<StoredState> load() = 0;
  /// Reads the next nodes of a job's film after `after`, some MiB at a time. Commits may come between two calls.
  /// Damaged nodes are logged and left out.
  virtual Result<FilmPiece> read_film(JobId job, const FilmPosition& after) = 0;
  /// DATA_LOSS with the reason if the database itself is damaged. It does not check what rows contain. Takes as long as
  /// reading the whole database.
  virtual Status check_structure() = 0;
  /// Applies `ops` in order in one transaction, which is durable when it returns. After an error nothing is stored.
  virtual Status commit(std::span<const StoreOp> ops) = 0;
  /// Returns space of deleted jobs to the disk, for about 0.1 s. True if more remains.
  virtual bool tidy() { return false; }
};

}  // namespace lightmill
