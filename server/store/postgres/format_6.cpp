#include "server/store/postgres/format_6.h"

#include <set>
#include <unordered_map>

#include "common/base/log.h"
#include "server/store/migration.h"
#include "server/store/old_rows.h"
#include "server/store/postgres/commit_batch.h"
#include "server/store/postgres/format_7.h"
#include "server/store/postgres/schema.h"
#include "server/store/postgres/summary.h"

namespace lightmill::postgres {
namespace {

namespace old = stored::old;

/// A packed scene has up to 16 MiB.
constexpr std::int64_t kSettingsOfFormat6AtOnce = 8;
constexpr std::int64_t kResultsOfFormat6AtOnce = 10'000;

using JobsById = std::unordered_map<std::uint64_t, StoredState::StoredJob*>;

Status load_jobs_of_format_6(Session& session, StoredState& state, old::JobCheck& check) {
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
    job.state = check.sound(job.id, old::state_named(text()));
    job.reason = text();
    job.reached = check.sound(job.id, old::limit_named(text()));
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

void read_settings_of_format_6(const Rows& rows, int row, JobRecord& record, old::JobCheck& check) {
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
  notes.reasons = old::lines_in(rows.view(row, column++));
  notes.notices = old::lines_in(rows.view(row, column++));
  notes.candidates = old::lines_in(rows.view(row, column++));
  record.allocation = check.sound(record.id, old::allocation_in(rows.view(row, column++), record));
}

Status load_settings_of_format_6(Session& session, const JobsById& jobs, old::JobCheck& check) {
  std::set<std::uint64_t> found;
  for (std::int64_t last = INT64_MIN;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query("SELECT job, scene, width, height, crop_x, crop_y, crop_width, crop_height, seed, max_bounces, "
                      "renderer_version, meters, method, method_chosen, method_reasons, method_notices, "
                      "method_candidates, allocation FROM job_settings WHERE job > $1 ORDER BY job LIMIT $2",
                      Parameters(last, kSettingsOfFormat6AtOnce)));
    for (int row = 0; row < rows.size(); ++row) {
      last = rows.integer(row, 0);
      const std::uint64_t id = rows.natural(row, 0);
      read_settings_of_format_6(rows, row, jobs.at(id)->record, check);
      found.insert(id);
    }
    if (rows.size() < kSettingsOfFormat6AtOnce) {
      break;
    }
  }
  for (const auto& [id, job] : jobs) {
    if (!found.contains(id)) {
      check.mark_damaged(job->record.id, data_loss("it has no settings"));
    }
  }
  return ok_status();
}

Status load_lists_of_format_6(Session& session, const JobsById& jobs, old::JobCheck& check) {
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
    const LayerKind kind = check.sound(JobId{job}, old::layer_kind_named(layers.view(row, 3), job));
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

Status load_results_of_format_6(Session& session, StoredState::StoredJob& job, StoredState& state,
                                stored::RendererTable& renderers) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  std::int64_t tile = kLeast, level = kLeast, index = kLeast;
  for (;;) {
    LM_ASSIGN_OR_RETURN(
        const Rows rows,
        session.query(
            "SELECT tile, level, range_index, hash, worker, machine, verification, fingerprint_class, checksum FROM "
            "results "
            "WHERE job = $1 AND (tile, level, range_index) > ($2, $3, $4) ORDER BY tile, level, range_index LIMIT $5",
            Parameters(job.record.id.value, tile, level, index, kResultsOfFormat6AtOnce)));
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
          rows.integer(row, 8) != old::checksum_of(key, *hash, by)) {
        state.damaged_results.push_back({key.job, tile, level, index});
        continue;
      }
      job.results.push_back({key.tile, key.range, *hash, renderers.index_of(std::move(by)), rows.integer(row, 6) == 1});
    }
    if (rows.size() < kResultsOfFormat6AtOnce) {
      return ok_status();
    }
  }
}

Status load_quarantine_of_format_6(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT worker, machine, reason, since_unix_ms FROM quarantine ORDER BY worker"));
  for (int row = 0; row < rows.size(); ++row) {
    state.quarantine.push_back({{rows.text(row, 0), rows.text(row, 1)}, rows.text(row, 2), rows.integer(row, 3)});
  }
  return ok_status();
}

Status load_tokens_of_format_6(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const Rows rows, session.query("SELECT id, name, roles, hash, made_by, made_unix_s, until_unix_s "
                                                     "FROM tokens ORDER BY id"));
  for (int row = 0; row < rows.size(); ++row) {
    TokenRecord token;
    token.id = rows.text(row, 0);
    token.name = rows.text(row, 1);
    const Result<Roles> roles = old::roles_in(rows.view(row, 2), token.id);
    const Result<Sha256> hash = stored::digest_in(rows.view(row, 3), "its hash");
    if (!roles.ok() || !hash.ok()) {
      old::leave_out("token " + token.id, roles.ok() ? hash.status() : roles.status(), state);
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

Status load_actions_of_format_6(Session& session, StoredState& state) {
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT number, unix_ms, who, proof, token, peer, what, job, about, "
                                    "outcome, message FROM actions ORDER BY number"));
  for (int row = 0; row < rows.size(); ++row) {
    Action action;
    int column = 0;
    action.number = rows.natural(row, column++);
    action.unix_ms = rows.integer(row, column++);
    action.caller = rows.text(row, column++);
    const Result<Proof> proof = old::proof_named(rows.view(row, column++));
    if (!proof.ok()) {
      old::leave_out(fmt::format("entry {} of the log", action.number), proof.status(), state);
      continue;
    }
    action.proof = *proof;
    action.token = rows.text(row, column++);
    action.peer = rows.text(row, column++);
    action.operation = rows.text(row, column++);
    action.job = rows.natural(row, column++);
    action.about = rows.text(row, column++);
    action.outcome = static_cast<StatusCode>(rows.integer(row, column++));
    action.message = rows.text(row, column++);
    state.actions.push_back(std::move(action));
  }
  return ok_status();
}

