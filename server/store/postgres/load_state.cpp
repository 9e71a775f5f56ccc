#include "server/store/postgres/load_state.h"

#include <set>
#include <unordered_map>

#include "server/store/row_values.h"

namespace lightmill::postgres {
namespace {

/// Nodes are some 100 KB, and several MB with many layers.
constexpr std::int64_t kNodesAtOnce = 32;
/// A packed scene has up to 16 MiB.
constexpr std::int64_t kSettingsAtOnce = 8;
constexpr std::int64_t kResultsAtOnce = 10'000;

using JobsById = std::unordered_map<std::uint64_t, StoredState::StoredJob*>;

Status load_jobs(Session& session, StoredState& state, stored::JobCheck& check) {
  LM_ASSIGN_OR_RETURN(
      const Rows rows,
      session.query(
          "SELECT id, request_id, name, owner, host, parent, priority, goal_samples, goal_seconds, goal_error, "
          "goal_adaptive, state, reason, reached, fingerprint_class, active_seconds, worker_seconds, "
          "results_merged, results_duplicate, leases_lost, copies_leased, non_finite, submitted_unix_ms, "
          "finished_unix_ms, verify_share, results_verified, nodes_dropped, allow_mixed, checksum FROM jobs ORDER BY "
          "id"));
  for (int row = 0; row < rows.size(); ++row) {
    JobRecord job;
    int column = 0;
    const auto text = [&] { return rows.text(row, column++); };
    const auto natural = [&] { return rows.natural(row, column++); };
    const auto integer = [&] { return rows.integer(row, column++); };
    const auto real = [&] { return rows.real(row, column++); };
    job.id = JobId{natural()};
    job.spec.request_id = text();
    job.spec.name = text();
    job.spec.owner = text();
    job.spec.host = text();
    job.spec.parent = JobId{natural()};
    job.spec.priority = static_cast<std::int32_t>(integer());
    job.spec.goal.samples = natural();
    job.spec.goal.seconds = real();
    job.spec.goal.error = real();
    job.spec.goal.adaptive = integer() != 0;
    job.state = check.sound(job.id, stored::state_named(text()));
    job.reason = text();
    job.reached = check.sound(job.id, stored::limit_named(text()));
    job.fingerprint_class = text();
    job.active_seconds = real();
    job.worker_seconds = real();
    job.counters.results_merged = natural();
    job.counters.results_duplicate = natural();
    job.counters.leases_lost = natural();
    job.counters.copies_leased = natural();
    job.counters.non_finite = natural();
    job.submitted_unix_ms = integer();
    job.finished_unix_ms = integer();
    job.spec.verify_share = real();
    job.counters.results_verified = natural();
    job.counters.nodes_dropped = natural();
    job.spec.allow_mixed = integer() != 0;
    check.expect(job.id, rows.view(row, column++));
    state.jobs.push_back({std::move(job), {}});
  }
  LM_ASSIGN_OR_RETURN(const Rows highest, session.query("SELECT highest_job FROM turn"));
  state.next_job_id = highest.natural(0, 0) + 1;
  return ok_status();
}

void read_settings(const Rows& rows, int row, JobRecord& record, stored::JobCheck& check) {
  RenderSettings& settings = record.spec.settings;
  MethodNotes& notes = record.method_notes;
  int column = 1;
  settings.scene = rows.text(row, column++);
  for (int* value : {&settings.width, &settings.height, &settings.crop.x, &settings.crop.y, &settings.crop.width,
                     &settings.crop.height}) {
    *value = static_cast<int>(rows.integer(row, column++));
  }
  settings.seed = rows.natural(row, column++);
  settings.max_bounces = static_cast<std::uint32_t>(rows.natural(row, column++));
  settings.renderer_version = rows.text(row, column++);
  settings.meters = static_cast<std::uint32_t>(rows.natural(row, column++));
  settings.method = rows.text(row, column++);
  settings.layers.clear();
  notes.chosen = rows.integer(row, column++) != 0;
  notes.reasons = stored::lines_in(rows.view(row, column++));
  notes.notices = stored::lines_in(rows.view(row, column++));
  notes.candidates = stored::lines_in(rows.view(row, column++));
  record.allocation = check.sound(record.id, stored::allocation_in(rows.view(row, column++), record));
}

Status load_settings(Session& session, const JobsById& jobs, stored::JobCheck& check) {
  std::set<std::uint64_t> found;
  for (std::int64_t last = INT64_MIN;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query("SELECT job, scene, width, height, crop_x, crop_y, crop_width, crop_height, seed, max_bounces, "
                      "renderer_version, meters, method, method_chosen, method_reasons, method_notices, "
                      "method_candidates, allocation FROM job_settings WHERE job > $1 ORDER BY job LIMIT $2",
                      Parameters(last, kSettingsAtOnce)));
    for (int row = 0; row < rows.size(); ++row) {
      last = rows.integer(row, 0);
      const std::uint64_t id = rows.natural(row, 0);
      read_settings(rows, row, jobs.at(id)->record, check);
      found.insert(id);
    }
    if (rows.size() < kSettingsAtOnce) {
      break;
    }
  }
  for (const auto& [id, job] : jobs) {
    if (!found.contains(id)) {
      check.condemn(job->record.id, data_loss("it has no settings"));
    }
  }
  return ok_status();
}

Status load_lists(Session& session, const JobsById& jobs, stored::JobCheck& check) {
  LM_ASSIGN_OR_RETURN(const Rows assets, session.query("SELECT job, digest FROM job_assets ORDER BY job, position"));
  for (int row = 0; row < assets.size(); ++row) {
    JobRecord& record = jobs.at(assets.natural(row, 0))->record;
    record.spec.settings.assets.push_back(
        check.sound(record.id, stored::digest_in(assets.view(row, 1), "an asset's digest")));
  }
  LM_ASSIGN_OR_RETURN(const Rows layers,
                      session.query("SELECT job, name, channels, kind FROM job_layers ORDER BY job, position"));
  for (int row = 0; row < layers.size(); ++row) {
    const std::uint64_t job = layers.natural(row, 0);
    const LayerKind kind = check.sound(JobId{job}, stored::layer_kind_named(layers.view(row, 3), job));
    jobs.at(job)->record.spec.settings.layers.push_back(
        {layers.text(row, 1), static_cast<std::uint32_t>(layers.natural(row, 2)), kind});
  }
  LM_ASSIGN_OR_RETURN(const Rows errors, session.query("SELECT job, samples, worker_seconds, rel_mse, half_width FROM "
                                                       "job_errors ORDER BY job, samples"));
  for (int row = 0; row < errors.size(); ++row) {
    jobs.at(errors.natural(row, 0))
        ->record.history.push_back(
            {errors.real(row, 1), errors.real(row, 2), errors.real(row, 3), errors.real(row, 4)});
  }
  return ok_status();
}

Status load_results(Session& session, StoredState::StoredJob& job, StoredState& state, stored::RendererTable& renderers,
                    std::vector<StoreOp>& repairs) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  std::int64_t tile = kLeast, level = kLeast, index = kLeast;
  for (;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query(
            "SELECT tile, level, range_index, hash, worker, machine, verification, fingerprint_class, checksum FROM "
            "results "
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
      if (!stored::is_key(tile, level, index) || !hash.ok() ||
          rows.integer(row, 8) != stored::checksum_of(key, *hash, by)) {
        stored::leave_out_result({key.job, tile, level, index}, state, repairs);
        continue;
      }
      job.results.push_back({key.tile, key.range, *hash, renderers.index_of(std::move(by)), rows.integer(row, 6) == 1});
    }
    if (rows.size() < kResultsAtOnce) {
      return ok_status();
    }
  }
}

