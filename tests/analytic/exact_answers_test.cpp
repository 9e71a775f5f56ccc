// Scenes whose radiance is known in closed form, through public scene documents.
//
// Each estimate must lie within 5 of its standard errors of the exact value (a false alarm once in 1.7 million). The
// standard error must be small enough for the comparison to mean something.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

TEST(Furnace, AClosedSphereOfAlbedoAHasRadianceOneOverOneMinusA) {
  for (const double albedo : {0.5, 0.8, 0.25}) {
    const auto scene = TestScene::from_text(
        document(kInside, 60, 32, diffuse("wall", albedo, 1), sphere("wall", "[0, 0, 0]", 1, true)));
    for (int channel = 0; channel < 3; ++channel) {
      expect_answer(mean_of(scene.render({"path", 1, 0}, 8), channel), 1 / (1 - albedo), 1e-3);
    }
  }
}

TEST(Furnace, SomeBouncesGiveThePartialSum) {
  struct Case {
    double albedo;
    std::uint32_t bounces;
    double exact;
  };
  for (const Case& c : {Case{0.8, 4, 3.3616}, {0.6, 2, 1 + 0.6 + 0.36}, {0.95, 3, 3.709875}}) {
    const auto scene = TestScene::from_text(
        document(kInside, 60, 32, diffuse("wall", c.albedo, 1), sphere("wall", "[0, 0, 0]", 1, true)));
    expect_answer(mean_of(scene.render({"path", 2, c.bounces}, 8), 0), c.exact, 1e-3);
  }
}

TEST(Furnace, AClosedBoxHasRadianceOneOverOneMinusA) {
  const std::string box =
      "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
      "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n";
  const auto scene = TestScene::from_text(document(kInside, 60, 32, diffuse("wall", 0.5, 1), mesh("wall", "box.obj")),
                                          {{"box.obj", box}});
  expect_answer(mean_of(scene.render({"path", 3, 0}, 8), 1), 2, 1e-3);
}

TEST(Furnace, AGlassBallInUniformLightCannotBeSeen) {
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 40, 32,
                                    diffuse("sky", 0, 1) + R"(, {"name": "glass", "dielectric": {"ior": 1.5}})",
                                    sphere("sky", "[0, 0, 0]", 10, true) + "," + sphere("glass", "[0, 0, 0]", 1)));
  expect_answer(mean_of(scene.render({"path", 4, 0}, 8), 0), 1, 1e-3);
}

TEST(PointLight, GivesRadianceOneAtTheCentreOfADiffuseSphere) {
  // Every bounce reflects ρ of I/R²: L = I/(π R²) · ρ/(1 − ρ).
  struct Case {
    double radius, reflectance, intensity, exact;
  };
  for (const Case& c :
       {Case{1, 0.5, M_PI, 1}, {1, 0.8, 2, 2 / M_PI * 4}, {2.5, 0.3, 40, 40 / (M_PI * 6.25) * 0.3 / 0.7}}) {
    const auto scene = TestScene::from_text(
        document(kInside, 60, 32, diffuse("wall", c.reflectance), sphere("wall", "[0, 0, 0]", c.radius, true),
                 fmt::format(R"({{"name": "centre", "point": {{"position": [0, 0, 0], "intensity": {}}}}})",
                             gray(c.intensity))));
    expect_answer(mean_of(scene.render({"path", 5, 0}, 8), 0), c.exact, 1e-3);
  }
}

TEST(SphereLight, LightsADiffuseSphereByTheClosedForm) {
  // The share f = (r/R)² of the wall's light meets the emitter: L = ρ f / (1 − ρ (1 − f)).
  const auto formula = [](double r, double big, double rho) {
    const double f = r * r / (big * big);
    return rho * f / (1 - rho * (1 - f));
  };
  struct Case {
    double radius, room, reflectance, exact;
  };
  for (const Case& c :
       {Case{0.25, 1, 0.5, 0.0588235}, {0.9, 2, 0.8, formula(0.9, 2, 0.8)}, {0.1, 3, 0.9, formula(0.1, 3, 0.9)}}) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [{}, 0, 0], "look_at": [{}, 0, 0])", 0.6 * c.room, c.room), 60, 32,
                 diffuse("wall", c.reflectance) + "," + diffuse("lamp", 0, 1),
                 sphere("wall", "[0, 0, 0]", c.room, true) + "," + sphere("lamp", "[0, 0, 0]", c.radius)));
    expect_answer(mean_of(scene.render({"path", 6, 0}, 8), 0), c.exact, 4e-3);
  }
}

