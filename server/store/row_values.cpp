#include "server/store/row_values.h"

#include <cstring>
#include <optional>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/text.h"
#include "common/farm/film_rules.h"

namespace lightmill::stored {
namespace {

/// What a row holds, one after the other: numbers as 8 bytes, texts and bytes with their lengths before them.
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
  /// SQLite keeps whole numbers as such, and gives 0 for -0.
  void put(double number) { put(std::bit_cast<std::uint64_t>(number + 0.0)); }
  void put(ByteView bytes) {
    put(std::uint64_t{bytes.size()});
    hasher_.append(bytes);
  }
  /// As the one of the stores writes it that takes least.
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

}  // namespace

std::string_view name_of(JobState state) {
  return name_in(kStateNames, state);
}

std::string_view name_of(GoalLimit limit) {
  return name_in(kLimitNames, limit);
}

std::string_view name_of(LayerKind kind) {
  return name_in(kLayerKinds, kind);
}

std::string_view name_of(Proof proof) {
  return name_in(kProofNames, proof);
}

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
  if (const Status status = check_crop(job.spec.settings); !status.ok()) {
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

std::string lines_of(std::span<const std::string> texts) {
  std::string lines;
  for (const std::string& text : texts) {
    lines += text;
    std::replace(lines.end() - static_cast<std::ptrdiff_t>(text.size()), lines.end(), '\n', ' ');
    lines += '\n';
  }
  return lines;
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

Result<Sha256> digest_in(std::string_view bytes, std::string_view what) {
  Sha256 digest;
  if (bytes.size() != digest.bytes.size()) {
    return data_loss("{} has {} bytes in the store, not 32", what, bytes.size());
  }
  std::memcpy(digest.bytes.data(), bytes.data(), bytes.size());
  return digest;
}

std::array<std::uint8_t, 16> bytes_of(const Hash128& hash) {
  std::array<std::uint8_t, 16> bytes;
  for (int i = 0; i < 8; ++i) {
    bytes[i] = static_cast<std::uint8_t>(hash.high >> (56 - 8 * i));
    bytes[8 + i] = static_cast<std::uint8_t>(hash.low >> (56 - 8 * i));
  }
  return bytes;
}

Result<Hash128> hash_in(std::string_view bytes) {
  if (bytes.size() != 16) {
    return data_loss("a result's hash has {} bytes in the store, not 16", bytes.size());
  }
  Hash128 hash;
  for (int i = 0; i < 8; ++i) {
    hash.high = hash.high << 8 | static_cast<std::uint8_t>(bytes[i]);
    hash.low = hash.low << 8 | static_cast<std::uint8_t>(bytes[8 + i]);
  }
  return hash;
}

Hash128 checksum_of(const JobRecord& job) {
  const JobSpec& spec = job.spec;
  const RenderSettings& settings = spec.settings;
  const MethodNotes& notes = job.method_notes;
  RowHasher row;
  row.add(job.id.value, spec.request_id, spec.name, spec.owner, spec.host, spec.parent.value, number(spec.priority),
          spec.verify_share, number(spec.allow_mixed), spec.goal.samples, spec.goal.seconds, spec.goal.error,
          number(spec.goal.adaptive), name_of(job.state), job.reason, name_of(job.reached), job.fingerprint_class,
          number(job.submitted_unix_ms), number(job.finished_unix_ms));
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
    row.add(layer.name, number(layer.channels), name_of(layer.kind));
  }
  return row.finish();
}

std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by) {
  RowHasher row;
  row.add(key.job.value, number(key.tile.value), number(key.range.level), number(key.range.index), hash.high, hash.low,
          by.worker, by.machine, by.fingerprint_class);
  const auto checksum = static_cast<std::int64_t>(row.finish().low);
  return checksum == 0 ? 1 : checksum;
}

void JobCheck::finish(StoredState& state) {
  for (const StoredState::StoredJob& job : state.jobs) {
    const JobId id = job.record.id;
    const std::string& expected = expected_[id];
    const std::array<std::uint8_t, 16> actual = bytes_of(checksum_of(job.record));
    if (expected.empty()) {
      condemn(id, data_loss("its checksum is missing"));
    } else if (expected != std::string_view(reinterpret_cast<const char*>(actual.data()), actual.size())) {
      condemn(id, data_loss("its checksum is another one"));
    }
  }
  for (const auto& [job, why] : damaged_) {
    spdlog::error("job {} is left out: what is stored of it is not what was written: {}", job.value, why);
    state.damaged_jobs.push_back(job);
  }
  std::erase_if(state.jobs, [&](const auto& job) { return damaged_.contains(job.record.id); });
}

void leave_out_token(const std::string& id, const Status& why, StoredState& state, std::vector<StoreOp>& repairs) {
  // What its id is made of may be damaged, too.
  state.damaged_entries.push_back(
      fmt::format("token {} lets nobody in any more: {}", printable(id, true), message_of(why)));
  spdlog::error("{}", state.damaged_entries.back());
  repairs.push_back(DropToken{id});
}

void leave_out_action(std::uint64_t number, const Status& why, StoredState& state, std::vector<StoreOp>& repairs) {
  state.damaged_entries.push_back(fmt::format("entry {} of the log is taken out: {}", number, message_of(why)));
  spdlog::error("{}", state.damaged_entries.back());
  repairs.push_back(DropAction{number});
}

bool is_key(std::int64_t tile, std::int64_t level, std::int64_t index) {
  constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
  return std::ranges::all_of(std::array{tile, level, index}, [](std::int64_t n) { return n >= 0 && n <= kMost; });
}

void leave_out_result(const DropResultRow& row, StoredState& state, std::vector<StoreOp>& repairs) {
  spdlog::error("job {}: the record of who rendered a result of tile {} is damaged", row.job.value, row.tile);
  state.damaged_results.push_back(row);
  repairs.push_back(row);
}

std::uint32_t RendererTable::index_of(Renderer renderer) {
  const auto [at, fresh] = indices_.try_emplace(renderer, static_cast<std::uint32_t>(renderers_.size()));
  if (fresh) {
    renderers_.push_back(std::move(renderer));
  }
  return at->second;
}

std::shared_ptr<const Node> node_of(const SampleRange& range, std::uint64_t non_finite, std::string_view hash,
                                    std::string_view values) {
  auto node = std::make_shared<Node>();
  node->range = range;
  node->non_finite = non_finite;
  node->values.resize(values.size() / sizeof(float));
  if (!node->values.empty()) {  // memcpy takes no null
    std::memcpy(node->values.data(), values.data(), node->values.size() * sizeof(float));
  }
  const std::array<std::uint8_t, 16> expected = bytes_of(hash_of(*node));
  const bool sound = hash == std::string_view(reinterpret_cast<const char*>(expected.data()), expected.size());
  return sound ? node : nullptr;
}

void log_damage(const NodeKey& key) {
  const SampleRange& range = key.range;
  const bool sound = range.level <= kMaxRangeLevel;  // else it has no samples that could be named
  spdlog::error("job {}: stored samples {} of tile {} are damaged; they will be rendered again", key.job.value,
                sound ? fmt::format("[{}, {})", range.first(), range.end())
                      : fmt::format("number {} of level {}", range.index, range.level),
                key.tile.value);
}

}  // namespace lightmill::stored
