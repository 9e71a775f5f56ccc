// Messages for clients: workers, and film snapshots as GetFilm sends them.
#pragma once

#include "lightmill/v1/render_service.pb.h"
#include "server/assembly/tile_snapshot.h"
#include "server/domain/coordinator.h"

namespace lightmill {

/// Taken on the farm thread. Sent or assembled on another one.
struct FilmSnapshot {
  v1::FilmHeader header;
  std::vector<TileSnapshot> tiles;  ///< with the tiles of meters
};

/// NOT_FOUND.
Result<v1::FilmHeader> film_header(const Coordinator& farm, JobId job, Time now);
/// NOT_FOUND if there is no such job, UNAVAILABLE if its film is not in memory.
Result<FilmSnapshot> snapshot(const Coordinator& farm, JobId job, Time now);

v1::FilmTile film_tile(const TileSnapshot& tile);

void to_wire(const WorkerStatus& worker, v1::Worker* out);

}  // namespace lightmill
