#include "common/scene/accel/accel.h"

#include <embree3/rtcore.h>

#include "common/base/check.h"

namespace lightmill {
namespace {

void store(const V8& v, float* x, float* y, float* z) {
  v.x.store(x);
  v.y.store(y);
  v.z.store(z);
}

/// What Embree takes: finite, and so small that squares do not overflow (its FLT_LARGE). Beyond that it gives wrong
/// answers, or aborts where it was built with assertions.
M8 in_range(const V8& v) {
  const F8 limit(1.844e18f);
  return (abs(v.x) <= limit) & (abs(v.y) <= limit) & (abs(v.z) <= limit);
}

}  // namespace

struct Accel::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::uint32_t geometries = 0;

  ~State() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  std::uint32_t attach(RTCGeometry geometry) {
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, geometries);
    rtcReleaseGeometry(geometry);
    return geometries++;
  }
};

Accel::Accel(bool robust) : state_(std::make_unique<State>()) {
  state_->device = rtcNewDevice("isa=avx2,threads=1,user_threads=1");
  LM_CHECK(state_->device != nullptr, "Embree gives no device; does this processor have AVX2?");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  rtcSetSceneBuildQuality(state_->scene, RTC_BUILD_QUALITY_MEDIUM);
}

Accel::~Accel() = default;

std::uint32_t Accel::add_mesh(std::span<const std::array<float, 3>> positions,
                              std::span<const std::array<std::uint32_t, 3>> triangles) {
  const RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, positions.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size());
  if (vertices != nullptr && indices != nullptr) {  // else commit() reports the device's error
    std::memcpy(vertices, positions.data(), positions.size_bytes());
    std::memcpy(indices, triangles.data(), triangles.size_bytes());
  }
  return state_->attach(geometry);
}

std::uint32_t Accel::add_sphere(const Vec3& center, float radius) {
  const RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  auto* vertex =
      static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, 1));
  if (vertex != nullptr) {
    const std::array<float, 4> values{center.x, center.y, center.z, radius};
    std::copy(values.begin(), values.end(), vertex);
  }
  return state_->attach(geometry);
}

Status Accel::commit() {
  rtcCommitScene(state_->scene);
  if (const RTCError error = rtcGetDeviceError(state_->device); error != RTC_ERROR_NONE) {
    return error == RTC_ERROR_OUT_OF_MEMORY
               ? resource_exhausted("out of memory while building the ray hierarchy of {} shapes", state_->geometries)
               : internal_error("Embree error {} while building the ray hierarchy", static_cast<int>(error));
  }
  return ok_status();
}

M8 Accel::traceable(const Ray8& rays) {
  return in_range(rays.origin) & in_range(rays.direction) & (rays.max_distance >= F8(0.0f));
}

Hit8 Accel::intersect(M8 lanes, const Ray8& rays, bool coherent) const {
  lanes = lanes & traceable(rays);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;

  alignas(32) int valid[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(valid), lanes.i());
  RTCRayHit8 query;
  store(rays.origin, query.ray.org_x, query.ray.org_y, query.ray.org_z);
  store(rays.direction, query.ray.dir_x, query.ray.dir_y, query.ray.dir_z);
  F8(0.0f).store(query.ray.tnear);
  F8(0.0f).store(query.ray.time);
  rays.max_distance.store(query.ray.tfar);
  U8(0xffffffffu).store(query.ray.mask);
  U8(0u).store(query.ray.flags);
  U8(RTC_INVALID_GEOMETRY_ID).store(query.hit.geomID);
  U8(RTC_INVALID_GEOMETRY_ID).store(query.hit.instID[0]);
  rtcIntersect8(valid, state_->scene, &context, &query);

  const U8 geometry = U8::load(query.hit.geomID);
  return {and_not(lanes, geometry == U8(RTC_INVALID_GEOMETRY_ID)),
          F8::load(query.ray.tfar),
          {F8::load(query.hit.Ng_x), F8::load(query.hit.Ng_y), F8::load(query.hit.Ng_z)},
          F8::load(query.hit.u),
          F8::load(query.hit.v),
          geometry,
          U8::load(query.hit.primID)};
}

M8 Accel::occluded(M8 lanes, const Ray8& rays) const {
  lanes = lanes & traceable(rays);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);

  alignas(32) int valid[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(valid), lanes.i());
  RTCRay8 query;
  store(rays.origin, query.org_x, query.org_y, query.org_z);
  store(rays.direction, query.dir_x, query.dir_y, query.dir_z);
  F8(0.0f).store(query.tnear);
  F8(0.0f).store(query.time);
  rays.max_distance.store(query.tfar);
  U8(0xffffffffu).store(query.mask);
  U8(0u).store(query.flags);
  rtcOccluded8(valid, state_->scene, &context, &query);
  return lanes & (F8::load(query.tfar) < F8(0.0f));  // Embree sets it to −∞ where something was hit
}

}  // namespace lightmill
