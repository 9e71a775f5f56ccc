#include "server/store/row_values.h"

#include <algorithm>
#include <cstring>

#include "common/base/log.h"
#include "common/farm/job_rules.h"

namespace lightmill::stored {

Result<Sha256> digest_in(std::string_view bytes, std::string_view what) {
  const Result<Sha256> digest = digest_from_bytes(bytes);
  return digest.ok() ? digest : data_loss("{} has {} bytes in the store, not 32", what, bytes.size());
}

Result<Hash128> hash_in(std::string_view bytes) {
  const Result<Hash128> hash = hash_from_bytes(bytes);
  return hash.ok() ? hash : data_loss("a result's hash has {} bytes in the store, not 16", bytes.size());
}

std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by, Audit audit) {
  const std::array<std::uint64_t, 9> numbers{key.job.value,    key.tile.value,     key.range.level,
                                             key.range.index,  hash.high,          hash.low,
                                             by.worker.size(), by.identity.size(), by.fingerprint_class.size()};
  Xxh3Hasher hasher;
  hasher.append(view_of(numbers));
  for (const std::string* text : {&by.worker, &by.identity, &by.fingerprint_class}) {
    hasher.append(as_byte_view(*text));
  }
  return (static_cast<std::int64_t>(hasher.finish().low) & ~kAuditBits) | static_cast<std::int64_t>(audit);
}

bool is_key(const FilmPosition& position) {
  constexpr std::int64_t kMax = std::numeric_limits<std::uint32_t>::max();
  return std::ranges::all_of(std::array{position.tile, position.level, position.index},
                             [](std::int64_t n) { return n >= 0 && n <= kMax; });
}

NodeKey key_of(JobId job, const FilmPosition& position) {
  return {job,
          TileId{static_cast<std::uint32_t>(position.tile)},
          {static_cast<std::uint32_t>(position.level), static_cast<std::uint32_t>(position.index)}};
}

Result<Allocation> allocation_in(std::string_view shares, const RenderSettings& settings) {
  LM_RETURN_IF_ERROR(check_grid(settings));
  if (const std::uint64_t tiles = grid_of(settings).tile_count(); !shares.empty() && shares.size() != tiles) {
    return data_loss("its allocation has {} tiles, not {}", shares.size(), tiles);
  }
  return Allocation::of({shares.begin(), shares.end()});
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

namespace {

Hash128 at_place(JobId job, TileId tile, Hash128 hash) {
  const std::array<std::uint64_t, 4> numbers{job.value, tile.value, hash.high, hash.low};
  return xxh3_128(view_of(numbers));
}

}  // namespace

Hash128 row_hash_of(JobId job, TileId tile, const Node& node) {
  return at_place(job, tile, hash_of(node));
}

std::shared_ptr<const Node> node_of(const NodeKey& key, std::uint64_t non_finite, std::string_view hash,
                                    std::string_view values) {
  auto node = std::make_shared<Node>();
  node->range = key.range;
  node->non_finite = non_finite;
  node->values.resize(values.size() / sizeof(float));
  if (!node->values.empty()) {  // memcpy does not accept null
    std::memcpy(node->values.data(), values.data(), node->values.size() * sizeof(float));
  }
  const Hash128 plain = hash_of(*node);
  return hash == hash_bytes(at_place(key.job, key.tile, plain)) || hash == hash_bytes(plain) ? node : nullptr;
}

std::size_t take_node(JobId job, const FilmPosition& position, std::uint64_t non_finite, std::string_view hash,
                      std::string_view values, FilmPiece& piece) {
  const NodeKey key = key_of(job, position);
  if (std::shared_ptr<const Node> node = node_of(key, non_finite, hash, values)) {
    piece.nodes.emplace_back(key.tile, std::move(node));
  } else {
    log_damage(key);
  }
  return values.size();
}

void log_damage(const NodeKey& key) {
  const SampleRange& range = key.range;
  const bool sound = range.level <= kMaxRangeLevel;  // otherwise its sample numbers are unknown
  spdlog::error("job {}: stored samples {} of tile {} are damaged. They will be rendered again", key.job.value,
                sound ? fmt::format("[{}, {})", range.first(), range.end())
                      : fmt::format("number {} of level {}", range.index, range.level),
                key.tile.value);
}

}  // namespace lightmill::stored