TEST(SphereLight, IrradianceIsPiLTimesRadiusOverDistanceSquaredTimesCosine) {
  // A white floor shows E/π at (x, 0, 0).
  struct Case {
    double x, height, radius, radiance;
  };
  for (const Case& c : {Case{1, 2, 0.7, 3}, {0, 1.5, 1.2, 0.4}, {6, 3, 0.2, 20}}) {
    const double distance2 = c.x * c.x + c.height * c.height, cosine = c.height / std::sqrt(distance2);
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [{0}, 0.2, 1], "look_at": [{0}, 0, 0])", c.x), 0.01, 8,
                 diffuse("floor", 1) + "," + diffuse("lamp", 0, c.radiance),
                 mesh("floor", "floor.obj") + "," + sphere("lamp", fmt::format("[0, {}, 0]", c.height), c.radius)),
        {{"floor.obj", plane(20, 0, true)}});
    expect_answer(mean_of(scene.render({"path", 7, 1}, 12), 0), c.radiance * c.radius * c.radius / distance2 * cosine,
                  1e-3);
  }
}

/// Form factor of a square of this side at distance h seen from the point below its corner (Siegel & Howell, C-4).
double corner_form_factor(double side, double h) {
  const double x = side / h, s = std::sqrt(1 + x * x);
  return x / s * std::atan(x / s) / M_PI;
}

TEST(FormFactor, SquareAboveAPointMatchesTheFormula) {
  EXPECT_NEAR(corner_form_factor(1, 1), 0.1385316, 5e-8);
  EXPECT_NEAR(4 * corner_form_factor(0.5, 1), 0.2394565, 5e-8);
  const struct {
    double x, z, side, height, exact;
  } cases[] = {{0, 0, 1, 1, 0.2394565},
               {0.5, 0.5, 1, 1, 0.1385316},
               {0, 0, 3, 2, 4 * corner_form_factor(1.5, 2)},
               {0.4, 0.4, 0.8, 0.6, corner_form_factor(0.8, 0.6)}};
  for (const auto& c : cases) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [{0}, 0.5, {1}], "look_at": [{0}, 0, {2}])", c.x, c.z + 1, c.z), 0.01, 8,
                 diffuse("floor", 1) + "," + diffuse("lamp", 0, 1),
                 mesh("floor", "floor.obj") + "," + mesh("lamp", "lamp.obj")),
        {{"floor.obj", plane(20, 0, true)}, {"lamp.obj", horizontal_square(c.side, c.height, false)}});
    expect_answer(mean_of(scene.render({"path", 8, 1}, 12), 0), c.exact, 1e-3);
  }
}

