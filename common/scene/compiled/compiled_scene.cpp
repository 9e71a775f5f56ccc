#include "common/scene/compiled/compiled_scene.h"

#include <map>

namespace lightmill {
namespace {

std::uint32_t first_lane(U8 x) {
  alignas(32) std::uint32_t lanes[8];
  x.store(lanes);
  return lanes[0];
}

}  // namespace

Media8 CompiledScene::media_at(const Vec3& point, const Vec3& direction) const {
  const M8 lane = first_lanes(1);
  Ray8 ray{broadcast(point), broadcast(direction), F8(std::numeric_limits<float>::infinity())};
  std::map<std::uint32_t, int> balance;     // by medium: entries minus exits
  std::vector<std::uint32_t> around_point;  // innermost first
  constexpr int kMaxSurfaces = 100'000;
  for (int i = 0; i < kMaxSurfaces && Accel::traceable(ray).bits() & 1; ++i) {
    const Hit8 hit = accel_->intersect(lane, ray, false);
    if (hit.hit.none()) {
      break;
    }
    const Surface8 left = surface(ray, hit);
    const bool front = left.front.any();
    if (const std::uint32_t medium = first_lane(media_.of_material(left.material, lane)); medium != 0) {
      balance[medium] += front ? 1 : -1;
      if (balance[medium] < 0) {
        balance[medium] = 0;
        around_point.push_back(medium);
      }
    }
    const V8 onward = front ? -left.geometric_normal : left.geometric_normal;
    ray.origin = left.point + onward * left.offset;
  }
  Media8 media;
  for (auto medium = around_point.rbegin(); medium != around_point.rend(); ++medium) {
    media = MediumTable::entered(media, U8(*medium));
  }
  return media;
}

}  // namespace lightmill
