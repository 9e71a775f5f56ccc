#include "tests/support/reference_tracer.h"

#include <embree3/rtcore.h>

#include <cmath>

#include "common/base/check.h"
#include "common/math/vec.h"

namespace lightmill::test {
namespace {

constexpr float kPi = 3.14159265f;

/// PCG32, O'Neill 2014.
struct Random {
  std::uint64_t state, stream;
  Random(std::uint64_t seed, std::uint64_t sequence) : state(0), stream(sequence << 1 | 1) {
    next();
    state += seed;
    next();
  }
  std::uint32_t next() {
    const std::uint64_t old = state;
    state = old * 6364136223846793005ull + stream;
    const auto x = static_cast<std::uint32_t>((old >> 18 ^ old) >> 27);
    return std::rotr(x, static_cast<int>(old >> 59));
  }
  float unit() { return static_cast<float>(next() >> 8) * 0x1p-24f; }
};

Vec3 rgb(const RgbColor& c) {
  return {c.r, c.g, c.b};
}
float max3(const Vec3& v) {
  return std::max(v.x, std::max(v.y, v.z));
}

Vec3 around(const Vec3& n, float x, float y, float z) {
  const Vec3 s = glm::normalize(std::abs(n.x) > 0.5f ? Vec3(-n.y, n.x, 0) : Vec3(0, -n.z, n.y));
  return s * x + glm::cross(n, s) * y + n * z;
}

struct LightTriangle {
  Vec3 p, e1, e2, normal, radiance;
  float area;
  bool two_sided;
};

struct Shape {
  std::uint32_t material;
  const SphereShape* sphere;
  std::vector<std::array<float, 3>> normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace

struct ReferenceTracer::State {
  Scene scene;
  RTCDevice device = rtcNewDevice("isa=avx2,threads=1");
  RTCScene rtc = rtcNewScene(device);
  std::vector<Shape> shapes;
  std::vector<LightTriangle> lights;
  float light_area = 0;

  ~State() {
    rtcReleaseScene(rtc);
    rtcReleaseDevice(device);
  }

  void add_mesh(const Mesh& mesh, const Material& material) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
    for (const auto& p : mesh.positions) {
      for (const double x : p) {
        *v++ = static_cast<float>(x);
      }
    }
    std::memcpy(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()),
        mesh.triangles.data(), mesh.triangles.size() * 12);
    attach(geometry);
    if (max3(rgb(material.emission.rgb)) > 0) {
      for (const auto& t : mesh.triangles) {
        const auto at = [&](int i) {
          return Vec3(mesh.positions[t[i]][0], mesh.positions[t[i]][1], mesh.positions[t[i]][2]);
        };
        const Vec3 c = glm::cross(at(1) - at(0), at(2) - at(0));
        lights.push_back({at(0), at(1) - at(0), at(2) - at(0), glm::normalize(c), rgb(material.emission.rgb),
                          glm::length(c) / 2, material.two_sided_emission});
        light_area += lights.back().area;
      }
    }
  }

  void attach(RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(rtc, geometry);
    rtcReleaseGeometry(geometry);
  }

  bool blocked(const Vec3& from, const Vec3& to) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const Vec3 d = to - from;
    RTCRay ray{from.x, from.y, from.z, 1e-5f, d.x, d.y, d.z, 0, 1 - 1e-4f, 0xffffffff, 0, 0};
    rtcOccluded1(rtc, &context, &ray);
    return ray.tfar < 0;
  }

