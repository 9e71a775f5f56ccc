#include "server/api/film_messages.h"

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"

namespace lightmill {

Result<FilmSnapshot> snapshot(const Coordinator& farm, JobId job, Time now) {
  LM_ASSIGN_OR_RETURN(const JobStatus status, farm.status(job, now));
  LM_ASSIGN_OR_RETURN(const JobSpec* const spec, farm.spec(job));
  const Film* const film = farm.film(job);
  if (film == nullptr) {
    return not_found("there is no job {}", job.value);
  }
  FilmSnapshot taken;
  const std::uint32_t count = film->grid().tile_count();
  taken.tiles.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    taken.tiles.push_back(snapshot(*film, TileId{i}));
  }
  to_wire(status, taken.header.mutable_job());
  to_wire(spec->settings, taken.header.mutable_settings());
  taken.header.set_tile_count(count);
  return taken;
}

v1::FilmTile film_tile(const TileSnapshot& tile) {
  v1::FilmTile out;
  to_wire(tile.rect, out.mutable_rect());
  out.set_samples(tile.samples);
  out.set_samples_a(tile.samples_a);
  out.set_sums(float_bytes(sums_of(tile)));
  const FirstValues first = first_of(tile);
  out.set_first_samples(first.samples);
  out.set_first(float_bytes(first.values));
  return out;
}

}  // namespace lightmill
