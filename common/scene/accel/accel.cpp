#include "common/scene/accel/accel.h"

#include <embree3/rtcore.h>

#include <new>
#include <system_error>
#include <type_traits>

#include "common/base/check.h"
#include "common/scene/accel/brute_force.h"

namespace lightmill {
namespace {

/// A deleter for Embree's handles.
template <auto release>
struct Release {
  template <class T>
  void operator()(T* handle) const {
    release(handle);
  }
};
using OwnScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release<rtcReleaseScene>>;
using OwnGeometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release<rtcReleaseGeometry>>;

/// Throws if Embree could not create the object, for lack of memory or threads.
template <class T>
T* made(T* handle) {
  return handle != nullptr ? handle : throw std::bad_alloc();
}

/// Throws if the error means a lack of memory or threads. Embree reports exceptions of other libraries as unknown, such
/// as a thread that cannot start.
void throw_if_exhausted(RTCError error) {
  if (error == RTC_ERROR_OUT_OF_MEMORY) {
    throw std::bad_alloc();
  }
  if (error == RTC_ERROR_UNKNOWN) {
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again), "Embree");
  }
}

RTCDevice new_device() {
  // There are no subdivision surfaces. Embree would reserve 128 MiB for them.
  const RTCDevice device = rtcNewDevice("isa=avx2,threads=1,user_threads=1,tessellation_cache_size=0");
  if (device == nullptr) {
    const RTCError error = rtcGetDeviceError(nullptr);
    throw_if_exhausted(error);
    LM_CHECK(error != RTC_ERROR_UNSUPPORTED_CPU, "Embree needs AVX2, which this processor does not have");
    LM_CHECK(false, "Embree gives no device, error {}", static_cast<int>(error));
  }
  return device;
}

/// One device for all scenes, because TBB starts new threads for each device. It is never released. Its errors are per
/// thread.
RTCDevice device() {
  static const RTCDevice the_device = new_device();
  return the_device;
}

void store(const V8& v, float* x, float* y, float* z) {
  v.x.store(x);
  v.y.store(y);
  v.z.store(z);
}

}  // namespace

struct Accel::State {
  explicit State(RTCSceneFlags own_flags) : flags(own_flags), scene(new_scene()) {}

  RTCSceneFlags flags;
  OwnScene scene;
  std::uint32_t geometries = 0;
  std::vector<OwnScene> prototypes;
  struct Plane {
    std::uint32_t geometry;
    Vec3 point, normal;
  };
  std::unique_ptr<BruteForce> brute_force;  ///< instead of the scene
  std::vector<Plane> planes;                ///< Embree has no planes: they are tested after it

  OwnScene new_scene() const {
    OwnScene result(made(rtcNewScene(device())));
    rtcSetSceneFlags(result.get(), flags);
    rtcSetSceneBuildQuality(result.get(), RTC_BUILD_QUALITY_MEDIUM);
    return result;
  }

  static void attach_to(const OwnScene& scene, const OwnGeometry& geometry, std::uint32_t id) {
    rtcSetGeometryBuildQuality(geometry.get(), RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene.get(), geometry.get(), id);
  }
  std::uint32_t attach(const OwnGeometry& geometry) {
    attach_to(scene, geometry, geometries);
    return geometries++;
  }

  static OwnGeometry new_geometry(RTCGeometryType type) { return OwnGeometry(made(rtcNewGeometry(device(), type))); }

  static OwnGeometry new_mesh(std::span<const std::array<float, 3>> positions,
                              std::span<const std::array<std::uint32_t, 3>> triangles) {
    OwnGeometry geometry = new_geometry(RTC_GEOMETRY_TYPE_TRIANGLE);
    const auto buffer = [&](RTCBufferType type, RTCFormat format, std::size_t count) {
      return made(rtcSetNewGeometryBuffer(geometry.get(), type, 0, format, 12, count));
    };
    std::memcpy(buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, positions.size()), positions.data(),
                positions.size_bytes());
    std::memcpy(buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles.size()), triangles.data(),
                triangles.size_bytes());
    return geometry;
  }

  /// Distance to a plane along each ray, beyond `min_distance`. Infinite if the ray does not meet the plane there.
  static F8 plane_distance(const Plane& plane, const Ray8& rays, F8 min_distance = F8(0.0f)) {
    const V8 normal = broadcast(plane.normal);
    const F8 t = dot(normal, broadcast(plane.point) - rays.origin) / dot(normal, rays.direction);
    return select(t > min_distance, t, F8(std::numeric_limits<float>::infinity()));
  }

  Hit8 intersect(M8 lanes, const Ray8& rays, bool coherent, F8 min_distance) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;

    alignas(32) int valid[8];
    _mm256_store_si256(reinterpret_cast<__m256i*>(valid), lanes.i());
    RTCRayHit8 query;
    store(rays.origin, query.ray.org_x, query.ray.org_y, query.ray.org_z);
    store(rays.direction, query.ray.dir_x, query.ray.dir_y, query.ray.dir_z);
    min_distance.store(query.ray.tnear);
    F8(0.0f).store(query.ray.time);
    rays.max_distance.store(query.ray.tfar);
    U8(0xffffffffu).store(query.ray.mask);
    U8(0u).store(query.ray.flags);
    U8(RTC_INVALID_GEOMETRY_ID).store(query.hit.geomID);
    U8(RTC_INVALID_GEOMETRY_ID).store(query.hit.instID[0]);
    rtcIntersect8(valid, scene.get(), &context, &query);

    // A hit of an instance has the instance's number instead of the prototype's.
    const U8 instance = U8::load(query.hit.instID[0]);
    const U8 none(RTC_INVALID_GEOMETRY_ID);
    const U8 shape = U8::load(query.hit.geomID);
    return {and_not(lanes, shape == none),
            F8::load(query.ray.tfar),
            {F8::load(query.hit.Ng_x), F8::load(query.hit.Ng_y), F8::load(query.hit.Ng_z)},
            F8::load(query.hit.u),
            F8::load(query.hit.v),
            select(instance == none, shape, instance),
            U8::load(query.hit.primID)};
  }

  M8 occluded(M8 lanes, const Ray8& rays) const {
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
    rtcOccluded8(valid, scene.get(), &context, &query);
    return lanes & (F8::load(query.tfar) < F8(0.0f));  // Embree sets it to −∞ on a hit
  }
};