  /// Direct light at p, times the cosine, for a diffuse surface.
  Vec3 direct(const Vec3& p, const Vec3& n, Random& random) const {
    Vec3 sum(0);
    if (!lights.empty()) {
      float pick = random.unit() * light_area;
      std::size_t i = 0;
      while (i + 1 < lights.size() && pick >= lights[i].area) {
        pick -= lights[i++].area;
      }
      const LightTriangle& light = lights[i];
      const float root = std::sqrt(random.unit());
      const float b = random.unit() * root;
      const Vec3 y = light.p + light.e1 * (1 - root) + light.e2 * b;
      const Vec3 d = y - p;
      const float distance2 = glm::dot(d, d);
      const Vec3 wi = d / std::sqrt(distance2);
      float cos_light = -glm::dot(wi, light.normal);
      cos_light = light.two_sided ? std::abs(cos_light) : cos_light;
      const float cos_surface = glm::dot(wi, n);
      if (cos_light > 0 && cos_surface > 0 && !blocked(p, y)) {
        sum += light.radiance * (cos_surface * cos_light * light_area / distance2);
      }
    }
    for (const Light& any : scene.lights) {
      const PointLight& light = std::get<PointLight>(any.kind);
      const Vec3 d = Vec3(light.position[0], light.position[1], light.position[2]) - p;
      const float distance2 = glm::dot(d, d);
      const float cos_surface = glm::dot(d, n) / std::sqrt(distance2);
      if (cos_surface > 0 && !blocked(p, p + d)) {
        sum += rgb(light.intensity) * (cos_surface / distance2);
      }
    }
    return sum;
  }

  Vec3 trace(Vec3 o, Vec3 d, Random& random, std::uint32_t max_bounces) const {
    Vec3 radiance(0), throughput(1);
    bool count_emission = true;
    for (std::uint32_t bounce = 0;; ++bounce) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      RTCRayHit query{{o.x, o.y, o.z, 0, d.x, d.y, d.z, 0, 1e30f, 0xffffffff, 0, 0}, {}};
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(rtc, &context, &query);
      if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        return radiance;
      }
      const Shape& shape = shapes[query.hit.geomID];
      const Material& material = scene.materials[shape.material];
      Vec3 p = o + d * query.ray.tfar;
      Vec3 ng = glm::normalize(Vec3(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z));
      if (shape.sphere != nullptr) {
        const Vec3 c(shape.sphere->center[0], shape.sphere->center[1], shape.sphere->center[2]);
        ng = glm::normalize(p - c);
        p = c + ng * static_cast<float>(shape.sphere->radius);
        ng = shape.sphere->normal_inward ? -ng : ng;
      }
      const bool front = glm::dot(d, ng) < 0;
      // A sphere is not in the table of lights, so only the path finds its light.
      if ((count_emission || shape.sphere != nullptr) && (front || material.two_sided_emission)) {
        radiance += throughput * rgb(material.emission.rgb);
      }
      if (max_bounces != 0 && bounce == max_bounces) {
        return radiance;
      }
      Vec3 ns = ng;
      if (!shape.normals.empty()) {
        const auto& t = shape.triangles[query.hit.primID];
        const auto at = [&](int i) {
          return Vec3(shape.normals[t[i]][0], shape.normals[t[i]][1], shape.normals[t[i]][2]);
        };
        const float u = query.hit.u, v = query.hit.v;
        ns = glm::normalize(at(0) * (1 - u - v) + at(1) * u + at(2) * v);
        ns = glm::dot(ns, ng) < 0 ? -ns : ns;
        ns = (glm::dot(d, ns) < 0) == front ? ns : ng;
      }
      const Vec3 n = front ? ns : -ns;
      const Vec3 side = front ? ng : -ng;
      const float epsilon = 2e-6f * (max3(glm::abs(p)) + query.ray.tfar);
      const float cos_o = -glm::dot(d, n);
      count_emission = true;
      if (const auto* diffuse = std::get_if<DiffuseMaterial>(&material.kind)) {
        const Vec3 albedo = rgb(diffuse->reflectance.rgb);
        if (max3(albedo) == 0) {
          return radiance;
        }
        o = p + side * epsilon;
        radiance += throughput * albedo * direct(o, n, random) / kPi;
        const float r2 = random.unit(), phi = 2 * kPi * random.unit();
        d = around(n, std::sqrt(r2) * std::cos(phi), std::sqrt(r2) * std::sin(phi), std::sqrt(1 - r2));
        throughput *= albedo;
        count_emission = false;
        if (glm::dot(d, side) <= 0) {
          return radiance;
        }
      } else if (const auto* mirror = std::get_if<MirrorMaterial>(&material.kind)) {
        d = d + n * (2 * cos_o);
        o = p + side * epsilon;
        throughput *= rgb(mirror->reflectance.rgb);
        if (glm::dot(d, side) <= 0) {
          return radiance;
        }
      } else {
        const auto ior = static_cast<float>(std::get<DielectricMaterial>(material.kind).ior);
        const float eta = front ? ior : 1 / ior;
        const float sin2_t = (1 - cos_o * cos_o) / (eta * eta);
        float reflectance = 1, cos_t = 0;
        if (sin2_t < 1) {
          cos_t = std::sqrt(1 - sin2_t);
          const float s = (cos_o - eta * cos_t) / (cos_o + eta * cos_t),
                      q = (eta * cos_o - cos_t) / (eta * cos_o + cos_t);
          reflectance = (s * s + q * q) / 2;
        }
        if (random.unit() < reflectance) {
          d = d + n * (2 * cos_o);
          o = p + side * epsilon;
        } else {
          d = d / eta + n * (cos_o / eta - cos_t);
          o = p - side * epsilon;
          throughput /= eta * eta;
        }
      }
      if (bounce >= 1) {
        const float survival = std::min(1.0f, max3(throughput));
        if (random.unit() >= survival) {
          return radiance;
        }
        throughput /= survival;
      }
    }
  }
};