/// Reads all but nodes, which the database copies itself.
Result<StoredState> load_format_6(Session& session) {
  StoredState state;
  old::JobCheck check;
  LM_RETURN_IF_ERROR(load_jobs_of_format_6(session, state, check));
  JobsById jobs;
  for (StoredState::StoredJob& job : state.jobs) {
    jobs.emplace(job.record.id.value, &job);
  }
  LM_RETURN_IF_ERROR(load_settings_of_format_6(session, jobs, check));
  LM_RETURN_IF_ERROR(load_lists_of_format_6(session, jobs, check));
  check.finish(state);
  stored::RendererTable renderers;
  for (StoredState::StoredJob& job : state.jobs) {
    LM_RETURN_IF_ERROR(load_results_of_format_6(session, job, state, renderers));
  }
  state.renderers = renderers.take();
  LM_RETURN_IF_ERROR(load_quarantine_of_format_6(session, state));
  LM_RETURN_IF_ERROR(load_tokens_of_format_6(session, state));
  LM_RETURN_IF_ERROR(load_actions_of_format_6(session, state));
  return state;
}

/// A store that writes in the caller's transaction.
class InTransaction final : public Store {
 public:
  explicit InTransaction(Session& session) : session_(session) {}
  Result<StoredState> load() override { return internal_error("a store that is being created cannot be read"); }
  Result<FilmPiece> read_film(JobId, const FilmPosition&) override { return load().status(); }
  Status check_structure() override { return ok_status(); }
  Status commit(std::span<const StoreOp> ops) override {
    LM_RETURN_IF_ERROR(send_writes(session_, ops, specs_, keys_));
    specs_.keep();
    keys_.keep();
    return ok_status();
  }
  const stored::RowKeys& keys() const { return keys_; }

 private:
  Session& session_;
  stored::StoredSpecs specs_;
  stored::RowKeys keys_;
};

constexpr const char* kBeginMigration = "BEGIN; SELECT pg_advisory_xact_lock(x'4c4d494c'::int)";
constexpr const char* kMove = "ALTER SCHEMA lightmill RENAME TO lightmill_format_6; CREATE SCHEMA lightmill";
constexpr const char* kCopy = R"sql(
UPDATE turn SET epoch = before.epoch, highest_job = before.highest_job FROM lightmill_format_6.turn AS before;
DELETE FROM audit_secret;
INSERT INTO audit_secret SELECT secret, sha256(secret) FROM lightmill_format_6.verification_secret;
INSERT INTO assets OVERRIDING SYSTEM VALUE SELECT * FROM lightmill_format_6.assets;
INSERT INTO asset_pieces SELECT * FROM lightmill_format_6.asset_pieces;
SELECT setval(pg_get_serial_sequence('assets', 'id'), (SELECT coalesce(max(id), 0) + 1 FROM assets));
INSERT INTO nodes SELECT * FROM lightmill_format_6.nodes WHERE job IN (SELECT id FROM jobs);
)sql";

Status migrate(Session& session) {
  LM_RETURN_IF_ERROR(session.execute(kBeginMigration));
  LM_ASSIGN_OR_RETURN(const Rows format, session.query("SELECT format FROM meta"));
  if (format.integer(0, 0) != kFormatBefore) {
    return session.execute("ROLLBACK");  // another coordinator has migrated it
  }
  LM_RETURN_IF_ERROR(check_idle(session));
  LM_ASSIGN_OR_RETURN(const StoredState state, load_format_6(session));
  LM_RETURN_IF_ERROR(session.execute(kMove));
  LM_RETURN_IF_ERROR(session.execute(kSchema));
  LM_RETURN_IF_ERROR(session.execute(kSummaryTable));
  InTransaction store(session);
  LM_RETURN_IF_ERROR(write_state(state, store));
  LM_RETURN_IF_ERROR(session.execute(kCopy));
  LM_RETURN_IF_ERROR(create_summary(session, store.keys().sums()));
  return session.execute("COMMIT");
}

}  // namespace

Status migrate_from_format_6(Session& session) {
  spdlog::info("{} has store format {}; converting its tables to format {}", session.place(), kFormatBefore, kFormat);
  if (const Status status = migrate(session); !status.ok()) {
    session.close();  // this ends the transaction
    return status;
  }
  spdlog::info(
      "the tables of format {} are kept in the schema lightmill_format_6, in case you return to an older "
      "lightmill-server. DROP SCHEMA lightmill_format_6 CASCADE frees their space",
      kFormatBefore);
  return ok_status();
}

}  // namespace lightmill::postgres
