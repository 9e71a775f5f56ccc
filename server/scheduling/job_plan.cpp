#include "server/scheduling/job_plan.h"

#include <algorithm>
#include <numeric>

#include "common/base/check.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMinWaitingNodes = 4;  ///< per tile

std::uint64_t bytes_of_one_node_per_tile(const Film& film) {
  return film.grid().pixel_count() * film.layout().most_values() * sizeof(float);
}

bool overlap(const SampleRange& a, const SampleRange& b) {
  return a.contains(b) || b.contains(a);
}

}  // namespace

JobPlan::JobPlan(const Film& film, std::uint64_t goal, std::uint64_t budget_bytes)
    : film_(film),
      goal_(goal),
      waiting_limit_(std::max(kMinWaitingNodes, budget_bytes / bytes_of_one_node_per_tile(film))),
      queued_at_(film.grid().tile_count(), kNotQueued),
      taken_to_(film.grid().tile_count(), 0) {
  LM_CHECK(goal > 0 && goal <= kMaxSamples);
  rebuild();
}

void JobPlan::rebuild() {
  wanted_pixel_samples_ = closed_ ? 0 : film_.pixel_samples_at(goal_);
  buckets_.clear();
  std::fill(queued_at_.begin(), queued_at_.end(), kNotQueued);
  std::fill(taken_to_.begin(), taken_to_.end(), 0);
  // The first units are spread over the picture. Their costs set the size of the next units, and neighbours cost alike.
  const std::uint64_t count = queued_at_.size();
  auto stride = static_cast<std::uint64_t>(static_cast<double>(count) * 0.618);
  for (stride = std::max<std::uint64_t>(stride, 1); std::gcd(stride, count) != 1;) {
    ++stride;
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    enqueue(TileId{static_cast<std::uint32_t>(i * stride % count)});
  }
}

void JobPlan::set_goal(std::uint64_t goal) {
  LM_CHECK(goal > 0 && goal <= kMaxSamples);
  goal_ = goal;
  closed_ = false;
  rebuild();
}

void JobPlan::close() {
  closed_ = true;
  rebuild();
}

std::optional<Gap> JobPlan::find_gap(TileId tile) const {
  const std::vector<NodePtr>& forest = film_.forest(tile);
  const auto found = out_.find(tile);
  const std::span<const OutRange> out = found == out_.end() ? std::span<const OutRange>() : std::span(found->second);

  // Walk both ascending lists together.
  std::uint64_t position = taken_to_[tile.value];
  auto i = static_cast<std::size_t>(
      std::ranges::partition_point(forest, [=](const NodePtr& node) { return node->range.end() <= position; }) -
      forest.begin());
  auto j = static_cast<std::size_t>(
      std::ranges::partition_point(out, [=](const OutRange& each) { return each.range.end() <= position; }) -
      out.begin());
  for (;;) {
    if (i < forest.size() && forest[i]->range.first() <= position) {
      position = std::max(position, forest[i++]->range.end());
    } else if (j < out.size() && out[j].range.first() <= position) {
      position = std::max(position, out[j++].range.end());
    } else {
      break;
    }
  }
  Gap gap{position, goal_of(tile)};
  if (closed_) {
    gap.end = std::max<std::uint64_t>(
        {1, i < forest.size() ? forest.back()->range.end() : 0, j < out.size() ? out.back().range.end() : 0});
  }
  if (i < forest.size()) {
    gap.end = std::min(gap.end, forest[i]->range.first());
  }
  if (j < out.size()) {
    gap.end = std::min(gap.end, out[j].range.first());
  }
  if (gap.first >= gap.end) {
    return std::nullopt;
  }
  // A gap without leased samples before it is always allowed: only it lets waiting nodes join.
  const std::size_t joined =
      static_cast<std::size_t>(std::find_if(forest.begin(), forest.end(),
                                            [end = std::uint64_t{0}](const NodePtr& node) mutable {
                                              const bool gap_before = node->range.first() != end;
                                              end = node->range.end();
                                              return gap_before;
                                            }) -
                               forest.begin());
  if (!out.empty() && out.front().range.first() < position && out.size() + (forest.size() - joined) >= waiting_limit_) {
    return std::nullopt;
  }
  return gap;
}

