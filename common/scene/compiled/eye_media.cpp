#include "common/scene/compiled/eye_media.h"

#include <map>

namespace lightmill {
namespace {

std::uint32_t first_lane(U8 x) {
  alignas(32) std::uint32_t lanes[8];
  x.store(lanes);
  return lanes[0];
}

}  // namespace

Media8 find_media(const CompiledScene& scene, const Vec3& point, const Vec3& direction) {
  const M8 lane = first_lanes(1);
  Ray8 ray{broadcast(point), broadcast(direction), F8(std::numeric_limits<float>::infinity())};
  std::map<std::uint32_t, int> balance;     // of a medium: times entered less times left
  std::vector<std::uint32_t> around_point;  // the innermost first
  constexpr int kMaxSurfaces = 100'000;
  for (int i = 0; i < kMaxSurfaces && Accel::traceable(ray).bits() & 1; ++i) {
    const Hit8 hit = scene.accel().intersect(lane, ray, false);
    if (hit.hit.none()) {
      break;
    }
    const Surface8 surface = scene.surface(ray, hit);
    const bool front = surface.front.any();
    if (const std::uint32_t medium = first_lane(scene.media().of_material(surface.material, lane)); medium != 0) {
      balance[medium] += front ? 1 : -1;
      if (balance[medium] < 0) {
        balance[medium] = 0;
        around_point.push_back(medium);
      }
    }
    const V8 onward = front ? -surface.geometric_normal : surface.geometric_normal;
    ray.origin = surface.point + onward * surface.offset;
  }
  Media8 media;
  for (auto medium = around_point.rbegin(); medium != around_point.rend(); ++medium) {
    media = MediumTable::entered(media, U8(*medium));
  }
  return media;
}

}  // namespace lightmill