Status load_quarantine(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT worker, machine, reason, since_unix_ms FROM quarantine ORDER BY worker"));
  for (int row = 0; row < rows.size(); ++row) {
    state.quarantine.push_back({{rows.text(row, 0), rows.text(row, 1)}, rows.text(row, 2), rows.integer(row, 3)});
  }
  LM_ASSIGN_OR_RETURN(const Rows secret, session.query("SELECT secret FROM verification_secret"));
  LM_ASSIGN_OR_RETURN(state.secret,
                      stored::digest_in(secret.size() == 1 ? secret.view(0, 0) : "", "the secret of verification"));
  return ok_status();
}

Status load_tokens(Session& session, StoredState& state, std::vector<StoreOp>& repairs) {
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query("SELECT id, name, roles, hash, made_by, made_unix_s, until_unix_s "
                                                     "FROM tokens ORDER BY id"));
  for (int row = 0; row < rows.size(); ++row) {
    TokenRecord token;
    token.id = rows.text(row, 0);
    token.name = rows.text(row, 1);
    const Result<Roles> roles = stored::roles_in(rows.view(row, 2), token.id);
    const Result<Sha256> hash = stored::digest_in(rows.view(row, 3), "its hash");
    if (!roles.ok() || !hash.ok()) {
      stored::leave_out_token(token.id, roles.ok() ? hash.status() : roles.status(), state, repairs);
      continue;
    }
    token.roles = *roles;
    token.hash = *hash;
    token.made_by = rows.text(row, 4);
    token.made_unix_s = rows.integer(row, 5);
    token.until_unix_s = rows.integer(row, 6);
    state.tokens.push_back(std::move(token));
  }
  return ok_status();
}

