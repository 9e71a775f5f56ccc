// Conversion of nodes and results to rows and back. The small rows are in server/store/records.h.
#pragma once

#include <array>
#include <bit>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/farm/messages.h"
#include "common/film/node.h"
#include "common/wire/bytes.h"
#include "server/store/row_source.h"
#include "server/store/store.h"

namespace lightmill::stored {

static_assert(std::endian::native == std::endian::little, "sums are stored as little-endian float32");

/// A digest from its bytes. DATA_LOSS unless there are 32.
Result<Sha256> digest_in(std::string_view bytes, std::string_view what);

/// A hash from the output of hash_bytes(). DATA_LOSS unless there are 16 bytes.
Result<Hash128> hash_in(std::string_view bytes);

/// Whether another worker has to render a result again, or has done so.
enum class Audit : int { none = 0, wanted = 1, passed = 2 };
/// Checksum of a result's row. Its two lowest bits are `audit`, so a change from wanted to passed changes only these
/// bits.
std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by, Audit audit);
inline constexpr std::int64_t kAuditBits = 3;
/// Whether the number is an Audit. The checksum of a row with another number may be right by chance.
constexpr bool is_audit(std::int64_t number) {
  return number >= static_cast<int>(Audit::none) && number <= static_cast<int>(Audit::passed);
}

/// The position in three columns from `column` on.
inline FilmPosition place_in(const Row& row, int column) {
  return {row.integer(column), row.integer(column + 1), row.integer(column + 2)};
}
/// Whether these numbers form a valid NodeKey.
bool is_key(const FilmPosition& position);
NodeKey key_of(JobId job, const FilmPosition& position);
/// Allocation of a job, one byte per tile. DATA_LOSS if the number of tiles differs or a share is invalid.
Result<Allocation> allocation_in(std::string_view shares, const RenderSettings& settings);
/// Drops a damaged row of a result with `repairs`. remove_invalid_rows() later drops the node that contains it, because
/// the origin of its samples is unknown. If a worker enters quarantine later, the farm could not tell which samples to
/// drop.
void leave_out_result(const DropResultRow& row, StoredState& state, std::vector<StoreOp>& repairs);

/// Table of the renderers of results, numbered from 0.
class RendererTable {
 public:
  std::uint32_t index_of(Renderer renderer);
  std::vector<Renderer> take() { return std::move(renderers_); }

 private:
  std::vector<Renderer> renderers_;
  std::map<Renderer, std::uint32_t> indices_;
};

/// Hash in the row of a node: hash_of(node), combined with the job and the tile. So a row in the place of another one
/// is damaged, too.
Hash128 row_hash_of(JobId job, TileId tile, const Node& node);
/// The node of a row. Null if it does not match its stored `hash`: row_hash_of(), or hash_of() in rows of earlier
/// formats.
std::shared_ptr<const Node> node_of(const NodeKey& key, std::uint64_t non_finite, std::string_view hash,
                                    std::string_view values);
/// Logs what is lost.
void log_damage(const NodeKey& key);

/// Bytes of a film that are read at a time. A commit waits for one such read at most.
inline constexpr std::size_t kFilmPieceBytes = std::size_t{16} << 20;
/// Adds the node of a row to `piece`, unless it is damaged. Returns the size of its values in bytes.
std::size_t take_node(JobId job, const FilmPosition& position, std::uint64_t non_finite, std::string_view hash,
                      std::string_view values, FilmPiece& piece);

/// The bytes of an array of numbers.
template <class T>
ByteView view_of(const T& container) {
  return std::as_bytes(std::span(container));
}

}  // namespace lightmill::stored
