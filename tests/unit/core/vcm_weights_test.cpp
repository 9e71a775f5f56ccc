// Recursive weights, compared with the balance heuristic on random paths.
#include "common/methods/vcm/weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace lightmill::vcm {
namespace {

float lane(F8 value) {
  alignas(32) float lanes[8];
  value.store(lanes);
  return lanes[0];
}

/// A path from a light via surfaces 1 … k to the camera. All densities of its strategies are drawn at random.
struct RandomPath {
  struct Vertex {
    double to_light_cosine, to_camera_cosine;  ///< of the directions to its neighbours
    double to_light_pdf, to_camera_pdf;        ///< of drawing the direction when coming from the other neighbour
    double merging;
    bool delta;
  };
  std::vector<Vertex> surface;    ///< from the light to the camera
  std::vector<double> distance2;  ///< before each surface, and to the camera: one more than surfaces
  double emission, drawn, light_cosine, film_pdf;
  bool delta_light;
  static constexpr double kLightPaths = 1000;

  RandomPath(int length, std::mt19937& engine) {
    const auto number = [&] { return static_cast<double>(engine() >> 8) * 0x1p-24; };  // [0, 1)
    const auto density = [&] { return std::exp(6 * number() - 3); };
    delta_light = engine() % 3 == 0;
    light_cosine = delta_light ? 1 : 0.05 + 0.95 * number();
    emission = density();
    drawn = density();
    film_pdf = 1e5 * density();
    distance2.push_back(density());
    for (int i = 0; i < length; ++i) {
      Vertex v{0.05 + 0.95 * number(), 0.05 + 0.95 * number(), density(), density(), density(), engine() % 4 == 0};
      if (v.delta) {
        v.to_camera_pdf = v.to_light_pdf;
      }
      surface.push_back(v);
      distance2.push_back(density());
    }
  }

  LightDensities8 light() const {
    const auto f = [](double x) { return F8(static_cast<float>(x)); };
    return {f(emission), f(drawn), f(light_cosine), M8(delta_light)};
  }
};

/// A strategy's density, and the weight that the recursion gives it.
struct Strategy {
  double density;
  double weight;
};

/// All strategies that can find the path: Veach 1997, eq. 10.3, and Georgiev et al. 2012, eq. 11 for merging.
std::vector<Strategy> strategies(const RandomPath& path) {
  const auto f = [](double x) { return F8(static_cast<float>(x)); };
  const std::size_t k = path.surface.size();
  // Densities by area of reaching each vertex from either end, and the recursion's partial sums there.
  std::vector<double> from_light(k), from_camera(k);
  std::vector<Partial8> light(k), camera(k);
  Partial8 camera_on_way{F8(0.0f), F8(0.0f)};
  for (std::size_t i = 0; i < k; ++i) {
    const auto& here = path.surface[i];
    const double per_area = here.to_light_cosine / path.distance2[i];
    if (i == 0) {
      from_light[0] = path.emission * per_area;
      light[0] = first_arrival(path.light(), f(here.to_light_cosine));
      continue;
    }
    const auto& before = path.surface[i - 1];
    from_light[i] = from_light[i - 1] * before.to_camera_pdf * per_area;
    const Partial8 out = before.delta ? scatter_delta(light[i - 1], f(before.to_camera_cosine))
                                      : scatter(light[i - 1], f(before.merging), f(before.to_camera_cosine),
                                                f(before.to_camera_pdf), f(before.to_light_pdf));
    light[i] = arrive(out, f(path.distance2[i]), f(here.to_light_cosine));
  }
  for (std::size_t i = k; i-- > 0;) {
    const auto& here = path.surface[i];
    const double per_area = here.to_camera_cosine / path.distance2[i + 1];
    if (i + 1 == k) {
      from_camera[i] = path.film_pdf * per_area;
      camera_on_way = camera_start(f(path.film_pdf), static_cast<float>(RandomPath::kLightPaths));
    } else {
      from_camera[i] = from_camera[i + 1] * path.surface[i + 1].to_light_pdf * per_area;
    }
    camera[i] = arrive(camera_on_way, f(path.distance2[i + 1]), f(here.to_camera_cosine));
    camera_on_way = here.delta ? scatter_delta(camera[i], f(here.to_light_cosine))
                               : scatter(camera[i], f(here.merging), f(here.to_light_cosine), f(here.to_light_pdf),
                                         f(here.to_camera_pdf));
  }

  std::vector<Strategy> all;
  const auto add = [&](double density, F8 weight) { all.push_back({density, lane(weight)}); };
  const auto& first = path.surface.front();
  const auto& last = path.surface.back();
  const double at_light = path.light_cosine / path.distance2[0];
  if (!path.delta_light) {
    add(from_camera[0] * first.to_light_pdf * at_light, found_light(camera_on_way, path.light()));
  }
  if (!first.delta) {
    add(from_camera[0] * path.drawn * at_light,
        sampled_light(camera[0], f(first.merging), f(first.to_light_cosine), f(first.to_light_pdf),
                      f(first.to_camera_pdf), path.light()));
  }
  for (std::size_t i = 0; i < k; ++i) {
    const auto& here = path.surface[i];
    if (!here.delta) {
      add(from_light[i] * from_camera[i] * here.merging,
          merged(camera[i], light[i], f(here.merging), f(here.to_light_pdf), f(here.to_camera_pdf)));
    }
    if (i + 1 < k && !here.delta && !path.surface[i + 1].delta) {
      const auto& next = path.surface[i + 1];
      add(from_light[i] * from_camera[i + 1],
          connected(behind(camera[i + 1], f(next.merging), f(next.to_camera_pdf)), f(next.to_light_pdf),
                    f(next.to_light_cosine), behind(light[i], f(here.merging), f(here.to_light_pdf)),
                    f(here.to_camera_pdf), f(here.to_camera_cosine), f(path.distance2[i + 1])));
    }
  }
  if (!last.delta) {
    add(RandomPath::kLightPaths * from_light[k - 1],
        splatted(behind(light[k - 1], f(last.merging), f(last.to_light_pdf)),
                 f(path.film_pdf * last.to_camera_cosine / path.distance2[k]),
                 static_cast<float>(RandomPath::kLightPaths)));
  }
  return all;
}

TEST(VcmWeights, AreTheBalanceHeuristicAndSumToOne) {
  std::mt19937 engine(1);
  int found = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::vector<Strategy> all = strategies(RandomPath(1 + i % 5, engine));
    double densities = 0, weights = 0;
    for (const Strategy& s : all) {
      densities += s.density;
      weights += s.weight;
    }
    for (const Strategy& s : all) {
      ASSERT_NEAR(s.weight, s.density / densities, 2e-5) << "path " << i;
    }
    if (!all.empty()) {  // empty: no strategy can find the path
      ASSERT_NEAR(weights, 1, 1e-4) << "path " << i;
      ++found;
    }
  }
  EXPECT_GT(found, 10000);
}

}  // namespace
}  // namespace lightmill::vcm
