// How the domain's values stand in rows: names for what has names, bytes for what is bits.
#pragma once

#include <array>
#include <bit>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/farm/messages.h"
#include "common/film/layers.h"
#include "common/film/node.h"
#include "server/domain/effects.h"

namespace lightmill::stored {

static_assert(std::endian::native == std::endian::little, "sums are stored as little-endian float32");

std::string_view name_of(JobState state);
std::string_view name_of(GoalLimit limit);
std::string_view name_of(LayerKind kind);
std::string_view name_of(Proof proof);

/// DATA_LOSS if no state has this name.
Result<JobState> state_named(std::string_view name);
/// DATA_LOSS if no limit has this name.
Result<GoalLimit> limit_named(std::string_view name);
/// DATA_LOSS if nothing that is shown has this name.
Result<Proof> proof_named(std::string_view name);
/// Of the layers of a job; DATA_LOSS if no kind has this name.
Result<LayerKind> layer_kind_named(std::string_view name, std::uint64_t job);

/// Of a job with settings, a byte a tile; DATA_LOSS if it has another number of tiles, or one no such share.
Result<Allocation> allocation_in(std::string_view bytes, const JobRecord& job);

/// Texts, one a line; line feeds within them become spaces.
std::string lines_of(std::span<const std::string> texts);
std::vector<std::string> lines_in(std::string_view text);

/// As names with commas; DATA_LOSS if one of the token's in the store is none.
Result<Roles> roles_in(std::string_view text, std::string_view token);
/// The bytes of a digest; DATA_LOSS unless there are 32.
Result<Sha256> digest_in(std::string_view bytes, std::string_view what);

/// Of stored bytes_of; DATA_LOSS unless there are 16.
Result<Hash128> hash_in(std::string_view bytes);

/// Of all that the store keeps of a job but what counts up with its results (PutProgress) and its error's history. What
/// a store gives back has the same one. XXH3-128.
Hash128 checksum_of(const JobRecord& job);
/// Of a result's row, but for whether it has been verified since. Never 0, so a row that has 0 is damaged.
std::int64_t checksum_of(const NodeKey& key, const Hash128& hash, const Renderer& by);

/// Finds jobs whose rows say something else than was written.
class JobCheck {
 public:
  void expect(JobId job, std::string_view checksum) { expected_[job] = checksum; }
  /// The value; one of the job's rows that means nothing condemns the job.
  template <class T>
  T sound(JobId job, Result<T> value) {
    if (!value.ok()) {
      condemn(job, value.status());
    }
    return value.ok() ? *std::move(value) : T{};
  }
  void condemn(JobId job, const Status& why) { damaged_.try_emplace(job, message_of(why)); }
  /// Takes what is damaged from `jobs` to `damaged_jobs`, and says so in the log. A job without a checksum is damaged.
  void finish(StoredState& state);

 private:
  std::map<JobId, std::string> expected_;
  std::map<JobId, std::string> damaged_;  ///< and why
};

/// A token, or an entry of the farm's log, that cannot be read: it goes with `repairs`, and the farm goes on without
/// it.
void leave_out_token(const std::string& id, const Status& why, StoredState& state, std::vector<StoreOp>& repairs);
void leave_out_action(std::uint64_t number, const Status& why, StoredState& state, std::vector<StoreOp>& repairs);

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

/// The bytes of an array of numbers.
template <class T>
ByteView view_of(const T& container) {
  return std::as_bytes(std::span(container));
}

}  // namespace lightmill::stored
