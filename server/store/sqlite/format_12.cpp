#include "server/store/sqlite/format_12.h"

#include "server/store/old_rows.h"

namespace lightmill::sqlite {
namespace {

namespace old = stored::old;

Status load_jobs_of_format_12(Database& database, StoredState& state, old::JobCheck& check) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT * FROM jobs ORDER BY id"));
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      break;
    }
    JobRecord job;
    int column = 0;
    job.id = JobId{rows.natural(column++)};
    job.spec.request_id = rows.text(column++);
    job.spec.name = rows.text(column++);
    job.spec.owner = rows.text(column++);
    job.spec.host = rows.text(column++);
    job.spec.parent = JobId{rows.natural(column++)};
    job.spec.priority = static_cast<std::int32_t>(rows.integer(column++));
    job.spec.goal.samples = rows.natural(column++);
    job.spec.goal.seconds = rows.real(column++);
    job.state = check.sound(job.id, old::state_named(rows.view(column++)));
    job.reason = rows.text(column++);
    job.fingerprint_class = rows.text(column++);
    job.active_seconds = rows.real(column++);
    job.worker_seconds = rows.real(column++);
    job.counters.results_merged = rows.natural(column++);
    job.counters.results_duplicate = rows.natural(column++);
    job.counters.leases_lost = rows.natural(column++);
    job.counters.copies_leased = rows.natural(column++);
    job.counters.non_finite = rows.natural(column++);
    job.submitted_unix_ms = rows.integer(column++);
    job.finished_unix_ms = rows.integer(column++);
    job.spec.goal.error = rows.real(column++);
    job.reached = check.sound(job.id, old::limit_named(rows.view(column++)));
    job.spec.goal.adaptive = rows.integer(column++) != 0;
    job.spec.verify_share = rows.real(column++);
    job.counters.results_verified = rows.natural(column++);
    job.counters.nodes_dropped = rows.natural(column++);
    job.spec.allow_mixed = rows.integer(column++) != 0;
    check.expect(job.id, rows.view(column++));
    state.jobs.push_back({std::move(job), {}});
  }
  LM_ASSIGN_OR_RETURN(const std::int64_t highest,
                      database.number("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'jobs'"));
  state.next_job_id = static_cast<std::uint64_t>(highest) + 1;
  return ok_status();
}

Status load_settings_of_format_12(Database& database, StoredState& state, old::JobCheck& check) {
  LM_ASSIGN_OR_RETURN(Statement settings_row, database.prepare("SELECT * FROM job_settings WHERE job = ?1"));
  LM_ASSIGN_OR_RETURN(Statement assets,
                      database.prepare("SELECT digest FROM job_assets WHERE job = ?1 ORDER BY position"));
  LM_ASSIGN_OR_RETURN(Statement layers,
                      database.prepare("SELECT name, channels, kind FROM job_layers WHERE job = ?1 ORDER BY position"));
  for (StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    RenderSettings& settings = job.record.spec.settings;
    MethodNotes& notes = job.record.method_notes;
    settings_row.bind_all(id.value);
    LM_ASSIGN_OR_RETURN(const bool found, settings_row.step());
    if (!found) {
      check.mark_damaged(id, data_loss("it has no settings"));
      settings_row.reset();
      continue;
    }
    int column = 1;
    settings.scene = settings_row.text(column++);
    for (int* value : {&settings.width, &settings.height, &settings.crop.x, &settings.crop.y, &settings.crop.width,
                       &settings.crop.height}) {
      *value = static_cast<int>(settings_row.integer(column++));
    }
    settings.seed = settings_row.natural(column++);
    settings.method = settings_row.text(column++);
    settings.max_bounces = static_cast<std::uint32_t>(settings_row.natural(column++));
    settings.renderer_version = settings_row.text(column++);
    settings.meters = static_cast<std::uint32_t>(settings_row.natural(column++));
    notes.chosen = settings_row.integer(column++) != 0;
    notes.reasons = old::lines_in(settings_row.view(column++));
    notes.notices = old::lines_in(settings_row.view(column++));
    notes.candidates = old::lines_in(settings_row.view(column++));
    job.record.allocation = check.sound(id, old::allocation_in(settings_row.view(column++), job.record));
    settings_row.reset();

    assets.bind_all(id.value);
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, assets.step());
      if (!more) {
        break;
      }
      settings.assets.push_back(check.sound(id, stored::digest_in(assets.view(0), "an asset's digest")));
    }
    assets.reset();

    settings.layers.clear();
    layers.bind_all(id.value);
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, layers.step());
      if (!more) {
        break;
      }
      const LayerKind kind = check.sound(id, old::layer_kind_named(layers.view(2), id.value));
      settings.layers.push_back({layers.text(0), static_cast<std::uint32_t>(layers.natural(1)), kind});
    }
    layers.reset();
  }
  return ok_status();
}

Status load_histories_of_format_12(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT samples, worker_seconds, rel_mse, half_width FROM "
                                                       "job_errors WHERE job = ?1 ORDER BY samples"));
  for (StoredState::StoredJob& job : state.jobs) {
    rows.bind_all(job.record.id.value);
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, rows.step());
      if (!more) {
        break;
      }
      job.record.history.push_back({rows.real(0), rows.real(1), rows.real(2), rows.real(3)});
    }
    rows.reset();
  }
  return ok_status();
}

