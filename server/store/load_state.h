// Loader of the coordinator's state, from the tables that all databases share.
#pragma once

#include "server/store/records.h"
#include "server/store/row_source.h"
#include "server/store/row_statements.h"
#include "server/store/row_values.h"
#include "server/store/store.h"

namespace lightmill::stored {

/// Implements Store::read_film().
using ReadFilm = std::function<Result<FilmPiece>(JobId job, const FilmPosition& after)>;

/// Reads all jobs with their nodes and results, and all small rows. It does not read the epoch, the secret, the next
/// job id, or the values of ended jobs' nodes. Damaged rows are logged. Damaged jobs are left out, damaged nodes are
/// removed. Adds all rows to `sums`. The caller checks them, then applies `repairs`. `specs` learns which
/// specifications are stored. Changes nothing. Nothing else may write meanwhile.
Result<StoredState> load_state(RowSource& rows, const ReadFilm& read_film, StoredSpecs& specs, RowSums& sums,
                               std::vector<StoreOp>& repairs);

/// Loads the values of all nodes of a job. Drops damaged nodes with `repairs`.
Status load_values(const ReadFilm& read_film, StoredState::StoredJob& job, StoredState& state,
                   std::vector<StoreOp>& repairs);

/// Sums over all rows, as in load_state(). A job that is not there has no rows.
Result<RowSums> load_sums(RowSource& rows);
/// Deletes rows of films whose job is lost, and adds them to the sums.
Status drop_orphans(RowSource& rows, RowSums& with_them);

/// Removes the tiles of films whose sums differ, with their results, so that they are rendered again. Adds them to
/// `damaged`.
void drop_unsound_tiles(const RowSums& found, const RowSums& written, StoredState& state,
                        std::vector<StoreOp>& repairs);

/// Adds a result to its job. `row` has tile, level, range_index, hash, worker, machine, audit, fingerprint_class and
/// checksum. False if the row is damaged: its numbers are invalid, or is_sound(key, hash, by, audit, checksum) is
/// false.
template <class IsSound>
bool take_result(const Row& row, StoredState::StoredJob& job, RendererTable& renderers, const IsSound& is_sound) {
  std::int64_t tile, level, index, audit, checksum;
  std::string hash_bytes;
  Renderer by;
  read_columns(row, tile, level, index, hash_bytes, by.worker, by.identity, audit, by.fingerprint_class, checksum);
  const NodeKey key = key_of(job.record.id, {tile, level, index});
  const Result<Hash128> hash = hash_in(hash_bytes);
  if (!is_key({tile, level, index}) || !hash.ok() || !is_sound(key, *hash, by, audit, checksum)) {
    return false;
  }
  job.results.push_back({key.tile, key.range, *hash, renderers.index_of(std::move(by)), audit == 1});
  return true;
}

}  // namespace lightmill::stored
