#include "common/scene/compiled/learn_light_visibility.h"

#include "common/sampling/sobol.h"
#include "common/sampling/warp.h"

namespace lightmill {
namespace {

constexpr std::uint32_t kFewPaths = 1u << 9;  ///< to see whether there is anything to gain
constexpr std::uint32_t kPaths = 1u << 12;
constexpr std::uint32_t kVertices = 3;  ///< of a path, after the camera or meter
constexpr double kLeastGain = 1.5;
constexpr int kMostPassed = 16;  ///< surfaces; further ones block no light

/// The vertices of eight paths, and a sample of the light of each group.
struct Vertices8 {
  std::size_t batch;  ///< number of the eight paths
  V8 point, normal;
  M8 lanes;
  std::array<M8, LightVisibility::kMaxGroups> tested;
  std::array<F8, LightVisibility::kMaxGroups> light;  ///< that arrives

  void append_to(std::vector<LightVisibility::Sample>& samples, std::size_t groups) const {
    const VectorLanes points(point);
    for (int lane = 0; lane < 8; ++lane) {
      if ((lanes.bits() >> lane & 1) == 0) {
        continue;
      }
      LightVisibility::Sample& s = samples.emplace_back(LightVisibility::Sample{Vec3(points[lane])});
      for (std::size_t group = 0; group < groups; ++group) {
        s.tested |= static_cast<std::uint32_t>(tested[group].bits() >> lane & 1) << group;
        s.visible |= static_cast<std::uint32_t>((light[group] > F8(0.0f)).bits() >> lane & 1) << group;
      }
    }
  }
};

F8 luminance(const V8& rgb) {
  return rgb.x * F8(0.2126f) + rgb.y * F8(0.7152f) + rgb.z * F8(0.0722f);
}

class Learner {
 public:
  explicit Learner(const CompiledScene& scene) : scene_(scene), groups_(scene.lights().choice().entries()) {}

  LightVisibility learn() {
    for (const std::uint32_t paths : {kFewPaths, kPaths}) {
      for (; traced_ < paths; traced_ += 8) {
        trace(U8(traced_) + U8::lane_index());
      }
      if (gain() < kLeastGain) {
        return {};
      }
    }
    return learned_from([](std::size_t) { return true; });
  }

 private:
  void trace(U8 index) {
    if (traced_ / 8 % 2 == 1 && !scene_.meters().empty()) {
      follow(meter_rays(index), index);
      return;
    }
    const Pair8 film = sobol_pair(index, U8(mix(kFilm)));
    follow(scene_.camera().rays(film.u * F8(static_cast<float>(scene_.film_width())),
                                film.v * F8(static_cast<float>(scene_.film_height()))),
           index);
  }

  /// Rays from one meter a lane. Adds the places on meters that receive light.
  Ray8 meter_rays(U8 index) {
    const MeterTable& meters = scene_.meters();
    alignas(32) float which[8], u[8], v[8];
    hashed_number(index, U8(mix(kMeter))).store(which);
    const Pair8 place = hashed_pair(index, U8(mix(kMeter + 1)));
    place.u.store(u);
    place.v.store(v);
    alignas(32) std::array<std::array<float, 8>, 7> rows{};
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const CompiledMeter& meter = meters[static_cast<std::size_t>(which[lane] * static_cast<float>(meters.size()))];
      const Vec3 point = meter.middle() + meter.edge1 * (u[lane] - 0.5f) + meter.edge2 * (v[lane] - 0.5f);
      for (int axis = 0; axis < 3; ++axis) {
        rows[static_cast<std::size_t>(axis)][lane] = point[axis];
        rows[static_cast<std::size_t>(axis) + 3][lane] = meter.direction[axis];
      }
      rows[6][lane] = meter.measures_radiance ? 0 : 1;
    }
    const auto vector = [&](std::size_t first) {
      return V8{F8::load(rows[first].data()), F8::load(rows[first + 1].data()), F8::load(rows[first + 2].data())};
    };
    const V8 origin = vector(0), direction = vector(3);
    const M8 lanes = F8::load(rows[6].data()) > F8(0.0f);  // meters on surfaces
    add(origin, direction, lanes, index, kVertices);
    Ray8 rays = scattered(origin, direction, index, kVertices);
    rays.direction = select(lanes, rays.direction, direction);
    return rays;
  }

  static Ray8 scattered(const V8& origin, const V8& normal, U8 index, std::uint32_t vertex) {
    const V8 local = square_to_cosine_hemisphere(hashed_pair(index, U8(mix(kScatter + vertex))));
    return {origin, Frame8(normal).to_world(local), F8(std::numeric_limits<float>::infinity())};
  }