/// In quarters of a frame sample, so that different shares get different places.
JobPlan::Place JobPlan::place_of(TileId tile, std::uint32_t position) const {
  return {film_.allocation().of_frame(tile, std::uint64_t{position} << Allocation::kMaxDoublings), position};
}

void JobPlan::enqueue(TileId tile) {
  const std::optional<Gap> gap = find_gap(tile);
  if (gap) {
    taken_to_[tile.value] = gap->first;
  }
  std::uint32_t& at = queued_at_[tile.value];
  if (gap && (at == kNotQueued || at > gap->first)) {
    at = static_cast<std::uint32_t>(gap->first);
    buckets_[place_of(tile, at)].push_back(tile);
  }
}

std::optional<Gap> JobPlan::check_entry(TileId tile, std::uint32_t position) {
  if (queued_at_[tile.value] != position) {
    return std::nullopt;
  }
  const std::optional<Gap> gap = find_gap(tile);
  if (gap && gap->first == position) {
    return gap;
  }
  queued_at_[tile.value] = kNotQueued;
  enqueue(tile);
  return std::nullopt;
}

bool JobPlan::clean_front() {
  while (!buckets_.empty()) {
    const auto bucket = buckets_.begin();
    if (bucket->second.empty()) {
      buckets_.erase(bucket);
    } else if (!check_entry(bucket->second.front(), bucket->first.position)) {
      bucket->second.pop_front();
    } else {
      return true;
    }
  }
  return false;
}

void JobPlan::set_alone(TileId tile, bool alone) {
  if (alone) {
    alone_.insert(tile);
  } else {
    alone_.erase(tile);
  }
}

void JobPlan::cut_to_one_sample(TileId tile, const std::string& identity) {
  Cut& cut = cuts_.try_emplace(tile, Cut{identity}).first->second;
  cut.confirmed = cut.confirmed || cut.by != identity;
  cut.holds = true;
}

void JobPlan::rendered(TileId tile, const std::string& identity) {
  if (const auto cut = cuts_.find(tile); cut != cuts_.end() && cut->second.by != identity) {
    cut->second.holds = cut->second.confirmed;
  }
}

bool JobPlan::has_work() {
  return clean_front();
}

std::optional<Unit> JobPlan::take(JobId job, LeaseId lease, const UnitAim& aim) {
  if (!clean_front()) {
    return std::nullopt;
  }
  const std::uint32_t position = buckets_.begin()->first.position;
  std::deque<TileId>& waiting = buckets_.begin()->second;
  const TileId lead = waiting.front();
  Unit unit{job, choose_range(*find_gap(lead), waiting.size(), pixels(lead), free_pixel_samples(), aim), {}};
  const bool alone = is_alone(lead);
  if (is_single(lead)) {
    unit.range = {0, position};
  }
  const std::uint32_t wanted = alone ? 1 : choose_tile_count(unit.range, waiting.size(), pixels(lead), aim);

  // Tiles whose gap is too short for the range stay for another unit. The number of tiles to check is limited.
  std::vector<TileId> set_aside;
  std::uint64_t looked_at = 0;
  while (!waiting.empty() && unit.tiles.size() < wanted && looked_at++ < 2 * std::uint64_t{wanted} + 64) {
    const TileId tile = waiting.front();
    const std::optional<Gap> gap = check_entry(tile, position);
    waiting.pop_front();
    if (!gap) {
      continue;
    }
    if (gap->end < unit.range.end() || alone != is_alone(tile)) {
      set_aside.push_back(tile);
      continue;
    }
    unit.tiles.push_back(tile);
    queued_at_[tile.value] = kNotQueued;
    hold(lease, tile, unit.range);
    enqueue(tile);
  }
  waiting.insert(waiting.begin(), set_aside.begin(), set_aside.end());
  LM_CHECK(!unit.tiles.empty());
  std::sort(unit.tiles.begin(), unit.tiles.end());
  return unit;
}

