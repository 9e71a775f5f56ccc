#include "common/lights/unoccluded_irradiance.h"

#include <array>

namespace lightmill {
namespace {

// The light of an image is summed in cells of about 6°, each with its mean direction. So a cell's cosine is exact
// unless it cuts the horizon. Irradiance is bilinear between normals 3° apart.
constexpr std::size_t kCellRows = 32, kCellColumns = 64;
constexpr std::size_t kRows = 64, kColumns = 128;

/// Vector irradiance by colour.
using Cell = std::array<Vec3d, 3>;

std::vector<Cell> gather_cells(const EnvironmentRadiance& environment) {
  std::vector<Cell> cells(kCellRows * kCellColumns, Cell{Vec3d(0), Vec3d(0), Vec3d(0)});
  environment.for_each_beam([&](const V8& direction, const V8& irradiance) {
    const F8 sine = sqrt(direction.x * direction.x + direction.z * direction.z);
    const F8 row = atan2(sine, direction.y) * F8(kCellRows * kInvPi);
    const F8 column = (F8(0.5f) + atan2(direction.z, direction.x) * F8(0.5f * kInvPi)) * F8(kCellColumns);
    alignas(32) std::uint32_t rows[8], columns[8];
    truncate(row).store(rows);
    truncate(column).store(columns);
    const VectorLanes directions(direction), irradiances(irradiance);
    for (int lane = 0; lane < 8; ++lane) {
      const std::size_t r = std::min<std::size_t>(rows[lane], kCellRows - 1);
      const std::size_t c = columns[lane] % kCellColumns;
      const Vec3d d = directions[lane], e = irradiances[lane];
      for (int color = 0; color < 3; ++color) {
        cells[r * kCellColumns + c][static_cast<std::size_t>(color)] += d * e[color];
      }
    }
  });
  return cells;
}

std::vector<float> tabulate(const EnvironmentRadiance& environment) {
  const std::vector<Cell> cells = gather_cells(environment);
  using Row = std::array<double, kColumns>;  // a row at a time: its loops over columns are vectorised
  std::vector<float> out;
  out.reserve(3 * (kRows + 1) * kColumns);
  for (std::size_t row = 0; row <= kRows; ++row) {
    const double theta = kPiDouble * static_cast<double>(row) / kRows, cosine = cos_fixed(theta);
    Row x, z;
    for (std::size_t column = 0; column < kColumns; ++column) {
      const double phi = 2 * kPiDouble * static_cast<double>(column) / kColumns;
      // Half a turn from atan2's convention: column 0 is −x.
      x[column] = -sin_fixed(theta) * cos_fixed(phi);
      z[column] = -sin_fixed(theta) * sin_fixed(phi);
    }
    std::array<Row, 3> sums{};
    for (const Cell& cell : cells) {
      for (std::size_t color = 0; color < 3; ++color) {
        const Vec3d e = cell[color];
        for (std::size_t column = 0; column < kColumns; ++column) {
          sums[color][column] += std::max(e.x * x[column] + e.y * cosine + e.z * z[column], 0.0);
        }
      }
    }
    for (std::size_t column = 0; column < kColumns; ++column) {
      for (const Row& sum : sums) {
        out.push_back(static_cast<float>(sum[column]));
      }
    }
  }
  return out;
}

template <class Lights>
bool has_size(const Lights& lights, std::size_t i) {
  if constexpr (requires { lights.has_size(i); }) {
    return lights.has_size(i);
  }
  return false;
}

/// The sum over all lights of a kind that have no size.
template <class Lights>
V8 sum_of_delta(const Lights& lights, const V8& p, const V8& n, M8 lanes) {
  V8 sum = broadcast(Vec3(0));
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (has_size(lights, i)) {
      continue;
    }
    const LightSample8 light = lights.sample(p, U8(static_cast<std::uint32_t>(i)), lanes);
    const F8 cosine = max(dot(light.wi, n), F8(0.0f));
    sum = sum + masked(light.valid, light.weight * cosine);
  }
  return sum;
}

/// The sum over all lights of a kind that have a size. Lane by lane, because the formulas branch.
template <class Lights>
V8 sum_of_sized(const Lights& lights, const V8& p, const V8& n, M8 lanes) {
  bool any = false;
  for (std::size_t i = 0; i < lights.size() && !any; ++i) {
    any = has_size(lights, i);
  }
  if (!any) {
    return {};
  }
  const VectorLanes points(p), normals(n);
  alignas(32) float sums[3][8] = {};
  for (unsigned bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
    const int lane = std::countr_zero(bits);
    const Vec3d point = points[lane], normal = normals[lane];
    Vec3d sum(0);
    for (std::size_t i = 0; i < lights.size(); ++i) {
      sum += has_size(lights, i) ? lights.irradiance(i, point, normal) : Vec3d(0);
    }
    for (int color = 0; color < 3; ++color) {
      sums[color][lane] = static_cast<float>(sum[color]);
    }
  }
  return {F8::load(sums[0]), F8::load(sums[1]), F8::load(sums[2])};
}

}  // namespace

UnoccludedIrradiance::UnoccludedIrradiance(const LightTable& lights) : facets_(lights.facets) {
  if (!lights.environment.exists()) {
    return;
  }
  if (lights.environment.is_constant()) {
    constant_ = Vec3(VectorLanes(lights.environment.radiance(broadcast(Vec3(0, 1, 0))))[0]) * kPi;
  } else {
    image_ = tabulate(lights.environment);
  }
}

V8 UnoccludedIrradiance::at(const LightTable& lights, const V8& p, const V8& n, M8 lanes) const {
  V8 sum = of_environment(n) + sum_of_delta(lights.points, p, n, lanes) + sum_of_delta(lights.spots, p, n, lanes) +
           sum_of_delta(lights.cosine_powers, p, n, lanes) + sum_of_delta(lights.ies, p, n, lanes) +
           sum_of_delta(lights.directional, p, n, lanes);
  return sum + facets_.at(p, n, lanes) + sum_of_sized(lights.spheres, p, n, lanes) +
         sum_of_sized(lights.disks, p, n, lanes) + sum_of_sized(lights.points, p, n, lanes) +
         sum_of_sized(lights.spots, p, n, lanes) + sum_of_sized(lights.directional, p, n, lanes);
}

V8 UnoccludedIrradiance::of_environment(const V8& n) const {
  if (image_.empty()) {
    return broadcast(constant_);
  }
  const F8 sine = sqrt(n.x * n.x + n.z * n.z);
  const F8 y = min(atan2(sine, n.y) * F8(kInvPi), F8(1.0f)) * F8(kRows);
  const F8 x = (F8(0.5f) + atan2(n.z, n.x) * F8(0.5f * kInvPi)) * F8(kColumns);
  const U8 last_row(static_cast<std::uint32_t>(kRows - 1)), last_column(static_cast<std::uint32_t>(kColumns - 1));
  const U8 row = select(signed_less(last_row, truncate(y)), last_row, truncate(y));
  const U8 left = truncate(x) & last_column;  // a power of two
  const U8 right = (left + U8(1u)) & last_column;
  const F8 t = y - to_float(row), s = x - to_float(truncate(x));
  const M8 all(true);
  const auto in_row = [&](U8 r) {
    const U8 first = r * U8(static_cast<std::uint32_t>(kColumns));
    const V8 a = gather3(image_.data(), first + left, all), b = gather3(image_.data(), first + right, all);
    return a + (b - a) * s;
  };
  const V8 a = in_row(row), b = in_row(row + U8(1u));
  return a + (b - a) * t;
}

}  // namespace lightmill
