// What of one job is free, out, or done: cuts units and takes back what was lost.
//
// The plan keeps no list of pending work. A tile's free samples are those below the goal that neither its forest covers
// nor anybody has out; the lowest of them is its frontier. Tiles wait in buckets by frontier, and the lowest bucket
// goes first: so ranges of a tile go out in ascending order, all tiles advance together, a lost range is a lower
// frontier and goes out next, and a restarted coordinator finds the same plan in the film alone. Buckets may hold stale
// entries, which are dropped when met.
//
// Pure and not thread-safe. Taking a unit costs O(tiles in it), whatever the size of the film.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "common/farm/messages.h"
#include "common/film/film.h"
#include "server/scheduling/unit_size.h"

namespace lightmill {

class JobPlan {
 public:
  /// `film` must outlive the plan. `goal` is in samples per pixel of the frame, of which each tile has its part
  /// (Allocation). Nodes that are out, or merged but beyond a tile's
  /// first gap, hold at most `budget_bytes` altogether, but four per tile are always allowed.
  JobPlan(const Film& film, std::uint64_t goal, std::uint64_t budget_bytes);

  void set_goal(std::uint64_t goal);
  /// From now on only fills gaps below what is out or merged, and gives tiles that have none their first sample, so
  /// that every tile ends as samples [0, n) for some n > 0.
  void close();
  bool closed() const { return closed_; }
  std::uint64_t goal() const { return goal_; }
  /// The same of one tile.
  std::uint64_t goal_of(TileId tile) const { return film_.allocation().of_tile(tile, goal_); }

  /// Whether a unit of this tile is to hold no other one.
  void set_alone(TileId tile, bool alone);
  /// From now on a unit of this tile holds one sample, and no other tile.
  void cut_to_one_sample(TileId tile) { single_.insert(tile); }
  /// Whether take() would give a unit of such a tile.
  bool next_is_alone() { return clean_front() && is_alone(buckets_.begin()->second.front()); }

  /// Whether take() would give something.
  bool has_work();
  /// Whether some tile waits for its first sample; has_work() was called since the last change.
  bool first_round() const { return !buckets_.empty() && buckets_.begin()->first.position == 0; }
  /// Cuts the next unit, of which `lease` now holds each tile's range.
  std::optional<Unit> take(JobId job, LeaseId lease, const UnitAim& aim);
  /// `lease` already works on this range (a worker came back with it). False if the range is not wholly free.
  bool adopt(LeaseId lease, TileId tile, SampleRange range);
  /// A second lease works on a range that is out. False if it is not out, or has two holders already.
  bool add_copy(LeaseId lease, TileId tile, SampleRange range);
  /// `lease` does not work on this range any more. Nothing happens if it did not.
  void release(LeaseId lease, TileId tile, SampleRange range);

  /// To be called after something of a tile was taken out of the film: it is free again.
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
  /// To be called after each merge into a tile, with what was merged: ends and returns the holds on ranges that the
  /// film now covers.
  std::vector<Hold> settle(TileId tile, SampleRange merged);

  /// The samples of the frame that have all that is out; 0 if nothing is.
  std::uint64_t out_end() const;
  /// What is neither rendered nor out, up to the goal; 0 of a closed plan.
  std::uint64_t free_pixel_samples() const;
  bool nothing_out() const { return out_.empty(); }
  std::uint64_t out_pixel_samples() const { return out_pixel_samples_; }  ///< copies counted once
  std::uint32_t holders(TileId tile, SampleRange range) const;

 private:
  struct OutRange {
    SampleRange range;
    std::vector<LeaseId> holders;  ///< one or two
  };
  static constexpr std::uint32_t kNotQueued = ~std::uint32_t{0};
  /// Where tiles wait: how far the frame is there, and their own frontier.
  struct Place {
    std::uint64_t frame = 0;
    std::uint32_t position = 0;
    friend auto operator<=>(const Place&, const Place&) = default;
  };

  /// The lowest free samples of a tile, if it has any and may have more out.
  std::optional<Gap> find_gap(TileId tile) const;
  Place place_of(TileId tile, std::uint32_t position) const;
  void enqueue(TileId tile);
  void rebuild();
  /// Pops entries from the lowest bucket until its front is right; false if there is nothing.
  bool clean_front();
  /// Whether the entry (tile, position) is current; if not, the tile is queued where it belongs.
  std::optional<Gap> check_entry(TileId tile, std::uint32_t position);
  void hold(LeaseId lease, TileId tile, SampleRange range);
  bool is_alone(TileId tile) const { return alone_.contains(tile) || single_.contains(tile); }
  std::uint64_t pixels(TileId tile) const {
    return static_cast<std::uint64_t>(film_.grid().tile_rect(tile).pixel_count());
  }

  const Film& film_;
  std::uint64_t goal_;
  std::uint64_t waiting_limit_;  ///< nodes per tile
  bool closed_ = false;
  std::map<Place, std::deque<TileId>> buckets_;
  std::vector<std::uint32_t> queued_at_;  ///< by tile: position of its current entry, or kNotQueued
  std::vector<std::uint64_t> taken_to_;   ///< by tile: no sample before this is free, so that nobody looks there
  std::unordered_map<TileId, std::vector<OutRange>> out_;  ///< ascending, disjoint
  std::set<TileId> alone_, single_;
  std::uint64_t out_pixel_samples_ = 0;
  std::uint64_t wanted_pixel_samples_ = 0;  ///< of the film, at the goal; 0 once closed
};

}  // namespace lightmill