ReferenceTracer::ReferenceTracer(const Scene& scene, const AssetSource& assets) : state_(std::make_unique<State>()) {
  state_->scene = scene;
  for (const Object& object : state_->scene.objects) {
    const Material& material = state_->scene.materials[object.material];
    if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
      const RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
      auto* v =
          static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, 1));
      for (int i = 0; i < 3; ++i) {
        v[i] = static_cast<float>(sphere->center[i]);
      }
      v[3] = static_cast<float>(sphere->radius);
      state_->attach(geometry);
      state_->shapes.push_back({object.material, sphere, {}, {}});
    } else {
      const auto bytes = assets(std::get<MeshShape>(object.shape).asset);
      LM_CHECK(bytes.ok());
      const auto mesh = decode_mesh(as_byte_view(*bytes));
      LM_CHECK(mesh.ok());
      state_->add_mesh(*mesh, material);
      state_->shapes.push_back({object.material, nullptr, mesh->normals, mesh->triangles});
    }
  }
  rtcCommitScene(state_->rtc);
}

ReferenceTracer::~ReferenceTracer() = default;

std::vector<float> ReferenceTracer::render(const PixelRect& rect, int samples, std::uint64_t seed,
                                           std::uint32_t max_bounces) const {
  const auto vec = [](const Point3d& p) { return Vec3(p[0], p[1], p[2]); };
  const Camera& camera = state_->scene.camera;
  const FilmSettings& film = state_->scene.film;
  const Vec3 forward = glm::normalize(vec(camera.look_at) - vec(camera.eye));
  const Vec3 right = glm::normalize(glm::cross(forward, vec(camera.up)));
  const Vec3 down = glm::cross(forward, right);
  const float pixel =
      2 * std::tan(static_cast<float>(camera.vertical_fov_degrees) * kPi / 360) / static_cast<float>(film.height);
  std::vector<float> image;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      Random random(seed, static_cast<std::uint64_t>(y) * 65536 + x);
      glm::dvec3 sum(0);
      for (int sample = 0; sample < samples; ++sample) {
        const float dx = static_cast<float>(x) + random.unit() - static_cast<float>(film.width) / 2;
        const float dy = static_cast<float>(y) + random.unit() - static_cast<float>(film.height) / 2;
        const Vec3 d = glm::normalize(forward + right * (dx * pixel) + down * (dy * pixel));
        sum += state_->trace(vec(camera.eye), d, random, max_bounces);
      }
      for (int c = 0; c < 3; ++c) {
        image.push_back(static_cast<float>(sum[c] / samples));
      }
    }
  }
  return image;
}

}  // namespace lightmill::test
