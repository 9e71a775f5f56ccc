#include "server/store/old_rows.h"

#include "common/base/log.h"
#include "common/base/text.h"
#include "common/wire/enum_table.h"
#include "server/store/load_state.h"

namespace lightmill::stored {
namespace {

/// Hash of a row's values in order. Numbers are 8 bytes; texts and bytes follow their lengths.
class RowHasher {
 public:
  template <class... Values>
  RowHasher& add(const Values&... values) {
    (put(values), ...);
    return *this;
  }
  Hash128 finish() const { return hasher_.finish(); }

 private:
  void put(std::uint64_t number) { hasher_.append(std::as_bytes(std::span(&number, 1))); }
  /// SQLite stores whole numbers as integers, and gives 0 for -0.
  void put(double number) { put(std::bit_cast<std::uint64_t>(number + 0.0)); }
  void put(ByteView bytes) {
    put(std::uint64_t{bytes.size()});
    hasher_.append(bytes);
  }
  /// In PostgreSQL's form, whose texts allow the fewest characters.
  void put(std::string_view text) { put(as_byte_view(printable(text, true))); }

  Xxh3Hasher hasher_;
};

constexpr EnumTable<JobState, std::string_view, 6> kStateNames{{{JobState::queued, "queued"},
                                                                {JobState::running, "running"},
                                                                {JobState::paused, "paused"},
                                                                {JobState::done, "done"},
                                                                {JobState::failed, "failed"},
                                                                {JobState::cancelled, "cancelled"}}};
constexpr EnumTable<GoalLimit, std::string_view, 4> kLimitNames{{{GoalLimit::none, ""},
                                                                 {GoalLimit::samples, "samples"},
                                                                 {GoalLimit::seconds, "seconds"},
                                                                 {GoalLimit::error, "error"}}};
constexpr EnumTable<LayerKind, std::string_view, 4> kLayerKinds{{{LayerKind::summed, "summed"},
                                                                 {LayerKind::first_mean, "first_mean"},
                                                                 {LayerKind::first_nearest, "first_nearest"},
                                                                 {LayerKind::first_samples, "first_samples"}}};

constexpr EnumTable<Proof, std::string_view, 3> kProofNames{
    {{Proof::none, ""}, {Proof::certificate, "certificate"}, {Proof::token, "token"}}};

template <class Number>
std::uint64_t number(Number value) {
  return static_cast<std::uint64_t>(value);
}

std::string lines_of(std::span<const std::string> texts) {
  std::string lines;
  for (const std::string& text : texts) {
    lines += text;
    std::replace(lines.end() - static_cast<std::ptrdiff_t>(text.size()), lines.end(), '\n', ' ');
    lines += '\n';
  }
  return lines;
}

Hash128 checksum_of(const JobRecord& job) {
  const JobSpec& spec = job.spec;
  const RenderSettings& settings = spec.settings;
  const MethodNotes& notes = job.method_notes;
  RowHasher row;
  row.add(job.id.value, spec.request_id, spec.name, spec.owner, spec.host, spec.parent.value, number(spec.priority),
          spec.audit_share, number(spec.allow_mixed), spec.goal.samples, spec.goal.seconds, spec.goal.error,
          number(spec.goal.adaptive), code_of(kStateNames, job.state), job.reason, code_of(kLimitNames, job.reached),
          job.fingerprint_class, number(job.submitted_unix_ms), number(job.finished_unix_ms));
  row.add(as_byte_view(*settings.scene), number(settings.width), number(settings.height), number(settings.crop.x),
          number(settings.crop.y), number(settings.crop.width), number(settings.crop.height), settings.seed,
          settings.method, number(settings.max_bounces), settings.renderer_version, number(settings.meters),
          number(notes.chosen), lines_of(notes.reasons), lines_of(notes.notices), lines_of(notes.candidates),
          std::as_bytes(job.allocation.shifts()));
  row.add(number(settings.assets->size()));
  for (const Sha256& asset : *settings.assets) {
    row.add(view_of(asset.bytes));
  }
  row.add(number(settings.layers.size()));
  for (const LayerSpec& layer : settings.layers) {
    row.add(layer.name, number(layer.channels), code_of(kLayerKinds, layer.kind));
  }
  return row.finish();
}

/// Texts, one per line.
std::vector<std::string> lines_in(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

/// Whether the checksum of a result's row is right. It does not cover the audit state.
bool is_sound_result(const NodeKey& key, const Hash128& hash, const Renderer& by, std::int64_t /*audit*/,
                     std::int64_t checksum) {
  RowHasher row;
  row.add(key.job.value, number(key.tile.value), number(key.range.level), number(key.range.index), hash.high, hash.low,
          by.worker, by.identity, by.fingerprint_class);
  const auto right = static_cast<std::int64_t>(row.finish().low);
  return checksum == (right == 0 ? 1 : right);
}

class OldRows {
 public:
  OldRows(RowSource& rows, StoredState& state) : rows_(rows), state_(state) {}
  Status load();

 private:
  Status load_jobs();
  Status load_settings(JobRecord& job);
  Status load_lists(JobRecord& job);
  Status load_results(StoredState::StoredJob& job, RendererTable& renderers);
  Status load_quarantine();
  Status load_tokens();
  Status load_actions();
  /// Returns the value. A row without a valid value makes its job damaged.
  template <class T>
  T sound(JobId job, Result<T> value) {
    if (!value.ok()) {
      mark_damaged(job, value.status());
    }
    return value.ok() ? *std::move(value) : T{};
  }
  void mark_damaged(JobId job, const Status& why) { damaged_.try_emplace(job, message_of(why)); }
  /// Moves damaged jobs from `jobs` to `damaged_jobs`, and logs them. A job without a checksum is damaged.
  void remove_damaged_jobs();
  /// Records a token, or an entry of the action log, that cannot be read.
  void leave_out(std::string_view what, const Status& why);

  RowSource& rows_;
  StoredState& state_;
  std::map<JobId, std::string> expected_;  ///< checksums
  std::map<JobId, std::string> damaged_;   ///< with the reason
};

Status OldRows::load_jobs() {
  return rows_.for_each(
      "SELECT id, request_id, name, owner, host, parent, priority, goal_samples, goal_seconds, goal_error, "
      "goal_adaptive, state, reason, reached, fingerprint_class, active_seconds, worker_seconds, results_merged, "
      "results_duplicate, leases_lost, copies_leased, non_finite, submitted_unix_ms, finished_unix_ms, verify_share, "
      "results_verified, nodes_dropped, allow_mixed, checksum FROM jobs ORDER BY id",
      [&](const Row& row) {
        JobRecord job;
        JobSpec& spec = job.spec;
        JobCounters& counters = job.counters;
        std::string state, reached, checksum;
        read_columns(row, job.id.value, spec.request_id, spec.name, spec.owner, spec.host, spec.parent.value,
                     spec.priority, spec.goal.samples, spec.goal.seconds, spec.goal.error, spec.goal.adaptive, state,
                     job.reason, reached, job.fingerprint_class, job.active_seconds, job.worker_seconds,
                     counters.results_merged, counters.results_duplicate, counters.leases_lost, counters.copies_leased,
                     counters.non_finite, job.submitted_unix_ms, job.finished_unix_ms, spec.audit_share,
                     counters.results_audited, counters.nodes_dropped, spec.allow_mixed, checksum);
        job.state = sound(job.id, value_of(kStateNames, state, "state"));
        job.reached = sound(job.id, value_of(kLimitNames, reached, "reached"));
        expected_[job.id] = checksum;
        state_.jobs.push_back({std::move(job), {}});
      });
}

Status OldRows::load_settings(JobRecord& job) {
  bool found = false;
  LM_RETURN_IF_ERROR(rows_.for_each(
      fmt::format("SELECT scene, width, height, crop_x, crop_y, crop_width, crop_height, seed, max_bounces, "
                  "renderer_version, meters, method, method_chosen, method_reasons, method_notices, method_candidates, "
                  "allocation FROM job_settings WHERE job = {}",
                  job.id.value),
      [&](const Row& row) {
        RenderSettings& settings = job.spec.settings;
        PixelRect& crop = settings.crop;
        MethodNotes& notes = job.method_notes;
        std::string scene, reasons, notices, candidates, shares;
        read_columns(row, scene, settings.width, settings.height, crop.x, crop.y, crop.width, crop.height,
                     settings.seed, settings.max_bounces, settings.renderer_version, settings.meters, settings.method,
                     notes.chosen, reasons, notices, candidates, shares);
        settings.scene = std::move(scene);
        notes.reasons = lines_in(reasons);
        notes.notices = lines_in(notices);
        notes.candidates = lines_in(candidates);
        job.allocation = sound(job.id, allocation_in(shares, settings));
        found = true;
      }));
  if (!found) {
    mark_damaged(job.id, data_loss("it has no settings"));
  }
  return ok_status();
}

Status OldRows::load_lists(JobRecord& job) {
  RenderSettings& settings = job.spec.settings;
  const std::uint64_t id = job.id.value;
  std::vector<Sha256> assets;
  LM_RETURN_IF_ERROR(rows_.for_each(
      fmt::format("SELECT digest FROM job_assets WHERE job = {} ORDER BY position", id),
      [&](const Row& row) { assets.push_back(sound(job.id, digest_in(row.view(0), "an asset's digest"))); }));
  settings.assets = std::move(assets);
  settings.layers.clear();
  LM_RETURN_IF_ERROR(
      rows_.for_each(fmt::format("SELECT name, channels, kind FROM job_layers WHERE job = {} ORDER BY position", id),
                     [&](const Row& row) {
                       const LayerKind kind = sound(job.id, value_of(kLayerKinds, row.view(2), "kind of a layer"));
                       settings.layers.push_back({row.text(0), static_cast<std::uint32_t>(row.natural(1)), kind});
                     }));
  return rows_.for_each(
      fmt::format("SELECT samples, worker_seconds, rel_mse, half_width FROM job_errors WHERE job = {} ORDER BY samples",
                  id),
      [&](const Row& row) {
        job.history.push_back({row.real(0), row.real(1), row.real(2), row.real(3)});
      });
}

Status OldRows::load_results(StoredState::StoredJob& job, RendererTable& renderers) {
  const JobId id = job.record.id;
  return rows_.for_each(
      fmt::format("SELECT tile, level, range_index, hash, worker, machine, verification, fingerprint_class, checksum "
                  "FROM results WHERE job = {} ORDER BY tile, level, range_index",
                  id.value),
      [&](const Row& row) {
        if (!take_result(row, job, renderers, is_sound_result)) {
          state_.damaged_results.push_back({id, row.integer(0), row.integer(1), row.integer(2)});
        }
      });
}

Status OldRows::load_quarantine() {
  return rows_.for_each("SELECT worker, machine, reason, since_unix_ms FROM quarantine ORDER BY worker",
                        [&](const Row& row) {
                          QuarantineRecord record;
                          read_columns(row, record.of.worker, record.of.identity, record.reason, record.since_unix_ms);
                          state_.quarantine.push_back(std::move(record));
                        });
}

Status OldRows::load_tokens() {
  return rows_.for_each(
      "SELECT id, name, roles, hash, made_by, made_unix_s, until_unix_s FROM tokens ORDER BY id", [&](const Row& row) {
        TokenRecord token;
        std::string roles, hash;
        read_columns(row, token.id, token.name, roles, hash, token.made_by, token.made_unix_s, token.until_unix_s);
        const Result<Roles> parsed = parse_roles(roles);
        const Result<Sha256> digest = digest_in(hash, "its hash");
        if (!parsed.ok() || !digest.ok()) {
          leave_out("token " + token.id, parsed.ok() ? digest.status() : parsed.status());
          return;
        }
        token.roles = *parsed;
        token.hash = *digest;
        state_.tokens.push_back(std::move(token));
      });
}

Status OldRows::load_actions() {
  return rows_.for_each(
      "SELECT number, unix_ms, who, proof, token, peer, what, job, about, outcome, message FROM actions "
      "ORDER BY number",
      [&](const Row& row) {
        Action action;
        std::string proof;
        read_columns(row, action.number, action.unix_ms, action.caller, proof, action.token, action.peer,
                     action.operation, action.job, action.about, action.outcome, action.message);
        const Result<Proof> known = value_of(kProofNames, proof, "proof");
        if (!known.ok()) {
          leave_out(fmt::format("entry {} of the log", action.number), known.status());
          return;
        }
        action.proof = *known;
        state_.actions.push_back(std::move(action));
      });
}

void OldRows::remove_damaged_jobs() {
  for (const StoredState::StoredJob& job : state_.jobs) {
    const JobId id = job.record.id;
    const std::string& expected = expected_[id];
    if (expected.empty()) {
      mark_damaged(id, data_loss("its checksum is missing"));
    } else if (expected != hash_bytes(checksum_of(job.record))) {
      mark_damaged(id, data_loss("its checksum is wrong"));
    }
  }
  for (const auto& [job, why] : damaged_) {
    spdlog::error("job {} is left out: its stored data is damaged: {}", job.value, why);
    state_.damaged_jobs.push_back(job);
  }
  std::erase_if(state_.jobs, [&](const auto& job) { return damaged_.contains(job.record.id); });
}

void OldRows::leave_out(std::string_view what, const Status& why) {
  state_.damaged_entries.push_back(fmt::format("{}: {}", what, message_of(why)));
  spdlog::error("{}", state_.damaged_entries.back());
}

Status OldRows::load() {
  LM_RETURN_IF_ERROR(load_jobs());
  for (StoredState::StoredJob& job : state_.jobs) {
    LM_RETURN_IF_ERROR(load_settings(job.record));
    LM_RETURN_IF_ERROR(load_lists(job.record));
  }
  remove_damaged_jobs();
  RendererTable renderers;
  for (StoredState::StoredJob& job : state_.jobs) {
    LM_RETURN_IF_ERROR(load_results(job, renderers));
  }
  state_.renderers = renderers.take();
  LM_RETURN_IF_ERROR(load_quarantine());
  LM_RETURN_IF_ERROR(load_tokens());
  return load_actions();
}

}  // namespace

Status load_old_rows(RowSource& rows, StoredState& state) {
  return OldRows(rows, state).load();
}

Status check_old_sums(RowSource& rows, std::string_view sums) {
  std::array<std::uint64_t, kTableCount> found{};
  for (std::size_t i = 0; i < kTableCount; ++i) {
    const TableInfo& info = kTables[i];
    LM_RETURN_IF_ERROR(rows.for_each(fmt::format("SELECT {} FROM {}", info.key, info.name), [&](const Row& row) {
      found[i] ^= static_cast<std::uint64_t>(checksum_of(static_cast<Table>(i), key_in(row, info), {}));
    }));
  }
  for (std::size_t i = 0; i < kTableCount; ++i) {
    if (number_at<std::uint64_t>(as_byte_view(sums), i * sizeof(std::uint64_t)) != found[i]) {
      return failed_precondition("its table {} has lost rows, or still has deleted rows", kTables[i].name);
    }
  }
  return ok_status();
}

}  // namespace lightmill::stored