TEST(Lights, AllKindsAndStrengthsAddUp) {
  // A white floor at the origin with four lights: a sphere straight above, a point, a square away from both, and a
  // sphere a hundred thousand times weaker than the first. Each light is chosen by its power. Its weight accounts for
  // rays that find it by chance.
  const double above = 3 * 0.49 / 9;
  const double weak = 3e-5 * 0.25 / 8 / std::sqrt(2.0);
  const double point = 2 / 25.0 * (3 / 5.0) / M_PI;  // distance 5, cos θ = 3/5
  const double square = 0.5 * 0.1385316;             // straight above its corner
  const std::string emitter = polygon({{0, 1, 0}, {-1, 1, 0}, {-1, 1, -1}, {0, 1, -1}});
  const auto scene = TestScene::from_text(
      document(R"("eye": [0.1, 0.5, 0.3], "look_at": [0, 0, 0])", 0.01, 8,
               diffuse("floor", 1) + "," + diffuse("strong", 0, 3) + "," + diffuse("weak", 0, 3e-5) + "," +
                   diffuse("square", 0, 0.5),
               mesh("floor", "floor.obj") + "," + sphere("strong", "[0, 3, 0]", 0.7) + "," +
                   sphere("weak", "[0, 2, 2]", 0.5) + "," + mesh("square", "square.obj"),
               R"({"name": "point", "point": {"position": [4, 3, 0], "intensity": {"rgb": [2, 2, 2]}}})"),
      {{"floor.obj", plane(20, 0, true)}, {"square.obj", emitter}});
  // The square's corner hides a quarter of the sphere.
  expect_answer(mean_of(scene.render({"path", 14, 1}, 12), 0), 0.75 * above + weak + point + square, 1e-3);
}

TEST(Emission, LeavesOnTheSideOfTheNormalUnlessBothAreAskedFor) {
  // A square emitter at height 1 between two white triangles. No camera aims at the edge of two triangles. Fast rays
  // can slip through there, and a picture this narrow would show it.
  for (const bool up : {true, false}) {
    for (const bool two_sided : {true, false}) {
      const std::string emitter = fmt::format(
          R"({{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {}, "two_sided_emission": {}}})", gray(0),
          gray(1), two_sided);
      const auto seen = [&](const std::string& view) {
        const auto scene = TestScene::from_text(
            document(view, 0.01, 8, diffuse("wall", 1) + "," + emitter,
                     mesh("wall", "floor.obj") + "," + mesh("wall", "ceiling.obj") + "," + mesh("lamp", "lamp.obj")),
            {{"floor.obj", polygon({{-3, 0, -2}, {0, 0, 4}, {3, 0, -2}})},
             {"ceiling.obj", polygon({{-3, 2, -2}, {3, 2, -2}, {0, 2, 4}})},
             {"lamp.obj", horizontal_square(1, 1, up)}});
        return mean_of(scene.render({"path", 15, 1}, 10), 0);
      };
      const bool above = up || two_sided, below = !up || two_sided;
      EXPECT_EQ(seen(R"("eye": [0, 1.5, 0.2], "look_at": [0.2, 1, 0])").value, above ? 1 : 0);
      EXPECT_EQ(seen(R"("eye": [0, 0.5, 0.2], "look_at": [0.2, 1, 0])").value, below ? 1 : 0);
      const Estimate floor = seen(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])");
      const Estimate ceiling = seen(R"("eye": [0, 1.5, 1], "look_at": [0, 2, 0])");
      for (const auto& [estimate, lit] : {std::pair(floor, below), {ceiling, above}}) {
        if (lit) {
          expect_answer(estimate, 0.2394565, 2e-3);
        } else {
          EXPECT_EQ(estimate.value, 0);
        }
      }
    }
  }
}

/// The mean radiance of a receiver of `area` in the plane through `p0` with unit normal `n`. Each pixel covers dω
/// r²/cos θ of it. Nothing else in the picture may be bright.
Estimate mean_over_receiver(const TestScene& scene, const HalfImages& image, Vec3d p0, Vec3d n, double area) {
  const Camera& camera = scene.scene().camera;
  const auto vec = [](const Point3d& p) { return Vec3d(p[0], p[1], p[2]); };
  const Vec3d eye = vec(camera.eye);
  const Vec3d forward = glm::normalize(vec(camera.look_at) - eye);
  const Vec3d right = glm::normalize(glm::cross(forward, vec(camera.up)));
  const Vec3d down = glm::cross(forward, right);
  const double pixel = 2 * std::tan(camera.vertical_fov_degrees * M_PI / 360) / image.height;
  double sum = 0, variance = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Vec3d d =
          forward + right * ((x + 0.5 - image.width / 2.0) * pixel) + down * ((y + 0.5 - image.height / 2.0) * pixel);
      const double t = glm::dot(p0 - eye, n) / glm::dot(d, n);
      // dω = pixel²/|d|³, r = t|d|, cos θ = |d·n|/|d|.
      const double covered = pixel * pixel * t * t / std::abs(glm::dot(d, n));
      const std::size_t i = 3 * (static_cast<std::size_t>(y) * image.width + x);
      sum += image.mean(i) * covered;
      variance += image.variance(i) * covered * covered;
    }
  }
  return {sum / area, std::sqrt(variance) / area};
}

