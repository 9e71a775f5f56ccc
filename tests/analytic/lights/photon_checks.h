// Helpers for tests of photon emission: flux through a target, by photons and by next-event estimation.
#pragma once

#include <limits>
#include <optional>

#include "common/lights/photon_emission.h"
#include "tests/analytic/lights/light_checks.h"

namespace lightmill::test {

inline const Vec3 kColor{1, 2, 0.5f};
inline constexpr double kSceneRadius = 20;
inline const BoundingSphere kEverything{{0, 0, 0}, std::numeric_limits<double>::infinity()};

template <class Add>
LightTable table_of(Add add) {
  LightTable table;
  add(table);
  table.build();
  return table;
}

/// A ray in double precision.
struct PhotonRay {
  Vec3d origin, direction;
};

struct Quad {
  Vec3d corner, edge1, edge2;
  bool hit(const PhotonRay& ray) const {
    const Vec3d n = glm::cross(edge1, edge2);
    const double across = glm::dot(ray.direction, n);
    const double t = glm::dot(corner - ray.origin, n) / across;
    const Vec3d d = ray.origin + ray.direction * t - corner;
    const double u = glm::dot(glm::cross(d, edge2), n) / glm::dot(n, n);
    const double v = glm::dot(glm::cross(edge1, d), n) / glm::dot(n, n);
    return across != 0 && t > 0 && u >= 0 && u <= 1 && v >= 0 && v <= 1;
  }
};

/// Whether the ray meets the sphere from outside.
inline bool meets(const BoundingSphere& sphere, const PhotonRay& ray) {
  const Vec3d to_center = sphere.center - ray.origin;
  return glm::dot(to_center, ray.direction) > 0 && glm::length(glm::cross(to_center, ray.direction)) <= sphere.radius;
}

inline auto into(const BoundingSphere& sphere) {
  return [sphere](const PhotonRay& ray) { return meets(sphere, ray); };
}

struct Mean {
  Vec3d value{0};
  Vec3d error{0};  ///< standard error
};

struct Moments {
  Vec3d sum{0}, squares{0};
  double count = 0;
  void add(const Vec3d& x) {
    sum += x;
    squares += x * x;
    count += 1;
  }
  Mean mean() const {
    const Vec3d value = sum / count;
    const Vec3d variance = glm::max(squares / count - value * value, Vec3d(0));
    return {value, glm::sqrt(variance / count)};
  }
};

/// Calls take(ray, power, light) for independent photons. Photons without light have no power.
template <class Take>
void for_each_photon(const PhotonEmission& emission, std::uint32_t seed, Take take, int count = kDraws) {
  for (int i = 0; i < count; i += 8) {
    const U8 index = U8(static_cast<std::uint32_t>(i)) + U8::lane_index();
    const auto pair = [&](std::uint32_t decision) { return hashed_pair(index, U8(mix(seed ^ (decision * 0x51a3u)))); };
    const PhotonEmission::Photon8 photon = emission.emit(pair(1), pair(2), pair(3));
    const VectorLanes origin(photon.origin), direction(photon.direction), power(photon.power);
    alignas(32) std::uint32_t light[8];
    photon.light.store(light);
    for (int lane = 0; lane < 8; ++lane) {
      const bool valid = (photon.valid.bits() >> lane & 1) != 0;
      take(PhotonRay{origin[lane], direction[lane]}, valid ? power[lane] : Vec3d(0), light[lane]);
    }
  }
}

/// Flux of all photons with meets(ray), or of those of one light.
template <class Meets>
Mean photon_flux(const PhotonEmission& emission, std::uint32_t seed, Meets meets,
                 std::optional<std::uint32_t> of_light = {}) {
  Moments moments;
  for_each_photon(emission, seed, [&](const PhotonRay& ray, const Vec3d& power, std::uint32_t light) {
    const bool counts = (!of_light || light == *of_light) && power != Vec3d(0) && meets(ray);
    moments.add(counts ? power : Vec3d(0));
  });
  return moments.mean();
}

/// Flux through a quad from both sides, by light samples at points of it. Nothing blocks the light.
inline Mean sampled_flux(const LightTable& table, std::uint32_t seed, const Quad& quad) {
  const Vec3d n = glm::cross(quad.edge1, quad.edge2);
  const double area = glm::length(n);
  Moments moments;
  for (int i = 0; i < kDraws; i += 8) {
    const U8 index = U8(static_cast<std::uint32_t>(i)) + U8::lane_index();
    const Pair8 place = sobol_pair(index, U8(mix(seed ^ 0x77u)));
    const V8 p =
        broadcast(Vec3(quad.corner)) + broadcast(Vec3(quad.edge1)) * place.u + broadcast(Vec3(quad.edge2)) * place.v;
    V8 sum;
    for (std::uint32_t draw = 0; draw < table.draws(); ++draw) {
      const LightSample8 s = table.sample(p, draw, hashed_pair(index, U8(mix(seed ^ 0x99u))),
                                          hashed_pair(index, U8(mix(seed + 0x1234u * draw))));
      sum = sum + masked(s.valid, s.weight * abs(dot(s.wi, broadcast(Vec3(n / area)))));
    }
    const VectorLanes value(sum);
    for (int lane = 0; lane < 8; ++lane) {
      moments.add(value[lane] * area);
    }
  }
  return moments.mean();
}

/// In every channel, within 5 standard errors of both values and the loss of single precision. This raises a false
/// alarm once in 1.7 million channels.
inline void expect_flux(const Mean& flux, const Mean& expected, double precision = 2e-5) {
  for (int c = 0; c < 3; ++c) {
    const double error = std::hypot(flux.error[c], expected.error[c]);
    EXPECT_NEAR(flux.value[c], expected.value[c], 5 * error + precision * expected.value[c]) << "channel " << c;
  }
}

}  // namespace lightmill::test