void JobPlan::hold(LeaseId lease, TileId tile, SampleRange range) {
  std::vector<OutRange>& out = out_[tile];
  const auto at =
      std::ranges::partition_point(out, [&](const OutRange& each) { return each.range.first() <= range.first(); });
  out.insert(at, {range, {lease}});
  out_pixel_samples_ += pixels(tile) * range.count();
}

bool JobPlan::adopt(LeaseId lease, TileId tile, SampleRange range) {
  if (tile.value >= queued_at_.size() || range.level > kMaxRangeLevel || range.end() > goal_of(tile)) {
    return false;
  }
  const auto touches = [&](const auto& each) { return overlap(each, range); };
  if (std::ranges::any_of(film_.forest(tile), [&](const NodePtr& node) { return touches(node->range); })) {
    return false;
  }
  if (const auto found = out_.find(tile);
      found != out_.end() &&
      std::ranges::any_of(found->second, [&](const OutRange& each) { return touches(each.range); })) {
    return false;
  }
  hold(lease, tile, range);
  enqueue(tile);
  return true;
}

std::span<const LeaseId> JobPlan::holders(TileId tile, SampleRange range) const {
  const auto found = out_.find(tile);
  if (found == out_.end()) {
    return {};
  }
  const auto out = std::ranges::find(found->second, range, &OutRange::range);
  return out == found->second.end() ? std::span<const LeaseId>() : out->holders;
}

bool JobPlan::add_copy(LeaseId lease, TileId tile, SampleRange range) {
  if (const std::span<const LeaseId> held = holders(tile, range); held.empty() || std::ranges::count(held, lease) > 0) {
    return false;
  }
  std::ranges::find(out_.at(tile), range, &OutRange::range)->holders.push_back(lease);
  return true;
}

std::uint64_t JobPlan::free_pixel_samples() const {
  const std::uint64_t given = film_.pixel_samples() + out_pixel_samples_;
  return wanted_pixel_samples_ > given ? wanted_pixel_samples_ - given : 0;
}

std::uint64_t JobPlan::out_end() const {
  std::uint64_t end = 0;
  for (const auto& [tile, out] : out_) {
    end = std::max(end, out.empty() ? 0 : film_.allocation().frame_for(tile, out.back().range.end()));
  }
  return end;
}

void JobPlan::release(LeaseId lease, TileId tile, SampleRange range) {
  const auto found = out_.find(tile);
  if (found == out_.end()) {
    return;
  }
  std::vector<OutRange>& out = found->second;
  const auto at = std::find_if(out.begin(), out.end(), [&](const OutRange& each) { return each.range == range; });
  if (at == out.end()) {
    return;
  }
  std::erase(at->holders, lease);
  if (!at->holders.empty()) {
    return;
  }
  out.erase(at);
  taken_to_[tile.value] = std::min(taken_to_[tile.value], range.first());
  out_pixel_samples_ -= pixels(tile) * range.count();
  if (out.empty()) {
    out_.erase(found);
  }
  enqueue(tile);
}

std::vector<JobPlan::Hold> JobPlan::settle(TileId tile, SampleRange merged) {
  std::vector<Hold> ended;
  if (const auto found = out_.find(tile); found != out_.end()) {
    std::vector<OutRange>& out = found->second;
    const auto begin =
        std::ranges::partition_point(out, [&](const OutRange& each) { return each.range.end() <= merged.first(); });
    const auto end =
        std::ranges::partition_point(out, [&](const OutRange& each) { return each.range.first() < merged.end(); });
    const auto left = std::remove_if(begin, end, [&](const OutRange& each) {
      if (!film_.covered(tile, each.range)) {
        return false;
      }
      for (const LeaseId holder : each.holders) {
        ended.push_back({holder, tile, each.range});
      }
      out_pixel_samples_ -= pixels(tile) * each.range.count();
      return true;
    });
    out.erase(left, end);
    if (out.empty()) {
      out_.erase(found);
    }
  }
  enqueue(tile);
  return ended;
}

}  // namespace lightmill