Status load_actions(Session& session, StoredState& state, std::vector<StoreOp>& repairs) {
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT number, unix_ms, who, proof, token, peer, what, job, about, "
                                    "outcome, message FROM actions ORDER BY number"));
  for (int row = 0; row < rows.size(); ++row) {
    Action action;
    int column = 0;
    action.number = rows.natural(row, column++);
    action.unix_ms = rows.integer(row, column++);
    action.who = rows.text(row, column++);
    const Result<Proof> proof = stored::proof_named(rows.view(row, column++));
    if (!proof.ok()) {
      stored::leave_out_action(action.number, proof.status(), state, repairs);
      continue;
    }
    action.proof = *proof;
    action.token = rows.text(row, column++);
    action.peer = rows.text(row, column++);
    action.what = rows.text(row, column++);
    action.job = rows.natural(row, column++);
    action.about = rows.text(row, column++);
    action.outcome = static_cast<StatusCode>(rows.integer(row, column++));
    action.message = rows.text(row, column++);
    state.actions.push_back(std::move(action));
  }
  return ok_status();
}

Status load_nodes(Session& session, StoredState::StoredJob& job, StoredState& state, std::vector<StoreOp>& repairs) {
  NodeKey key{job.record.id, {}, {}};
  std::int64_t tile = -1, level = -1, index = -1;
  for (;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query("SELECT tile, level, range_index, non_finite, hash, samples FROM nodes WHERE job = $1 AND (tile, "
                      "level, range_index) > ($2, $3, $4) ORDER BY tile, level, range_index LIMIT $5",
                      Parameters(job.record.id.value, tile, level, index, kNodesAtOnce)));
    for (int row = 0; row < rows.size(); ++row) {
      tile = rows.integer(row, 0);
      level = rows.integer(row, 1);
      index = rows.integer(row, 2);
      key.tile = TileId{static_cast<std::uint32_t>(tile)};
      key.range = {static_cast<std::uint32_t>(level), static_cast<std::uint32_t>(index)};
      auto node = stored::node_of(key.range, rows.natural(row, 3), rows.view(row, 4), rows.view(row, 5));
      if (node == nullptr) {
        stored::log_damage(key);
        state.damaged.push_back(key);
        repairs.push_back(DropNode{key});
      } else {
        job.nodes.push_back({key.tile, std::move(node)});
      }
    }
    if (rows.size() < kNodesAtOnce) {
      return ok_status();
    }
  }
}

}  // namespace

Result<StoredState> load_state(Session& session, std::vector<StoreOp>& repairs) {
  StoredState state;
  stored::JobCheck check;
  LM_RETURN_IF_ERROR(load_jobs(session, state, check));
  JobsById jobs;
  for (StoredState::StoredJob& job : state.jobs) {
    jobs.emplace(job.record.id.value, &job);
  }
  LM_RETURN_IF_ERROR(load_settings(session, jobs, check));
  LM_RETURN_IF_ERROR(load_lists(session, jobs, check));
  check.finish(state);
  stored::RendererTable renderers;
  for (StoredState::StoredJob& job : state.jobs) {
    LM_RETURN_IF_ERROR(load_nodes(session, job, state, repairs));
    LM_RETURN_IF_ERROR(load_results(session, job, state, renderers, repairs));
  }
  state.renderers = renderers.take();
  LM_RETURN_IF_ERROR(load_quarantine(session, state));
  LM_RETURN_IF_ERROR(load_tokens(session, state, repairs));
  LM_RETURN_IF_ERROR(load_actions(session, state, repairs));
  return state;
}

}  // namespace lightmill::postgres
