// How nodes and results stand in rows. The small rows are in server/store/records.h.
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
#include "server/store/store.h"

namespace lightmill::stored {

static_assert(std::endian::native == std::endian::little, "sums are stored as little-endian float32");

/// The bytes of a digest; DATA_LOSS unless there are 32.
Result<Sha256> digest_in(std::string_view bytes, std::string_view what);

/// Of stored bytes_of; DATA_LOSS unless there are 16.
Result<Hash128> hash_in(std::string_view bytes);

/// Whether a result is to be rendered again by another worker.
enum class Audit : int { none = 0, wanted = 1, passed = 2 };
/// Of a result's row. Its two lowest bits are `audit`, so that the change from wanted to passed needs no other value.
std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by, Audit audit);
inline constexpr std::int64_t kAuditBits = 3;

/// Whether a NodeKey can have these numbers.
bool is_key(std::int64_t tile, std::int64_t level, std::int64_t index);
/// A result's row that is damaged: it goes with `repairs`. The node that it went into does so later, as one of which
/// not all is known (take_out_nonsense): if somebody is found to have rendered wrong, nobody could tell whether it was
/// theirs.
void leave_out_result(const DropResultRow& row, StoredState& state, std::vector<StoreOp>& repairs);

/// Gives everybody who rendered something a number, from 0 on.
class RendererTable {
 public:
  std::uint32_t index_of(Renderer renderer);
  std::vector<Renderer> take() { return std::move(renderers_); }

 private:
  std::vector<Renderer> renderers_;
  std::map<Renderer, std::uint32_t> indices_;
};

/// High word first, each with its highest byte first.
std::array<std::uint8_t, 16> bytes_of(const Hash128& hash);

/// The node of a row; null if `hash`, its stored hash_of, shows that it is damaged.
std::shared_ptr<const Node> node_of(const SampleRange& range, std::uint64_t non_finite, std::string_view hash,
                                    std::string_view values);
/// Says in the log what is lost.
void log_damage(const NodeKey& key);

/// So much of a film is read at once: commits wait for no more.
inline constexpr std::size_t kFilmPieceBytes = std::size_t{16} << 20;
/// Adds the node of a row to `piece`, unless it is damaged. Returns the bytes of its values.
std::size_t take_node(JobId job, const FilmPlace& place, std::uint64_t non_finite, std::string_view hash,
                      std::string_view values, FilmPiece& piece);
/// Puts the values of its nodes into a job that goes on; `read` gives them as Store::read_film does. What is damaged
/// goes with `repairs`.
template <class Read>
Status load_values(StoredState::StoredJob& job, StoredState& state, std::vector<StoreOp>& repairs, const Read& read) {
  std::set<std::pair<TileId, SampleRange>> lost;
  for (const StoredState::StoredNode& node : job.nodes) {
    lost.emplace(node.tile, node.outline.range);
  }
  job.nodes.clear();
  for (std::optional<FilmPlace> last = FilmPlace{}; last;) {
    LM_ASSIGN_OR_RETURN(FilmPiece piece, read(job.record.id, *last));
    for (StoredState::StoredNode& node : piece.nodes) {
      lost.erase({node.tile, node.outline.range});
      job.nodes.push_back(std::move(node));
    }
    last = piece.last;
  }
  for (const auto& [tile, range] : lost) {
    state.damaged.push_back({job.record.id, tile, range});
    repairs.push_back(DropNode{state.damaged.back()});
  }
  return ok_status();
}

/// The bytes of an array of numbers.
template <class T>
ByteView view_of(const T& container) {
  return std::as_bytes(std::span(container));
}

}  // namespace lightmill::stored
