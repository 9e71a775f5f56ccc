#include "server/store/postgres/load_state.h"

#include <limits>

#include "server/store/row_values.h"

namespace lightmill::postgres {
namespace {

/// Nodes have about 100 KB, or several MB with many layers.
constexpr std::int64_t kNodesAtOnce = 32;
/// A packed scene has up to 16 MiB.
constexpr std::int64_t kSpecsAtOnce = 8;
constexpr std::int64_t kRecordsAtOnce = 1'000;
constexpr std::int64_t kResultsAtOnce = 10'000;

Status load_records(Session& session, stored::Table table, stored::StateReader& reader) {
  const stored::TableInfo& info = stored::info_of(table);
  const std::int64_t most = table == stored::Table::job_specs ? kSpecsAtOnce : kRecordsAtOnce;
  const std::string query =
      fmt::format("SELECT {0}, message, checksum FROM {1} WHERE {0} > $1 ORDER BY {0} LIMIT $2", info.key, info.name);
  std::int64_t number = std::numeric_limits<std::int64_t>::min();
  std::string name;
  for (;;) {
    LM_ASSIGN_OR_RETURN(const Rows rows, info.numbered
                                             ? session.query(query.c_str(), Parameters(number, most))
                                             : session.query(query.c_str(), Parameters(as_byte_view(name), most)));
    for (int row = 0; row < rows.size(); ++row) {
      stored::Key key;
      if (info.numbered) {
        number = rows.integer(row, 0);
        key.number = static_cast<std::uint64_t>(number);
      } else {
        key.name = name = rows.text(row, 0);
      }
      reader.take(table, key, rows.view(row, 1), rows.integer(row, 2));
    }
    if (rows.size() < most) {
      return ok_status();
    }
  }
}

Status load_results(Session& session, StoredState::StoredJob& job, StoredState& state, stored::RendererTable& renderers,
                    std::vector<StoreOp>& repairs) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  std::int64_t tile = kLeast, level = kLeast, index = kLeast;
  for (;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query(
            "SELECT tile, level, range_index, hash, worker, machine, audit, fingerprint_class, checksum FROM results "
            "WHERE job = $1 AND (tile, level, range_index) > ($2, $3, $4) ORDER BY tile, level, range_index LIMIT $5",
            Parameters(job.record.id.value, tile, level, index, kResultsAtOnce)));
    for (int row = 0; row < rows.size(); ++row) {
      tile = rows.integer(row, 0);
      level = rows.integer(row, 1);
      index = rows.integer(row, 2);
      const NodeKey key{job.record.id,
                        TileId{static_cast<std::uint32_t>(tile)},
                        {static_cast<std::uint32_t>(level), static_cast<std::uint32_t>(index)}};
      const Result<Hash128> hash = stored::hash_in(rows.view(row, 3));
      Renderer by{rows.text(row, 4), rows.text(row, 5), rows.text(row, 7)};
      const auto audit = static_cast<stored::Audit>(rows.integer(row, 6));
      if (!stored::is_key(tile, level, index) || !hash.ok() || !stored::is_audit(rows.integer(row, 6)) ||
          rows.integer(row, 8) != stored::checksum_of(key, *hash, by, audit)) {
        stored::leave_out_result({key.job, tile, level, index}, state, repairs);
        continue;
      }
      job.results.push_back(
          {key.tile, key.range, *hash, renderers.index_of(std::move(by)), audit == stored::Audit::wanted});
    }
    if (rows.size() < kResultsAtOnce) {
      return ok_status();
    }
  }
}

Status load_secret(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query("SELECT secret, checksum FROM audit_secret"));
  LM_ASSIGN_OR_RETURN(state.secret, stored::digest_in(rows.size() == 1 ? rows.view(0, 0) : "", "the secret of audits"));
  LM_ASSIGN_OR_RETURN(const Sha256 checksum, stored::digest_in(rows.view(0, 1), "its checksum"));
  return checksum == sha256(rows.view(0, 0))
             ? ok_status()
             : data_loss("the secret of audits in the database is damaged; restore a backup");
}