TEST(FormFactor, DoesNotDependOnTheSizeOfTheFloor) {
  // The offset that keeps rays off the floor must not grow with the floor.
  for (const double side : {4.0, 200.0, 2e4}) {
    const auto scene =
        TestScene::from_text(document(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])", 0.01, 8,
                                      diffuse("floor", 1) + "," + diffuse("lamp", 0, 1),
                                      mesh("floor", "floor.obj") + "," + mesh("lamp", "lamp.obj")),
                             {{"floor.obj", plane(side, 0, true)}, {"lamp.obj", horizontal_square(1, 1, false)}});
    expect_answer(mean_of(scene.render({"path", 8, 1}, 12), 0), 0.2394565, 1e-3);
  }
}

TEST(FormFactor, ParallelUnitSquaresMatchTheFormula) {
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 3, 6], "look_at": [0, 0, 0])", 14, 64, diffuse("floor", 1) + "," + diffuse("lamp", 0, 1),
               mesh("floor", "floor.obj") + "," + mesh("lamp", "lamp.obj")),
      {{"floor.obj", horizontal_square(1, 0, true)}, {"lamp.obj", horizontal_square(1, 1, false)}});
  expect_answer(mean_over_receiver(scene, scene.render({"path", 9, 1}, 10), Vec3d(0), Vec3d(0, 1, 0), 1), 0.1998249,
                1e-3);
}

TEST(FormFactor, CoaxialUnitDiscsMatchTheFormula) {
  std::vector<std::array<double, 3>> floor, emitter;
  constexpr int kCorners = 1024;
  for (int i = 0; i < kCorners; ++i) {
    const double phi = 2 * M_PI * i / kCorners;
    floor.push_back({std::cos(phi), 0, -std::sin(phi)});
    emitter.push_back({std::cos(phi), 1, std::sin(phi)});
  }
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 6, 12], "look_at": [0, 0, 0])", 14, 64, diffuse("floor", 1) + "," + diffuse("lamp", 0, 1),
               mesh("floor", "floor.obj") + "," + mesh("lamp", "lamp.obj")),
      {{"floor.obj", polygon(floor)}, {"lamp.obj", polygon(emitter)}});
  expect_answer(mean_over_receiver(scene, scene.render({"path", 10, 1}, 10), Vec3d(0), Vec3d(0, 1, 0), M_PI), 0.3819660,
                1e-3);
}

TEST(FormFactor, PerpendicularUnitSquaresMatchTheFormula) {
  // The emitter is in the picture, so the value of a black floor is subtracted from that of a white one.
  const auto render = [](double reflectance) {
    const auto scene =
        TestScene::from_text(document(R"("eye": [0, 5, 5], "look_at": [0, 0.3, 0.5])", 20, 64,
                                      diffuse("floor", reflectance) + "," + diffuse("lamp", 0, 1),
                                      mesh("floor", "floor.obj") + "," + mesh("lamp", "lamp.obj")),
                             {{"floor.obj", polygon({{-0.5, 0, 0}, {-0.5, 0, 1}, {0.5, 0, 1}, {0.5, 0, 0}})},
                              {"lamp.obj", polygon({{-0.5, 0, 0}, {0.5, 0, 0}, {0.5, 1, 0}, {-0.5, 1, 0}})}});
    return std::pair(scene, scene.render({"path", 11, 1}, 11));
  };
  const auto [scene, black] = render(0);
  HalfImages image = render(1).second;
  for (std::size_t i = 0; i < image.a.size(); ++i) {
    image.a[i] -= black.a[i];
    image.b[i] -= black.b[i];
  }
  expect_answer(mean_over_receiver(scene, image, Vec3d(0), Vec3d(0, 1, 0), 1), 0.2000438, 2e-3);
}

