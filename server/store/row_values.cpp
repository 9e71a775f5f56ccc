#include "server/store/row_values.h"

#include <cstring>

#include "common/base/log.h"

namespace lightmill::stored {

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
  const bool sound = std::ranges::any_of(std::array{at_place(key.job, key.tile, plain), plain}, [&](const auto& each) {
    const std::array<std::uint8_t, 16> bytes = bytes_of(each);
    return hash == std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  });
  return sound ? node : nullptr;
}

std::size_t take_node(JobId job, const FilmPosition& position, std::uint64_t non_finite, std::string_view hash,
                      std::string_view values, FilmPiece& piece) {
  const TileId tile{static_cast<std::uint32_t>(position.tile)};
  const SampleRange range{static_cast<std::uint32_t>(position.level), static_cast<std::uint32_t>(position.index)};
  if (std::shared_ptr<const Node> node = node_of({job, tile, range}, non_finite, hash, values)) {
    piece.nodes.emplace_back(tile, std::move(node));
  } else {
    log_damage({job, tile, range});
  }
  return values.size();
}

void log_damage(const NodeKey& key) {
  const SampleRange& range = key.range;
  const bool sound = range.level <= kMaxRangeLevel;  // otherwise its sample numbers are unknown
  spdlog::error("job {}: stored samples {} of tile {} are damaged; they will be rendered again", key.job.value,
                sound ? fmt::format("[{}, {})", range.first(), range.end())
                      : fmt::format("number {} of level {}", range.index, range.level),
                key.tile.value);
}

}  // namespace lightmill::stored
