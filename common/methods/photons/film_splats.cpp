#include "common/methods/photons/film_splats.h"

#include <cmath>
#include <numeric>

#include "common/lights/light_sample.h"

namespace lightmill::photons {
namespace {

constexpr std::uint32_t kLensDecision = 1, kPixelDecision = 2;

/// One coordinate of a pixel near the film position `at`.
struct Drawn {
  std::int32_t pixel = 0;
  float weight = 0;  ///< 0: the position is in no pixel's filter
};

/// Draws pixel j with probability h(at − j − ½) / Σ and weights it by Σ, so that its mean is h.
Drawn draw_pixel(const FilterTable& filter, float at, float u) {
  const auto first = static_cast<std::int32_t>(std::ceil(at - 0.5f - filter.radius()));
  const auto last = static_cast<std::int32_t>(std::floor(at - 0.5f + filter.radius()));
  const auto value = [&](std::int32_t j) { return filter.density(at - static_cast<float>(j) - 0.5f); };
  float sum = 0;
  for (std::int32_t j = first; j <= last; ++j) {
    sum += value(j);
  }
  Drawn drawn{0, 0};
  float below = 0;
  for (std::int32_t j = first; j <= last; ++j) {
    const float h = value(j);
    if (h > 0) {
      drawn = {j, sum};
      below += h;
      if (u * sum < below) {
        break;
      }
    }
  }
  return drawn;
}

}  // namespace

FilmSplats::FilmSplats(const CompiledScene& scene, std::span<const Photon> photons, std::uint32_t seed) {
  const int width = scene.film_width(), height = scene.film_height();
  columns_ = (width + kTileSize - 1) / kTileSize;
  rows_ = (height + kTileSize - 1) / kTileSize;
  first_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  const auto tile_of = [&](const Splat& splat) {
    return static_cast<std::size_t>(splat.y / kTileSize) * columns_ + splat.x / kTileSize;
  };
  const CameraBasis& camera = scene.camera();
  const V8 forward = broadcast(camera.forward);
  const F8 across = F8(1.0f / glm::dot(camera.right, camera.right));
  std::vector<Splat> unsorted;
  for (std::size_t begin = 0; begin < photons.size(); begin += 8) {
    const M8 lanes = first_lanes(static_cast<int>(photons.size() - begin));
    const U8 index = U8(static_cast<std::uint32_t>(begin)) + U8::lane_index();
    V8 lens_point = broadcast(camera.position);
    F8 focus(1.0f);
    if (camera.has_lens) {
      const Pair8 disk = square_to_disk(hashed_pair(index, decision_seed(U8(seed), kLensDecision)));
      lens_point = lens_point + broadcast(camera.lens_x) * disk.u + broadcast(camera.lens_y) * disk.v;
      focus = F8(camera.focus);
    }
    const V8 way = load_photons(photons, index, lanes).point - lens_point;
    const F8 depth = dot(way, forward);
    // Where the ray from the lens meets the plane of focus (of a pinhole: at distance 1), relative to the lens centre.
    const V8 seen = lens_point + way * (focus / depth) - broadcast(camera.position);
    const F8 scale = across / focus;
    const F8 x = dot(seen, broadcast(camera.right)) * scale + F8(camera.center_x);
    const F8 y = dot(seen, broadcast(camera.down)) * scale + F8(camera.center_y);
    const F8 margin(scene.filter().radius() + 1);
    const M8 on_film = lanes & (depth > F8(0.0f)) & (x > -margin) & (y > -margin) &
                       (x < F8(static_cast<float>(width)) + margin) & (y < F8(static_cast<float>(height)) + margin);
    const Pair8 u = hashed_pair(index, decision_seed(U8(seed), kPixelDecision));
    const VectorLanes places({x, y, depth}), numbers({u.u, u.v, depth}), lens_points(lens_point);
    for (auto bits = static_cast<unsigned>(on_film.bits()); bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      const Drawn column = draw_pixel(scene.filter(), places.x[i], numbers.x[i]);
      const Drawn row = draw_pixel(scene.filter(), places.y[i], numbers.y[i]);
      const Splat splat{static_cast<std::uint32_t>(begin + i), column.pixel, row.pixel, column.weight * row.weight,
                        lens_points[i]};
      if (splat.weight > 0 && splat.x >= 0 && splat.x < width && splat.y >= 0 && splat.y < height) {
        unsorted.push_back(splat);
        ++first_[tile_of(splat)];
      }
    }
  }
  std::exclusive_scan(first_.begin(), first_.end(), first_.begin(), std::uint32_t{0});
  std::vector<std::uint32_t> next = first_;
  splats_.resize(unsorted.size());
  for (const Splat& splat : unsorted) {
    splats_[next[tile_of(splat)]++] = splat;
  }
}

void FilmSplats::find(const PixelRect& rect, std::vector<const Splat*>& out) const {
  for (int row = rect.y / kTileSize; row * kTileSize < rect.y + rect.height && row < rows_; ++row) {
    for (int column = rect.x / kTileSize; column * kTileSize < rect.x + rect.width && column < columns_; ++column) {
      const std::size_t tile = static_cast<std::size_t>(row) * columns_ + column;
      for (std::uint32_t i = first_[tile]; i < first_[tile + 1]; ++i) {
        const Splat& splat = splats_[i];
        if (splat.x >= rect.x && splat.x < rect.x + rect.width && splat.y >= rect.y && splat.y < rect.y + rect.height) {
          out.push_back(&splat);
        }
      }
    }
  }
}

}  // namespace lightmill::photons
