// Where a coordinator's state outlives it: progress and pixels, committed together.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "common/base/status.h"
#include "server/domain/effects.h"

namespace lightmill {

/// Key of a node within its film, as the rows have it.
struct FilmPlace {
  std::int64_t tile = -1, level = -1, index = -1;
};
/// Some nodes of a film, and the last one's place if there may be more.
struct FilmPiece {
  StoredFilm nodes;
  std::optional<FilmPlace> last = {};
};

/// A transactional store. One user at a time, from one thread.
class Store {
 public:
  virtual ~Store() = default;
  /// Reads everything but the values of ended jobs' films, and takes the next epoch. Call once, first. Damaged nodes
  /// are not stored any more then.
  virtual Result<StoredState> load() = 0;
  /// Reads the next nodes of a job's film, some MiB of them, from behind `after`. Commits may come between two pieces.
  /// Damaged nodes are left out, and named in the log.
  virtual Result<FilmPiece> read_film(JobId job, const FilmPlace& after) = 0;
  /// DATA_LOSS, saying what is wrong, if the database is damaged as such, whatever its rows hold. Takes as long as
  /// reading it all.
  virtual Status check_structure() = 0;
  /// Applies `ops` in order in one transaction; durable when it returns. On an error nothing of it is stored.
  virtual Status commit(std::span<const StoreOp> ops) = 0;
  /// Gives the disk back a part of what deleted jobs have left, in some 0.1 s; whether there is more of it.
  virtual bool tidy() { return false; }
};

}  // namespace lightmill
