#include "common/lights/light_visibility.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

struct LightVisibility::Builder {
  struct Placed {
    std::array<std::uint32_t, 3> cell;
    std::uint32_t tested, visible;
  };

  LightVisibility& out;

  /// Gives estimates to the cells of a cube whose sides have 2^level cells. `around` is the row of the smallest cell
  /// around the cube that has more samples than the cube. That cell has `samples_around` samples.
  void fill(const std::array<std::uint32_t, 3>& low, int level, std::span<Placed> samples, std::uint32_t around,
            std::size_t samples_around) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (low[axis] >= out.size_[axis]) {
        return;
      }
    }
    const bool as_around = samples.empty() || samples.size() == samples_around;
    const std::uint32_t row = as_around ? around : add_row(samples, around);
    if (level == 0) {
      out.rows_[(low[2] * out.size_[1] + low[1]) * out.size_[0] + low[0]] = row;
      return;
    }
    const std::size_t all = samples.size();
    const std::uint32_t half = 1u << (level - 1);
    for (std::uint32_t child = 0; child < 8; ++child) {
      std::array<std::uint32_t, 3> corner = low;
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        corner[axis] += (child >> axis & 1) * half;
      }
      const auto inside = [&](const Placed& s) {
        return s.cell[0] - corner[0] < half && s.cell[1] - corner[1] < half && s.cell[2] - corner[2] < half;
      };
      const auto rest = std::stable_partition(samples.begin(), samples.end(), inside);
      fill(corner, level - 1, {samples.begin(), rest}, row, all);
      samples = {rest, samples.end()};
    }
  }

  std::uint32_t add_row(std::span<const Placed> samples, std::uint32_t around) {
    std::array<std::uint32_t, kMaxGroups> tested{}, visible{};
    for (const Placed& s : samples) {
      for (std::size_t group = 0; group < out.groups_; ++group) {
        tested[group] += s.tested >> group & 1;
        visible[group] += s.visible >> group & 1;
      }
    }
    const auto row = static_cast<std::uint32_t>(out.estimates_.size() / out.groups_);
    for (std::size_t group = 0; group < out.groups_; ++group) {
      const float wider = row == 0 ? 0.5f : out.estimates_[around * out.groups_ + group],
                  k = row == 0 ? 1 : kSamplesAround;
      const float estimate = (static_cast<float>(visible[group]) + k * wider) / (static_cast<float>(tested[group]) + k);
      out.estimates_.push_back(std::max(estimate, kLeast));
    }
    return row;
  }
};

LightVisibility::LightVisibility(std::span<const Sample> samples, std::size_t groups) : groups_(groups) {
  Vec3 extent(0);
  for (int axis = 0; axis < 3 && !samples.empty(); ++axis) {
    std::vector<float> along;
    for (const Sample& s : samples) {
      along.push_back(s.point[axis]);
    }
    const auto value = [&](double share) {
      const auto at = along.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(along.size() - 1));
      std::ranges::nth_element(along, at);
      return *at;
    };
    low_[axis] = value(kBeyond);
    extent[axis] = value(1 - kBeyond) - low_[axis];
  }
  const float longest = std::max({extent.x, extent.y, extent.z});
  if (!(longest > 0) || !std::isfinite(longest)) {
    return;
  }
  // Walls often lie in the middle of a room, or at its ends. Borders between cells keep off them, so that a point on a
  // surface and one just off it are in one cell.
  constexpr float kShift = 0.38f;  // of a cell
  cells_per_length_ = (static_cast<float>(kCells) - kShift) / longest;
  low_ -= kShift / cells_per_length_;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cells = static_cast<std::uint32_t>(extent[axis] * cells_per_length_ + kShift) + 1;
    size_[static_cast<std::size_t>(axis)] = std::min(cells, kCells);
  }
  std::vector<Builder::Placed> placed;
  for (const Sample& s : samples) {
    const auto at = cell(broadcast(s.point));
    Builder::Placed& p = placed.emplace_back(Builder::Placed{{}, s.tested, s.visible});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      alignas(32) std::uint32_t lanes[8];
      at[axis].store(lanes);
      p.cell[axis] = lanes[0];
    }
  }
  rows_.resize(std::size_t{size_[0]} * size_[1] * size_[2]);
  Builder{*this}.fill({0, 0, 0}, kLevels, placed, 0, 0);
}

std::array<U8, 3> LightVisibility::cell(const V8& p) const {
  const V8 from_low = (p - broadcast(low_)) * F8(cells_per_length_);
  const auto number = [](F8 x, std::uint32_t cells) {
    return truncate(min(max(x, F8(0.0f)), F8(static_cast<float>(cells) - 0.5f)));
  };
  return {number(from_low.x, size_[0]), number(from_low.y, size_[1]), number(from_low.z, size_[2])};
}

U8 LightVisibility::row(const V8& p) const {
  const auto at = cell(p);
  const auto cells = [this](std::size_t axis) { return U8(size_[axis]); };
  return gather(rows_.data(), (at[2] * cells(1) + at[1]) * cells(0) + at[0], M8(true));
}

}  // namespace lightmill
