#include "server/store/old_rows.h"

#include <optional>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/text.h"
#include "common/farm/job_rules.h"

namespace lightmill::stored::old {
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

constexpr std::array<std::pair<JobState, std::string_view>, 6> kStateNames{{{JobState::queued, "queued"},
                                                                            {JobState::running, "running"},
                                                                            {JobState::paused, "paused"},
                                                                            {JobState::done, "done"},
                                                                            {JobState::failed, "failed"},
                                                                            {JobState::cancelled, "cancelled"}}};
constexpr std::array<std::pair<GoalLimit, std::string_view>, 4> kLimitNames{{{GoalLimit::none, ""},
                                                                             {GoalLimit::samples, "samples"},
                                                                             {GoalLimit::seconds, "seconds"},
                                                                             {GoalLimit::error, "error"}}};
constexpr std::array<std::pair<LayerKind, std::string_view>, 4> kLayerKinds{
    {{LayerKind::summed, "summed"},
     {LayerKind::first_mean, "first_mean"},
     {LayerKind::first_nearest, "first_nearest"},
     {LayerKind::first_samples, "first_samples"}}};

constexpr std::array<std::pair<Proof, std::string_view>, 3> kProofNames{
    {{Proof::none, ""}, {Proof::certificate, "certificate"}, {Proof::token, "token"}}};

template <class Names, class Value>
std::string_view name_in(const Names& names, Value value) {
  for (const auto& [each, name] : names) {
    if (each == value) {
      return name;
    }
  }
  LM_CHECK(false, "value {} has no name", static_cast<int>(value));
}

template <class Value, std::size_t kCount>
std::optional<Value> value_in(const std::array<std::pair<Value, std::string_view>, kCount>& names,
                              std::string_view text) {
  for (const auto& [value, name] : names) {
    if (name == text) {
      return value;
    }
  }
  return std::nullopt;
}

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
          spec.verify_share, number(spec.allow_mixed), spec.goal.samples, spec.goal.seconds, spec.goal.error,
          number(spec.goal.adaptive), name_in(kStateNames, job.state), job.reason, name_in(kLimitNames, job.reached),
          job.fingerprint_class, number(job.submitted_unix_ms), number(job.finished_unix_ms));
  row.add(as_byte_view(settings.scene), number(settings.width), number(settings.height), number(settings.crop.x),
          number(settings.crop.y), number(settings.crop.width), number(settings.crop.height), settings.seed,
          settings.method, number(settings.max_bounces), settings.renderer_version, number(settings.meters),
          number(notes.chosen), lines_of(notes.reasons), lines_of(notes.notices), lines_of(notes.candidates),
          std::as_bytes(job.allocation.shifts()));
  row.add(number(settings.assets.size()));
  for (const Sha256& asset : settings.assets) {
    row.add(view_of(asset.bytes));
  }
  row.add(number(settings.layers.size()));
  for (const LayerSpec& layer : settings.layers) {
    row.add(layer.name, number(layer.channels), name_in(kLayerKinds, layer.kind));
  }
  return row.finish();
}

}  // namespace

Result<JobState> state_named(std::string_view name) {
  if (const auto state = value_in(kStateNames, name)) {
    return *state;
  }
  return data_loss("unknown job state '{}' in the store", name);
}

Result<GoalLimit> limit_named(std::string_view name) {
  if (const auto limit = value_in(kLimitNames, name)) {
    return *limit;
  }
  return data_loss("unknown limit '{}' in the store", name);
}

Result<Proof> proof_named(std::string_view name) {
  if (const auto proof = value_in(kProofNames, name)) {
    return *proof;
  }
  return data_loss("unknown proof '{}' in the store", name);
}

Result<LayerKind> layer_kind_named(std::string_view name, std::uint64_t job) {
  if (const auto kind = value_in(kLayerKinds, name)) {
    return *kind;
  }
  return data_loss("job {} has a layer of unknown kind '{}' in the store", job, name);
}

Result<Allocation> allocation_in(std::string_view bytes, const JobRecord& job) {
  if (const Status status = check_grid(job.spec.settings); !status.ok()) {
    return data_loss("job {}: {}", job.id.value, message_of(status));
  }
  const std::uint64_t tiles = grid_of(job.spec.settings).tile_count();
  if (!bytes.empty() && bytes.size() != tiles) {
    return data_loss("job {}: allocation: {} tiles in the store, not {}", job.id.value, bytes.size(), tiles);
  }
  Result<Allocation> allocation = Allocation::of({bytes.begin(), bytes.end()});
  if (!allocation.ok()) {
    return data_loss("job {}: {}", job.id.value, message_of(allocation.status()));
  }
  return allocation;
}

std::vector<std::string> lines_in(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

Result<Roles> roles_in(std::string_view text, std::string_view token) {
  const Result<Roles> roles = parse_roles(text);
  return roles.ok() ? roles : data_loss("token {}: in the store, {}", token, message_of(roles.status()));
}

std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by) {
  RowHasher row;
  row.add(key.job.value, number(key.tile.value), number(key.range.level), number(key.range.index), hash.high, hash.low,
          by.worker, by.identity, by.fingerprint_class);
  const auto checksum = static_cast<std::int64_t>(row.finish().low);
  return checksum == 0 ? 1 : checksum;
}

void JobCheck::finish(StoredState& state) {
  for (const StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    const std::string& expected = expected_[id];
    const std::array<std::uint8_t, 16> actual = bytes_of(checksum_of(job.record));
    if (expected.empty()) {
      mark_damaged(id, data_loss("its checksum is missing"));
    } else if (expected != std::string_view(reinterpret_cast<const char*>(actual.data()), actual.size())) {
      mark_damaged(id, data_loss("its checksum is wrong"));
    }
  }
  for (const auto& [job, why] : damaged_) {
    spdlog::error("job {} is left out: its stored data is damaged: {}", job.value, why);
    state.damaged_jobs.push_back(job);
  }
  std::erase_if(state.jobs, [&](const auto& job) { return damaged_.contains(job.record.id); });
}

void leave_out(std::string what, const Status& why, StoredState& state) {
  state.damaged_entries.push_back(fmt::format("{}: {}", what, message_of(why)));
  spdlog::error("{}", state.damaged_entries.back());
}

}  // namespace lightmill::stored::old
