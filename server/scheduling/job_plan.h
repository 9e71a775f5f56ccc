// Plan of one job: which samples are free, leased or done. It cuts units, and takes lost ranges back. A tile's free
// samples are those below the goal that are neither in its forest nor leased. Tiles wait in buckets by the lowest of
// them (the frontier), and the lowest bucket goes first. So ranges of a tile are leased in ascending order, all tiles
// advance together, and lost ranges are leased next. A restarted coordinator gets the same plan from the film. Pure,
// and not thread-safe. Taking a unit costs O(tiles in it), independent of the size of the film.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/farm/messages.h"
#include "common/film/film.h"
#include "server/scheduling/unit_size.h"

namespace lightmill {

class JobPlan {
 public:
  /// `film` must outlive the plan. `goal` is in samples per pixel of the frame; each tile has its part of it
  /// (Allocation). Nodes that are leased, or merged beyond a tile's first gap, use at most `budget_bytes` together.
  /// Four per tile are always allowed.
  JobPlan(const Film& film, std::uint64_t goal, std::uint64_t budget_bytes);

  void set_goal(std::uint64_t goal);
  /// From now on only fills gaps below leased or merged samples, and gives tiles without samples their first one. So
  /// every tile ends with samples [0, n), n > 0.
  void close();
  bool closed() const { return closed_; }
  std::uint64_t goal() const { return goal_; }
  /// The goal of one tile.
  std::uint64_t goal_of(TileId tile) const { return film_.allocation().of_tile(tile, goal_); }

  /// Whether a unit of this tile has no other tile.
  void set_alone(TileId tile, bool alone);
  /// From now on a unit of this tile has one sample, and no other tile. This identity took too long for a longer unit.
  void cut_to_one_sample(TileId tile, const std::string& identity);
  /// A result of this tile came. If only another identity had it cut, it is cut no longer.
  void rendered(TileId tile, const std::string& identity);
  /// Whether the next take() gives a unit of such a tile.
  bool next_is_alone() { return clean_front() && is_alone(buckets_.begin()->second.front()); }

  /// Whether the next take() gives a unit.
  bool has_work();
  /// Whether a tile waits for its first sample. Call has_work() after the last change first.
  bool first_round() const { return !buckets_.empty() && buckets_.begin()->first.position == 0; }
  /// Cuts the next unit. `lease` now holds the range of each of its tiles.
  std::optional<Unit> take(JobId job, LeaseId lease, const UnitAim& aim);
  /// A worker came back with `lease` for this range. False unless the whole range is free.
  bool adopt(LeaseId lease, TileId tile, SampleRange range);
  /// Leases that hold exactly this range; empty if it is not leased.
  std::span<const LeaseId> holders(TileId tile, SampleRange range) const;
  /// One more lease holds a leased range. False if the range is not leased, or the lease holds it already.
  bool add_copy(LeaseId lease, TileId tile, SampleRange range);
  /// `lease` no longer holds this range. Does nothing if it did not hold it.
  void release(LeaseId lease, TileId tile, SampleRange range);

  /// To call after nodes of a tile were dropped from the film. Their samples are free again.
  void reopen(TileId tile) {
    taken_to_[tile.value] = 0;
    enqueue(tile);
  }

  /// A lease's hold on one range.
  struct Hold {
    LeaseId lease;
    TileId tile;
    SampleRange range;
  };
  /// To call after each merge into a tile, with the merged range. Ends and returns the holds on ranges that the film
  /// now has.
  std::vector<Hold> settle(TileId tile, SampleRange merged);

  /// Smallest count of frame samples that has all leased samples; 0 if there are none.
  std::uint64_t out_end() const;
  /// Pixel samples up to the goal that are neither rendered nor leased; 0 for a closed plan.
  std::uint64_t free_pixel_samples() const;
  bool nothing_out() const { return out_.empty(); }
  std::uint64_t out_pixel_samples() const { return out_pixel_samples_; }  ///< copies counted once

 private:
  struct OutRange {
    SampleRange range;
    std::vector<LeaseId> holders;  ///< at least one
  };
  static constexpr std::uint32_t kNotQueued = ~std::uint32_t{0};
  /// Bucket of tiles: their position in the frame's samples, and their own frontier.
  struct Place {
    std::uint64_t frame = 0;
    std::uint32_t position = 0;
    friend auto operator<=>(const Place&, const Place&) = default;
  };

  /// The lowest free samples of a tile, if it has any and may have more leased.
  std::optional<Gap> find_gap(TileId tile) const;
  Place place_of(TileId tile, std::uint32_t position) const;
  void enqueue(TileId tile);
  void rebuild();
  /// Drops entries of the lowest bucket until its front is current. False if nothing is left.
  bool clean_front();
  /// The gap of the entry (tile, position), if that is current. Else queues the tile at its right place.
  std::optional<Gap> check_entry(TileId tile, std::uint32_t position);
  void hold(LeaseId lease, TileId tile, SampleRange range);
  bool is_single(TileId tile) const {
    const auto cut = cuts_.find(tile);
    return cut != cuts_.end() && cut->second.holds;
  }
  bool is_alone(TileId tile) const { return alone_.contains(tile) || is_single(tile); }
  std::uint64_t pixels(TileId tile) const {
    return static_cast<std::uint64_t>(film_.grid().tile_rect(tile).pixel_count());
  }

  const Film& film_;
  std::uint64_t goal_;
  std::uint64_t waiting_limit_;  ///< nodes per tile
  bool closed_ = false;
  std::map<Place, std::deque<TileId>> buckets_;
  std::vector<std::uint32_t> queued_at_;  ///< by tile: position of its current entry, or kNotQueued
  std::vector<std::uint64_t> taken_to_;   ///< by tile: samples before this are not free, so find_gap starts here
  std::unordered_map<TileId, std::vector<OutRange>> out_;  ///< ascending, disjoint
  std::set<TileId> alone_;
  struct Cut {
    std::string by;          ///< the first identity
    bool confirmed = false;  ///< by another one
    bool holds = true;
  };
  std::map<TileId, Cut> cuts_;
  std::uint64_t out_pixel_samples_ = 0;
  std::uint64_t wanted_pixel_samples_ = 0;  ///< of the film, at the goal; 0 once closed
};

}  // namespace lightmill
