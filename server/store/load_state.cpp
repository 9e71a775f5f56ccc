#include "server/store/load_state.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/base/log.h"
#include "common/farm/job_rules.h"

namespace lightmill::stored {
namespace {

/// Names the rows that cannot be read.
Status in_table(const Status& status, std::string_view table, std::optional<JobId> job = {}) {
  return with_context(status, fmt::format("table {}{}", table, job ? fmt::format(", job {}", job->value) : ""));
}

Status load_records(RowSource& rows, Table table, StateReader& reader, RowSums& sums) {
  const TableInfo& info = info_of(table);
  return in_table(rows.for_each(fmt::format("SELECT {0}, message, checksum FROM {1} ORDER BY {0}", info.key, info.name),
                                [&](const Row& row) {
                                  const Key key = key_in(row, info);
                                  sums.count(table, key, row.integer(2), true);
                                  reader.take(table, key, row.view(1), row.integer(2));
                                }),
                  info.name);
}

/// Reads nodes without their values. Databases know the length of a BLOB without reading it.
Status load_outlines(RowSource& rows, StoredState::StoredJob& job, StoredState& state, RowSums& sums,
                     std::vector<StoreOp>& repairs) {
  const JobId id = job.record.id;
  return rows.for_each(
      fmt::format("SELECT tile, level, range_index, hash, non_finite, CAST(length(samples) AS BIGINT) FROM nodes WHERE "
                  "job = {} ORDER BY tile, level, range_index",
                  id.value),
      [&](const Row& row) {
        const FilmPosition place = place_in(row, 0);
        sums.count_node(id, place, row.view(3), true);
        const NodeKey key = key_of(id, place);
        if (is_key(place)) {
          job.nodes.emplace_back(key.tile, NodeOutline{key.range, row.natural(4), row.natural(5) / sizeof(float)});
        } else {
          state.damaged.push_back(key);
          log_damage(key);
          repairs.push_back(DropNodeRow{id, place.tile, place.level, place.index});
        }
      });
}

Status load_results(RowSource& rows, StoredState::StoredJob& job, StoredState& state, RendererTable& renderers,
                    RowSums& sums, std::vector<StoreOp>& repairs) {
  const auto is_sound = [](const NodeKey& key, const Hash128& hash, const Renderer& by, std::int64_t audit,
                           std::int64_t checksum) {
    return is_audit(audit) && checksum == checksum_of(key, hash, by, static_cast<Audit>(audit));
  };
  const JobId id = job.record.id;
  return rows.for_each(
      fmt::format("SELECT tile, level, range_index, hash, worker, machine, audit, fingerprint_class, checksum FROM "
                  "results WHERE job = {} ORDER BY tile, level, range_index",
                  id.value),
      [&](const Row& row) {
        const FilmPosition place = place_in(row, 0);
        sums.count_result(id, place, row.integer(8), true);
        if (!take_result(row, job, renderers, is_sound)) {
          leave_out_result({id, place.tile, place.level, place.index}, state, repairs);
        }
      });
}

/// Counts the rows of films for which a condition holds.
Status count_films(RowSource& rows, const std::string& where, RowSums& sums) {
  LM_RETURN_IF_ERROR(in_table(rows.for_each("SELECT job, tile, level, range_index, hash FROM nodes WHERE " + where,
                                            [&](const Row& row) {
                                              sums.count_node(JobId{row.natural(0)}, place_in(row, 1), row.view(4),
                                                              true);
                                            }),
                              "nodes"));
  return in_table(rows.for_each("SELECT job, tile, level, range_index, checksum FROM results WHERE " + where,
                                [&](const Row& row) {
                                  sums.count_result(JobId{row.natural(0)}, place_in(row, 1), row.integer(4), true);
                                }),
                  "results");
}

}  // namespace

Status load_values(const ReadFilm& read_film, StoredState::StoredJob& job, StoredState& state,
                   std::vector<StoreOp>& repairs) {
  std::set<std::pair<TileId, SampleRange>> lost;
  for (const StoredState::StoredNode& node : job.nodes) {
    lost.emplace(node.tile, node.outline.range);
  }
  job.nodes.clear();
  for (std::optional<FilmPosition> last = FilmPosition{}; last;) {
    LM_ASSIGN_OR_RETURN(FilmPiece piece, read_film(job.record.id, *last));
    for (StoredState::StoredNode& node : piece.nodes) {
      lost.erase({node.tile, node.outline.range});
      job.nodes.push_back(std::move(node));
    }
    last = piece.last;
  }
  for (const auto& [tile, range] : lost) {
    state.damaged.push_back({job.record.id, tile, range});
    repairs.push_back(DropNode{state.damaged.back()});
  }
  return ok_status();
}

Result<StoredState> load_state(RowSource& rows, const ReadFilm& read_film, StoredSpecs& specs, RowSums& sums,
                               std::vector<StoreOp>& repairs) {
  StoredState state;
  StateReader reader(state, repairs);
  for (std::size_t table = 0; table < kTableCount; ++table) {
    LM_RETURN_IF_ERROR(load_records(rows, static_cast<Table>(table), reader, sums));
  }
  reader.finish(specs);
  for (const JobId job : state.damaged_jobs) {
    LM_RETURN_IF_ERROR(count_films(rows, fmt::format("job = {}", job.value), sums));
  }
  RendererTable renderers;
  for (StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    LM_RETURN_IF_ERROR(in_table(load_outlines(rows, job, state, sums, repairs), "nodes", id));
    if (!has_ended(job.record.state)) {
      LM_RETURN_IF_ERROR(in_table(load_values(read_film, job, state, repairs), "nodes", id));
    }
    LM_RETURN_IF_ERROR(in_table(load_results(rows, job, state, renderers, sums, repairs), "results", id));
  }
  state.renderers = renderers.take();
  return state;
}

Result<RowSums> load_sums(RowSource& rows) {
  RowSums sums;
  for (std::size_t i = 0; i < kTableCount; ++i) {
    const TableInfo& info = kTables[i];
    LM_RETURN_IF_ERROR(in_table(rows.for_each(fmt::format("SELECT {}, checksum FROM {}", info.key, info.name),
                                              [&](const Row& row) {
                                                sums.count(static_cast<Table>(i), key_in(row, info), row.integer(1),
                                                           true);
                                              }),
                                info.name));
  }
  LM_RETURN_IF_ERROR(count_films(rows, "job IN (SELECT id FROM jobs)", sums));
  return sums;
}

Status drop_orphans(RowSource& rows, RowSums& with_them) {
  const std::string where = "job NOT IN (SELECT id FROM jobs)";
  LM_RETURN_IF_ERROR(count_films(rows, where, with_them));
  LM_RETURN_IF_ERROR(rows.execute("DELETE FROM nodes WHERE " + where));
  return rows.execute("DELETE FROM results WHERE " + where);
}

void drop_unsound_tiles(const RowSums& found, const RowSums& written, StoredState& state,
                        std::vector<StoreOp>& repairs) {
  std::set<std::pair<JobId, TileId>> named;
  std::set<JobId> jobs;
  const auto name = [&](const NodeKey& key) {
    named.emplace(key.job, key.tile);
    jobs.insert(key.job);
  };
  std::ranges::for_each(state.damaged, name);
  for (StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    const auto is_unsound = [&](TileId tile) { return !found.has_tile(written, id, tile.value); };
    const auto report = [&](const NodeKey& key) {
      name(key);
      state.damaged.push_back(key);
      log_damage(key);
    };
    std::erase_if(job.nodes, [&](const StoredState::StoredNode& node) {
      const bool drop = is_unsound(node.tile);
      if (drop) {
        report({id, node.tile, node.outline.range});
        repairs.push_back(DropNode{state.damaged.back()});
      }
      return drop;
    });
    std::erase_if(job.results, [&](const StoredState::StoredResult& result) {
      const bool drop = is_unsound(result.tile);
      if (drop && !named.contains({id, result.tile})) {
        report({id, result.tile, result.range});
      }
      if (drop) {
        repairs.push_back(DropResultRow{id, result.tile.value, result.range.level, result.range.index});
      }
      return drop;
    });
    const std::uint64_t tiles = grid_of(job.record.spec.settings).tile_count();
    for (TileId tile{0}; tile.value < tiles && job.record.state != JobState::queued && !jobs.contains(id);
         ++tile.value) {
      if (is_unsound(tile)) {
        report({id, tile, {0, 0}});  // perhaps it has lost all rows
      }
    }
  }
}

}  // namespace lightmill::stored