/// Radiance seen at the origin at this angle to the vertical, under a sky of radiance 1. Glass and black surfaces are
/// large squares at a height, facing up or down.
struct Square {
  std::string material;
  double height;
  bool up;
};
Estimate seen_among(double degrees, double ior, const std::vector<Square>& squares, std::uint64_t seed) {
  const double theta = degrees * M_PI / 180;
  std::string objects = sphere("sky", "[0, 0, 0]", 20, true);
  std::map<std::string, std::string> files;
  for (const Square& square : squares) {
    const std::string name = fmt::format("{}.obj", files.size());
    objects += also(mesh(square.material, name));
    files[name] = plane(60, square.height, square.up);
  }
  const auto scene = TestScene::from_text(
      document(
          fmt::format(R"("eye": [0, {}, {}], "look_at": [0, 0, 0], "up": [1, 0, 0])", std::cos(theta), std::sin(theta)),
          0.01, 16,
          diffuse("sky", 0, 1) + also(diffuse("black", 0)) +
              also(named("glass", fmt::format(R"("dielectric": {{"ior": {}}})", ior))),
          objects),
      files);
  return mean_of(scene.render({"path", seed, 0}, 10), 0);
}

TEST(Fresnel, AGlassPlaneShowsTheSkyByItsReflectance) {
  // Below the plane everything is black, so only the mirrored sky is visible.
  const struct {
    double degrees, ior, exact;
  } cases[] = {{0, 1.5, 0.04},
               {45, 1.5, 0.0502399},
               {60, 1.5, 0.0891867},
               {75, 1.5, 0.2530606},
               {85, 1.5, 0.6127996},
               {0, 2, 1.0 / 9},
               {std::atan(2) * 180 / M_PI, 2, 0.5 * 9 / 25}};  // Brewster's angle: ((n² − 1)/(n² + 1))²/2
  for (const auto& c : cases) {
    expect_answer(seen_among(c.degrees, c.ior, {{"glass", 0, true}, {"black", -0.5, true}}, 12), c.exact, 1e-2);
  }
}

TEST(Fresnel, GlassOfIndexOneIsInvisible) {
  // A ball and a slanted sheet of index 1 in front of an emitter. The camera sees all of it, and nothing else.
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 3, 0.5], "look_at": [0, 0, 0], "up": [1, 0, 0])", 20, 32,
               diffuse("lamp", 0, 1) + R"(, {"name": "air", "dielectric": {"ior": 1}})",
               mesh("lamp", "lamp.obj") + "," + sphere("air", "[0, 1, 0]", 0.4) + "," + mesh("air", "sheet.obj")),
      {{"lamp.obj", plane(60, -1, true)},
       {"sheet.obj", polygon({{-9, 2, -9}, {-9, 1.5, 9}, {9, 1.5, 9}, {9, 2, -9}})}});
  const Estimate seen = mean_of(scene.render({"path", 16, 0}, 4), 0);
  EXPECT_NEAR(seen.value, 1, 1e-6);
}

TEST(Fresnel, AClearSlabTransmitsWhatItsInnerReflectionsSumTo) {
  // All is black above the slab, and the sky shines below it: (1 − R)/(1 + R).
  const struct {
    double degrees, ior, exact;
  } cases[] = {{0, 1.5, 0.9230769}, {60, 1.5, 0.8362325}, {0, 2, 0.8}, {std::atan(2) * 180 / M_PI, 2, 0.82 / 1.18}};
  for (const auto& c : cases) {
    expect_answer(seen_among(c.degrees, c.ior, {{"glass", 0, true}, {"glass", -0.1, false}, {"black", 3, false}}, 13),
                  c.exact, 1e-3);
  }
}

}  // namespace
}  // namespace lightmill::test
