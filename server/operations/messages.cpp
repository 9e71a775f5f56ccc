#include "server/operations/messages.h"

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"

namespace lightmill {

Result<v1::FilmHeader> film_header(const Coordinator& farm, JobId job, Time now) {
  LM_ASSIGN_OR_RETURN(const JobStatus status, farm.status(job, now));
  LM_ASSIGN_OR_RETURN(const JobSpec* const spec, farm.spec(job));
  v1::FilmHeader header;
  to_wire(status, header.mutable_job());
  to_wire(spec->settings, header.mutable_settings());
  header.set_tile_count(farm.outline(job)->grid().tile_count());
  return header;
}

Result<FilmSnapshot> snapshot(const Coordinator& farm, JobId job, Time now) {
  FilmSnapshot taken;
  LM_ASSIGN_OR_RETURN(taken.header, film_header(farm, job, now));
  const Film* const film = farm.film(job);
  if (film == nullptr) {
    return unavailable("the film of job {} is still being read from the store. Try again in a few seconds", job.value);
  }
  taken.tiles.reserve(taken.header.tile_count());
  for (TileId tile{0}; tile.value < taken.header.tile_count(); ++tile.value) {
    taken.tiles.push_back(snapshot(*film, tile));
  }
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

void to_wire(const WorkerStatus& worker, v1::Worker* out) {
  out->set_name(worker.name);
  out->set_host(worker.host);
  out->set_pid(worker.pid);
  out->set_threads(worker.threads);
  out->set_fingerprint_class(worker.fingerprint_class);
  out->set_draining(worker.draining);
  out->set_samples_per_second(worker.samples_per_second);
  out->set_leases(worker.leases);
  out->set_connected_seconds(worker.connected_seconds);
  out->set_results(worker.results);
  out->set_leases_lost(worker.leases_lost);
  out->set_quarantine(worker.quarantine);
  out->set_away(!worker.connected);
}

}  // namespace lightmill