Status load_next_job_id(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const Rows highest, session.query("SELECT highest_job FROM turn"));
  state.next_job_id = highest.natural(0, 0) + 1;
  return ok_status();
}

/// Reads nodes without their values. octet_length() does not read them. Removes rows that are no nodes.
Status load_outlines(Session& session, StoredState::StoredJob& job, StoredState& state) {
  FilmPosition position;
  for (;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query("SELECT tile, level, range_index, non_finite, octet_length(samples)::BIGINT FROM nodes WHERE job "
                      "= $1 AND (tile, level, range_index) > ($2, $3, $4) ORDER BY tile, level, range_index LIMIT $5",
                      Parameters(job.record.id.value, position.tile, position.level, position.index, kResultsAtOnce)));
    for (int row = 0; row < rows.size(); ++row) {
      position = {rows.integer(row, 0), rows.integer(row, 1), rows.integer(row, 2)};
      const TileId tile{static_cast<std::uint32_t>(position.tile)};
      const SampleRange range{static_cast<std::uint32_t>(position.level), static_cast<std::uint32_t>(position.index)};
      if (stored::is_key(position.tile, position.level, position.index)) {
        job.nodes.emplace_back(tile, NodeOutline{range, rows.natural(row, 3), rows.natural(row, 4) / sizeof(float)});
        continue;
      }
      state.damaged.push_back({job.record.id, tile, range});
      stored::log_damage(state.damaged.back());
      LM_RETURN_IF_ERROR(
          session
              .query("DELETE FROM nodes WHERE job = $1 AND tile = $2 AND level = $3 AND range_index = $4",
                     Parameters(job.record.id.value, position.tile, position.level, position.index))
              .status());
    }
    if (rows.size() < kResultsAtOnce) {
      return ok_status();
    }
  }
}

}  // namespace

Result<StoredState> load_state(Session& session, stored::StoredSpecs& specs, std::vector<StoreOp>& repairs) {
  StoredState state;
  stored::StateReader reader(state, repairs);
  for (std::size_t table = 0; table < stored::kTableCount; ++table) {
    LM_RETURN_IF_ERROR(load_records(session, static_cast<stored::Table>(table), reader));
  }
  reader.finish(specs);
  LM_RETURN_IF_ERROR(load_next_job_id(session, state));
  stored::RendererTable renderers;
  for (StoredState::StoredJob& job : state.jobs) {
    LM_RETURN_IF_ERROR(load_outlines(session, job, state));
    if (!has_ended(job.record.state)) {
      LM_RETURN_IF_ERROR(stored::load_values(
          job, state, repairs, [&](JobId id, const FilmPosition& after) { return read_film(session, id, after); }));
    }
    LM_RETURN_IF_ERROR(load_results(session, job, state, renderers, repairs));
  }
  state.renderers = renderers.take();
  LM_RETURN_IF_ERROR(load_secret(session, state));
  return state;
}

Result<FilmPiece> read_film(Session& session, JobId job, const FilmPosition& after) {
  LM_ASSIGN_OR_RETURN(
      const Rows rows,
      session.query("SELECT tile, level, range_index, non_finite, hash, samples FROM nodes WHERE job = $1 AND (tile, "
                    "level, range_index) > ($2, $3, $4) ORDER BY tile, level, range_index LIMIT $5",
                    Parameters(job.value, after.tile, after.level, after.index, kNodesAtOnce)));
  FilmPiece piece;
  for (int row = 0; row < rows.size(); ++row) {
    const FilmPosition position{rows.integer(row, 0), rows.integer(row, 1), rows.integer(row, 2)};
    stored::take_node(job, position, rows.natural(row, 3), rows.view(row, 4), rows.view(row, 5), piece);
    piece.last = position;
  }
  if (rows.size() < kNodesAtOnce) {
    piece.last.reset();
  }
  return piece;
}

}  // namespace lightmill::postgres
