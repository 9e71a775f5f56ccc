#include "server/store/load_state.h"

namespace lightmill::stored {
namespace {

Key key_in(const Row& row, const TableInfo& info) {
  return info.numbered ? Key{row.natural(0)} : Key{0, row.text(0)};
}

/// Names the rows that cannot be read.
Status in_table(const Status& status, std::string_view table, std::optional<JobId> job = {}) {
  return with_context(status, fmt::format("table {}{}", table, job ? fmt::format(", job {}", job->value) : ""));
}

Status load_records(RowSource& rows, Table table, StateReader& reader) {
  const TableInfo& info = info_of(table);
  return in_table(
      rows.for_each(fmt::format("SELECT {0}, message, checksum FROM {1} ORDER BY {0}", info.key, info.name),
                    [&](const Row& row) { reader.take(table, key_in(row, info), row.view(1), row.integer(2)); }),
      info.name);
}

/// Reads nodes without their values. Databases know the length of a BLOB without reading it. Removes rows that are no
/// nodes.
Status load_outlines(RowSource& rows, StoredState::StoredJob& job, StoredState& state) {
  const JobId id = job.record.id;
  std::vector<FilmPosition> damaged;
  LM_RETURN_IF_ERROR(rows.for_each(
      fmt::format("SELECT tile, level, range_index, non_finite, CAST(length(samples) AS BIGINT) FROM nodes WHERE job = "
                  "{} ORDER BY tile, level, range_index",
                  id.value),
      [&](const Row& row) {
        const FilmPosition position{row.integer(0), row.integer(1), row.integer(2)};
        const NodeKey key = key_of(id, position);
        if (is_key(position)) {
          job.nodes.emplace_back(key.tile, NodeOutline{key.range, row.natural(3), row.natural(4) / sizeof(float)});
        } else {
          state.damaged.push_back(key);
          log_damage(key);
          damaged.push_back(position);
        }
      }));
  for (const FilmPosition& position : damaged) {
    LM_RETURN_IF_ERROR(
        rows.execute(fmt::format("DELETE FROM nodes WHERE job = {} AND tile = {} AND level = {} AND range_index = {}",
                                 id.value, position.tile, position.level, position.index)));
  }
  return ok_status();
}

Status load_results(RowSource& rows, StoredState::StoredJob& job, StoredState& state, RendererTable& renderers,
                    std::vector<StoreOp>& repairs) {
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
        if (!take_result(row, job, renderers, is_sound)) {
          leave_out_result({id, row.integer(0), row.integer(1), row.integer(2)}, state, repairs);
        }
      });
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

Result<StoredState> load_state(RowSource& rows, const ReadFilm& read_film, StoredSpecs& specs,
                               std::vector<StoreOp>& repairs) {
  StoredState state;
  StateReader reader(state, repairs);
  for (std::size_t table = 0; table < kTableCount; ++table) {
    LM_RETURN_IF_ERROR(load_records(rows, static_cast<Table>(table), reader));
  }
  reader.finish(specs);
  RendererTable renderers;
  for (StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    LM_RETURN_IF_ERROR(in_table(load_outlines(rows, job, state), "nodes", id));
    if (!has_ended(job.record.state)) {
      LM_RETURN_IF_ERROR(in_table(load_values(read_film, job, state, repairs), "nodes", id));
    }
    LM_RETURN_IF_ERROR(in_table(load_results(rows, job, state, renderers, repairs), "results", id));
  }
  state.renderers = renderers.take();
  return state;
}

Result<RowKeys> load_keys(RowSource& rows) {
  RowKeys keys;
  for (std::size_t i = 0; i < kTableCount; ++i) {
    const TableInfo& info = kTables[i];
    LM_RETURN_IF_ERROR(
        in_table(rows.for_each(fmt::format("SELECT {} FROM {}", info.key, info.name),
                               [&](const Row& row) { keys.put(static_cast<Table>(i), key_in(row, info)); }),
                 info.name));
  }
  keys.keep();
  return keys;
}

}  // namespace lightmill::stored
