// Camera rays, eight at a time.
#pragma once

#include "common/film/tile_grid.h"
#include "common/geometry/ray.h"
#include "common/sampling/sobol.h"
#include "common/sampling/warp.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// Decisions of the film. Methods number theirs from kFirstPathDecision.
inline constexpr std::uint32_t kFilterDecision = 0;
inline constexpr std::uint32_t kFirstPathDecision = 1;
inline constexpr std::uint32_t kLensDecision = 0x40000000;  ///< above the decisions of path vertices

/// Sets the scrambles of a tile's pixels in one half: one per pixel, row by row.
inline void fill_pixel_seeds(const PixelRect& tile, std::uint64_t seed, std::uint32_t half,
                             std::vector<std::uint32_t>& out) {
  out.clear();
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      out.push_back(pixel_seed(seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), half));
    }
  }
  out.resize(out.size() + 8, 0);  // reads are eight wide
}

/// Replaces pinhole rays by rays from points of the lens. Both meet in the plane of focus.
inline Ray8 through_lens(const CompiledScene& scene, const Ray8& rays, Pair8 u) {
  const CameraBasis& camera = scene.camera();
  const Pair8 disk = square_to_disk(u);
  const V8 offset = broadcast(camera.lens_x) * disk.u + broadcast(camera.lens_y) * disk.v;
  const F8 to_focus = F8(camera.focus) / dot(rays.direction, broadcast(camera.forward));
  return {rays.origin + offset, normalize(rays.direction * to_focus - offset), rays.max_distance};
}

/// Camera rays of one sample of eight pixels. `pixel` numbers the tile's pixels row by row. `index` is the sample's
/// index in its half. The pixel filter is importance-sampled.
inline Ray8 sample_camera_rays(const CompiledScene& scene, const PixelRect& tile, U8 pixel, U8 pixel_seed,
                               std::uint32_t index) {
  // Exact for pixel < 2^12 and width <= 64, because the quotient is at least 1/64 below the next integer.
  const U8 row = truncate((to_float(pixel) + F8(0.5f)) / F8(static_cast<float>(tile.width)));
  const U8 column = pixel - row * U8(static_cast<std::uint32_t>(tile.width));
  const Pair8 u = sobol_pair(U8(index), decision_seed(pixel_seed, kFilterDecision));
  const F8 x = to_float(column + U8(static_cast<std::uint32_t>(tile.x))) + F8(0.5f) + scene.filter().sample(u.u);
  const F8 y = to_float(row + U8(static_cast<std::uint32_t>(tile.y))) + F8(0.5f) + scene.filter().sample(u.v);
  const Ray8 rays = scene.camera().rays(x, y);
  return scene.camera().has_lens
             ? through_lens(scene, rays, sobol_pair(U8(index), decision_seed(pixel_seed, kLensDecision)))
             : rays;
}

}  // namespace lightmill
