#include "server/store/sqlite/load_state.h"

#include "server/store/row_values.h"

namespace lightmill::sqlite {
namespace {

stored::Key key_in(const Statement& rows, const stored::TableInfo& info) {
  return info.numbered ? stored::Key{rows.natural(0)} : stored::Key{0, rows.text(0)};
}

Status load_records(Database& database, stored::Table table, stored::StateReader& reader) {
  const stored::TableInfo& info = stored::info_of(table);
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare(fmt::format(
                                          "SELECT {0}, message, checksum FROM {1} ORDER BY {0}", info.key, info.name)));
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      return ok_status();
    }
    reader.take(table, key_in(rows, info), rows.view(1), rows.integer(2));
  }
}

Status load_next_job_id(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const std::int64_t highest,
                      database.number("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'jobs'"));
  state.next_job_id = static_cast<std::uint64_t>(highest) + 1;
  return ok_status();
}

/// Reads nodes without their values. The header of a row has the length of a BLOB, so SQLite reads none of its pages.
Status load_outlines(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT id, tile, level, range_index, non_finite, "
                                                       "length(samples) FROM nodes WHERE job = ?1 ORDER BY id"));
  LM_ASSIGN_OR_RETURN(Statement remove, database.prepare("DELETE FROM nodes WHERE id = ?1"));
  for (StoredState::StoredJob& job : state.jobs) {
    std::vector<std::uint64_t> damaged;
    rows.bind_all(job.record.id.value);
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, rows.step());
      if (!more) {
        break;
      }
      const TileId tile{static_cast<std::uint32_t>(rows.natural(1))};
      const SampleRange range{static_cast<std::uint32_t>(rows.natural(2)), static_cast<std::uint32_t>(rows.natural(3))};
      if (stored::is_key(rows.integer(1), rows.integer(2), rows.integer(3))) {
        job.nodes.emplace_back(tile, NodeOutline{range, rows.natural(4), rows.natural(5) / sizeof(float)});
      } else {
        state.damaged.push_back({job.record.id, tile, range});
        stored::log_damage(state.damaged.back());
        damaged.push_back(rows.natural(0));
      }
    }
    rows.reset();
    for (const std::uint64_t id : damaged) {
      remove.bind_all(id);
      LM_RETURN_IF_ERROR(remove.run());
    }
  }
  return ok_status();
}

Status load_results(Database& database, StoredState& state, std::vector<StoreOp>& repairs) {
  LM_ASSIGN_OR_RETURN(Statement rows,
                      database.prepare("SELECT tile, level, range_index, hash, worker, machine, "
                                       "audit, fingerprint_class, checksum FROM results WHERE job = ?1"));
  stored::RendererTable renderers;
  for (StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    rows.bind_all(id.value);
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, rows.step());
      if (!more) {
        break;
      }
      const std::int64_t tile = rows.integer(0), level = rows.integer(1), index = rows.integer(2);
      const NodeKey key{id,
                        TileId{static_cast<std::uint32_t>(tile)},
                        {static_cast<std::uint32_t>(level), static_cast<std::uint32_t>(index)}};
      const Result<Hash128> hash = stored::hash_in(rows.view(3));
      Renderer by{rows.text(4), rows.text(5), rows.text(7)};
      const auto audit = static_cast<stored::Audit>(rows.integer(6));
      if (!stored::is_key(tile, level, index) || !hash.ok() || !stored::is_audit(rows.integer(6)) ||
          rows.integer(8) != stored::checksum_of(key, *hash, by, audit)) {
        stored::leave_out_result({id, tile, level, index}, state, repairs);
        continue;
      }
      job.results.push_back(
          {key.tile, key.range, *hash, renderers.index_of(std::move(by)), audit == stored::Audit::wanted});
    }
    rows.reset();
  }
  state.renderers = renderers.take();
  return ok_status();
}

}  // namespace

Result<StoredState> load_state(Database& database, stored::StoredSpecs& specs, std::vector<StoreOp>& repairs) {
  StoredState state;
  stored::StateReader reader(state, repairs);
  for (std::size_t table = 0; table < stored::kTableCount; ++table) {
    LM_RETURN_IF_ERROR(load_records(database, static_cast<stored::Table>(table), reader));
  }
  reader.finish(specs);
  LM_RETURN_IF_ERROR(load_next_job_id(database, state));
  LM_RETURN_IF_ERROR(load_outlines(database, state));
  for (StoredState::StoredJob& job : state.jobs) {
    if (!has_ended(job.record.state)) {
      LM_RETURN_IF_ERROR(stored::load_values(
          job, state, repairs, [&](JobId id, const FilmPosition& after) { return read_film(database, id, after); }));
    }
  }
  LM_RETURN_IF_ERROR(load_results(database, state, repairs));
  return state;
}

Result<FilmPiece> read_film(Database& database, JobId job, const FilmPosition& after) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT tile, level, range_index, non_finite, hash, samples "
                                                       "FROM nodes WHERE job = ?1 AND (tile, level, range_index) > "
                                                       "(?2, ?3, ?4) ORDER BY tile, level, range_index"));
  rows.bind_all(job.value, after.tile, after.level, after.index);
  FilmPiece piece;
  for (std::size_t size_bytes = 0; size_bytes < stored::kFilmPieceBytes;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      piece.last.reset();
      break;
    }
    piece.last = {rows.integer(0), rows.integer(1), rows.integer(2)};
    size_bytes += stored::take_node(job, *piece.last, rows.natural(3), rows.view(4), rows.view(5), piece);
  }
  return piece;
}

Result<stored::RowKeys> load_keys(Database& database) {
  stored::RowKeys keys;
  for (std::size_t i = 0; i < stored::kTableCount; ++i) {
    const stored::TableInfo& info = stored::kTables[i];
    LM_ASSIGN_OR_RETURN(Statement rows, database.prepare(fmt::format("SELECT {} FROM {}", info.key, info.name)));
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, rows.step());
      if (!more) {
        break;
      }
      keys.put(static_cast<stored::Table>(i), key_in(rows, info));
    }
  }
  keys.keep();
  return keys;
}

}  // namespace lightmill::sqlite