Status load_nodes_of_format_12(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT id, tile, level, range_index, non_finite, hash, samples "
                                                       "FROM nodes WHERE job = ?1 ORDER BY id"));
  for (StoredState::StoredJob& job : state.jobs) {
    rows.bind_all(job.record.id.value);
    for (;;) {
      LM_ASSIGN_OR_RETURN(const bool more, rows.step());
      if (!more) {
        break;
      }
      const TileId tile{static_cast<std::uint32_t>(rows.natural(1))};
      const SampleRange range{static_cast<std::uint32_t>(rows.natural(2)), static_cast<std::uint32_t>(rows.natural(3))};
      std::shared_ptr<const Node> node =
          stored::node_of({job.record.id, tile, range}, rows.natural(4), rows.view(5), rows.view(6));
      if (node == nullptr) {
        state.damaged.push_back({job.record.id, tile, range});
        stored::log_damage(state.damaged.back());
        continue;
      }
      job.nodes.push_back({tile, std::move(node)});
    }
    rows.reset();
  }
  return ok_status();
}

Status load_results_of_format_12(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(Statement rows,
                      database.prepare("SELECT tile, level, range_index, hash, worker, machine, "
                                       "verification, fingerprint_class, checksum FROM results WHERE job = ?1"));
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
      if (!stored::is_key(tile, level, index) || !hash.ok() || rows.integer(8) != old::checksum_of(key, *hash, by)) {
        state.damaged_results.push_back({id, tile, level, index});
        continue;
      }
      job.results.push_back({key.tile, key.range, *hash, renderers.index_of(std::move(by)), rows.integer(6) == 1});
    }
    rows.reset();
  }
  state.renderers = renderers.take();
  return ok_status();
}

Status load_quarantine_of_format_12(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(
      Statement rows,
      database.prepare("SELECT worker, machine, reason, since_unix_ms FROM quarantine ORDER BY worker"));
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      break;
    }
    state.quarantine.push_back({{rows.text(0), rows.text(1)}, rows.text(2), rows.integer(3)});
  }
  LM_ASSIGN_OR_RETURN(Statement secret, database.prepare("SELECT secret FROM verification_secret"));
  LM_ASSIGN_OR_RETURN(const bool found, secret.step());
  LM_ASSIGN_OR_RETURN(state.secret, stored::digest_in(found ? secret.view(0) : "", "the secret of verification"));
  return ok_status();
}

Status load_tokens_of_format_12(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT id, name, roles, hash, made_by, made_unix_s, "
                                                       "until_unix_s FROM tokens ORDER BY id"));
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      return ok_status();
    }
    TokenRecord token;
    token.id = rows.text(0);
    token.name = rows.text(1);
    const Result<Roles> roles = old::roles_in(rows.view(2), token.id);
    const Result<Sha256> hash = stored::digest_in(rows.view(3), "its hash");
    if (!roles.ok() || !hash.ok()) {
      old::leave_out("token " + token.id, roles.ok() ? hash.status() : roles.status(), state);
      continue;
    }
    token.roles = *roles;
    token.hash = *hash;
    token.made_by = rows.text(4);
    token.made_unix_s = rows.integer(5);
    token.until_unix_s = rows.integer(6);
    state.tokens.push_back(std::move(token));
  }
}

Status load_actions_of_format_12(Database& database, StoredState& state) {
  LM_ASSIGN_OR_RETURN(Statement rows, database.prepare("SELECT number, unix_ms, who, proof, token, peer, what, job, "
                                                       "about, outcome, message FROM actions ORDER BY number"));
  for (;;) {
    LM_ASSIGN_OR_RETURN(const bool more, rows.step());
    if (!more) {
      return ok_status();
    }
    Action action;
    int column = 0;
    action.number = rows.natural(column++);
    action.unix_ms = rows.integer(column++);
    action.caller = rows.text(column++);
    const Result<Proof> proof = old::proof_named(rows.view(column++));
    if (!proof.ok()) {
      old::leave_out(fmt::format("entry {} of the log", action.number), proof.status(), state);
      continue;
    }
    action.proof = *proof;
    action.token = rows.text(column++);
    action.peer = rows.text(column++);
    action.operation = rows.text(column++);
    action.job = rows.natural(column++);
    action.about = rows.text(column++);
    action.outcome = static_cast<StatusCode>(rows.integer(column++));
    action.message = rows.text(column++);
    state.actions.push_back(std::move(action));
  }
}

}  // namespace

Result<StoredState> load_format_12(Database& database) {
  StoredState state;
  old::JobCheck check;
  LM_RETURN_IF_ERROR(load_jobs_of_format_12(database, state, check));
  LM_RETURN_IF_ERROR(load_settings_of_format_12(database, state, check));
  check.finish(state);
  LM_RETURN_IF_ERROR(load_histories_of_format_12(database, state));
  LM_RETURN_IF_ERROR(load_nodes_of_format_12(database, state));
  LM_RETURN_IF_ERROR(load_results_of_format_12(database, state));
  LM_RETURN_IF_ERROR(load_quarantine_of_format_12(database, state));
  LM_RETURN_IF_ERROR(load_tokens_of_format_12(database, state));
  LM_RETURN_IF_ERROR(load_actions_of_format_12(database, state));
  LM_ASSIGN_OR_RETURN(const std::int64_t epoch, database.number("SELECT value FROM meta WHERE key = 'epoch'"));
  state.epoch = static_cast<std::uint64_t>(epoch);
  return state;
}

}  // namespace lightmill::sqlite