Accel::Accel(Kind kind)
    : state_(std::make_unique<State>(kind == Kind::robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE)) {
  rtcGetDeviceError(device());  // clears the error of an earlier scene
  if (kind == Kind::brute_force) {
    state_->brute_force = std::make_unique<BruteForce>();
  }
}

Accel::~Accel() = default;

std::uint32_t Accel::add_mesh(std::span<const std::array<float, 3>> positions,
                              std::span<const std::array<std::uint32_t, 3>> triangles) {
  if (state_->brute_force != nullptr) {
    state_->brute_force->add_mesh(state_->geometries, positions, triangles);
    return state_->geometries++;
  }
  return state_->attach(State::new_mesh(positions, triangles));
}

std::uint32_t Accel::add_prototype(std::span<const std::array<float, 3>> positions,
                                   std::span<const std::array<std::uint32_t, 3>> triangles) {
  if (state_->brute_force != nullptr) {
    return state_->brute_force->add_prototype(positions, triangles);
  }
  OwnScene scene = state_->new_scene();
  State::attach_to(scene, State::new_mesh(positions, triangles), 0);
  rtcCommitScene(scene.get());
  state_->prototypes.push_back(std::move(scene));
  return static_cast<std::uint32_t>(state_->prototypes.size() - 1);
}

std::uint32_t Accel::add_instance(std::uint32_t prototype, const std::array<std::array<float, 4>, 3>& to_scene) {
  if (state_->brute_force != nullptr) {
    state_->brute_force->add_instance(state_->geometries, prototype, to_scene);
    return state_->geometries++;
  }
  const OwnGeometry geometry = State::new_geometry(RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry.get(), state_->prototypes[prototype].get());
  rtcSetGeometryTimeStepCount(geometry.get(), 1);
  rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, to_scene.data());
  return state_->attach(geometry);
}

std::uint32_t Accel::add_plane(const Vec3& point, const Vec3& normal) {
  state_->planes.push_back({state_->geometries, point, normal});
  return state_->geometries++;
}

std::uint32_t Accel::add_sphere(const Vec3& center, float radius) {
  if (state_->brute_force != nullptr) {
    state_->brute_force->add_sphere(state_->geometries, center, radius);
    return state_->geometries++;
  }
  const OwnGeometry geometry = State::new_geometry(RTC_GEOMETRY_TYPE_SPHERE_POINT);
  const std::array<float, 4> values{center.x, center.y, center.z, radius};
  std::memcpy(made(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, 1)),
              values.data(), sizeof(values));
  return state_->attach(geometry);
}

Status Accel::commit() {
  rtcCommitScene(state_->scene.get());
  const RTCError error = rtcGetDeviceError(device());
  throw_if_exhausted(error);
  return error == RTC_ERROR_NONE
             ? ok_status()
             : internal_error("Embree error {} while building the ray hierarchy", static_cast<int>(error));
}

Hit8 Accel::intersect(M8 lanes, const Ray8& rays, bool coherent, F8 min_distance) const {
  lanes = lanes & traceable(rays);
  Hit8 hit = state_->brute_force != nullptr ? state_->brute_force->intersect(lanes, rays, min_distance)
                                            : state_->intersect(lanes, rays, coherent, min_distance);
  for (const State::Plane& plane : state_->planes) {
    const F8 t = State::plane_distance(plane, rays, min_distance);
    const M8 nearer = lanes & (t < hit.distance);
    hit.hit = hit.hit | nearer;
    hit.distance = select(nearer, t, hit.distance);
    hit.normal = select(nearer, broadcast(plane.normal), hit.normal);
    hit.geometry = select(nearer, U8(plane.geometry), hit.geometry);
    hit.primitive = select(nearer, U8(0u), hit.primitive);
  }
  return hit;
}

M8 Accel::occluded(M8 lanes, const Ray8& rays) const {
  lanes = lanes & traceable(rays);
  M8 hit = state_->brute_force != nullptr ? state_->brute_force->occluded(lanes, rays) : state_->occluded(lanes, rays);
  for (const State::Plane& plane : state_->planes) {
    hit = hit | (lanes & (State::plane_distance(plane, rays) < rays.max_distance));
  }
  return hit;
}

}  // namespace lightmill
