#include "common/materials/sheen.h"

#include "common/materials/sheen_layout.h"
#include "common/materials/table_lookup.h"

namespace lightmill::sheen {
namespace {

#include "sheen_tables.inc"

F8 look_up(const float* table, F8 cos_theta, F8 roughness) {
  return interpolate(table, place(roughness_coordinate(roughness), kRoughnesses),
                     place(sqrt(max(cos_theta, F8(0.0f))), kAngles), kAngles);
}

}  // namespace

F8 limit(F8 cos_theta, F8 roughness) {
  return look_up(kLimit, cos_theta, roughness);
}

F8 albedo(F8 cos_theta, F8 roughness) {
  return look_up(kAlbedo, cos_theta, roughness);
}

F8 mean_albedo(F8 roughness) {
  return interpolate(kMean, place(roughness_coordinate(roughness), kRoughnesses));
}

}  // namespace lightmill::sheen