  void follow(Ray8 rays, U8 index) {
    M8 lanes(true);
    for (std::uint32_t vertex = 0; vertex < kVertices; ++vertex) {
      const Hit8 hit = scene_.accel().intersect(lanes & Accel::traceable(rays), rays, false);
      lanes = hit.hit;
      if (lanes.none()) {
        return;
      }
      const Surface8 surface = scene_.surface(rays, hit);
      const V8 normal = select(surface.front, surface.geometric_normal, -surface.geometric_normal);
      const V8 origin = surface.point + normal * surface.offset;
      add(origin, normal, lanes, index, vertex);
      rays = scattered(origin, normal, index, vertex);
    }
  }

  void add(const V8& origin, const V8& normal, M8 lanes, U8 index, std::uint32_t vertex) {
    Vertices8& out = vertices_.emplace_back();
    out.batch = traced_ / 8;
    out.point = origin;
    out.normal = normal;
    out.lanes = lanes;
    for (std::size_t group = 0; group < groups_; ++group) {
      const std::uint32_t number =
          kLight + 2 * (vertex * LightVisibility::kMaxGroups + static_cast<std::uint32_t>(group));
      const LightSample8 s = scene_.lights().sample_entry(group, origin, hashed_pair(index, U8(mix(number))),
                                                          hashed_pair(index, U8(mix(number + 1))));
      const F8 cosine = dot(normal, s.wi);
      const M8 tested = lanes & s.valid & (cosine > F8(0.0f));
      const M8 visible = and_not(tested, blocked(tested, {origin, s.point - origin, F8(1.0f)}));
      out.tested[group] = tested;
      out.light[group] = masked(visible, luminance(s.weight) * cosine);
    }
  }

  /// Surfaces that rays may pass block no light.
  M8 blocked(M8 lanes, const Ray8& rays) const {
    M8 left = lanes & Accel::traceable(rays), blocked;
    if (!scene_.features().opacity) {
      return scene_.accel().occluded(left, rays);
    }
    F8 passed(0.0f);
    for (int i = 0; i < kMostPassed && left.any(); ++i) {
      const Hit8 hit = scene_.accel().intersect(left, rays, false, passed);
      left = scene_.may_pass(hit, hit.hit);
      blocked = blocked | and_not(hit.hit, left);
      passed = select(left, hit.distance * F8(1 + 0x1p-12f), passed);  // not the same surface again
    }
    return blocked;
  }

  /// `take`: whether to use the paths of a batch.
  template <class Take>
  LightVisibility learned_from(Take take) const {
    std::vector<LightVisibility::Sample> samples;
    for (const Vertices8& v : vertices_) {
      if (take(v.batch)) {
        v.append_to(samples, groups_);
      }
    }
    return LightVisibility(samples, groups_);
  }

  /// The second moment of the choice without visibilities, over that with visibilities: sums of relative second moments.
  /// Those of each half of the batches are learned from the other half.
  double gain() const {
    const LightChoice& choice = scene_.lights().choice();
    const auto half = [](std::size_t batch) { return batch / 2 % 2; };  // batches of meters are odd ones
    std::array<LightVisibility, 2> of_others;
    for (const std::size_t i : {0, 1}) {
      of_others[i] = learned_from([&](std::size_t batch) { return half(batch) != i; });
    }
    double before = 0, after = 0;
    for (const Vertices8& v : vertices_) {
      const LightChoice::Entries8 p = choice.probabilities(v.point, v.normal, LightVisibility()),
                                  q = choice.probabilities(v.point, v.normal, of_others[half(v.batch)]);
      F8 sum(0.0f), by_p(0.0f), by_q(0.0f);
      for (std::size_t group = 0; group < groups_; ++group) {
        const M8 lit = v.light[group] > F8(0.0f);
        const F8 square = v.light[group] * v.light[group];
        sum += v.light[group];
        by_p += masked(lit, square / p[group]);
        by_q += masked(lit, square / q[group]);
      }
      const F8 scale = masked(sum > F8(0.0f), F8(1.0f) / (sum * sum));
      before += sum_of_lanes(by_p * scale);
      after += sum_of_lanes(by_q * scale);
    }
    return after > 0 ? before / after : 1;
  }

  static double sum_of_lanes(F8 x) {
    alignas(32) float lanes[8];
    x.store(lanes);
    double sum = 0;
    for (const float lane : lanes) {
      sum += lane;
    }
    return sum;
  }

  // Seeds of the random numbers.
  static constexpr std::uint32_t kFilm = 0x51a7e001, kScatter = 0x51a7e100, kMeter = 0x51a7e200, kLight = 0x51a7f000;

  const CompiledScene& scene_;
  std::size_t groups_;
  std::uint32_t traced_ = 0;  ///< paths
  std::vector<Vertices8> vertices_;
};

}  // namespace

LightVisibility learn_light_visibility(const CompiledScene& scene) {
  return Learner(scene).learn();
}

}  // namespace lightmill
