// Surfaces with normal maps through public scene documents: closed forms of the rules in methods/shading_frame.h.
#include <cmath>
#include <string_view>

#include "common/sampling/sobol.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// A decoder that gives one normal, or hashed ones over the upper hemisphere.
CompiledScene::ImageDecoder one_normal(const Vec3d& n) {
  const Vec3 texel((glm::normalize(n) + 1.0) * 0.5);
  return [texel](ByteView, const std::string&) -> Result<Texels> {
    return Texels{1, 1, {}, std::vector<float>{texel.x, texel.y, texel.z, 1}, false};
  };
}
/// 32×32 texels with normals up to 63 degrees off.
Result<Texels> many_normals(ByteView /*bytes*/, const std::string& /*name*/) {
  std::vector<float> texels;
  for (std::uint32_t i = 0; i < 1024; ++i) {
    const double x = (mix(2 * i + 1) >> 8) * 0x1p-23 - 1, y = (mix(2 * i + 2) >> 8) * 0x1p-23 - 1;
    const Vec3 texel((glm::normalize(Vec3d(1.4 * x, 1.4 * y, 1)) + 1.0) * 0.5);
    texels.insert(texels.end(), {texel.x, texel.y, texel.z, 1});
  }
  return Texels{32, 32, {}, std::move(texels), false};
}

/// A square of side 20 in the plane y = 0, facing up, with u along x and v against z. `repeats`: of the texture.
std::string floor_mesh(double repeats) {
  return fmt::format(
      "v -8 0 11\nv 12 0 11\nv 12 0 -9\nv -8 0 -9\nvt 0 0\nvt {0} 0\nvt {0} {0}\nvt 0 {0}\nf 1/1 2/2 3/3 4/4\n",
      repeats);
}
/// A floor with a normal map, seen from this direction.
TestScene floor_seen_from(const Vec3d& eye, double fov, const std::string& kind, const std::string& lights,
                          const CompiledScene::ImageDecoder& normals, double repeats = 1) {
  const std::string view =
      fmt::format(R"("eye": [{}, {}, {}], "look_at": [0, 0, 0], "up": [0, 0, 1])", eye.x, eye.y, eye.z);
  std::string text = document(view, fov, 8, named("floor", kind + R"(, "normal_map": {"texture": "bumps"})"),
                              mesh("floor", "floor.obj"), lights);
  text.insert(1, R"("textures": [{"name": "bumps", "file": "bumps.exr", "filter": "NEAREST"}], )");
  return TestScene::from_text(text, {{"floor.obj", floor_mesh(repeats)}, {"bumps.exr", "normals"}}, normals);
}

const char* const kWhite = R"("diffuse": {"reflectance": {"rgb": [1, 1, 1]}})";

/// The shading normal is tilted by θ towards +x. A sun at α to the vertical, towards +x, gives max(0, cos(α − θ))/π, and
/// by its image in the floor max(0, -cos(α + θ))/π. From everywhere: also from where the normal is seen from behind.
TEST(TiltedFloor, IsLambertian) {
  for (const double theta : {0.0, 20.0, 50.0}) {
    for (const double alpha : {-75.0, -20.0, 0.0, 35.0, 60.0, 85.0}) {
      const auto radians = [](double degrees) { return degrees * M_PI / 180; };
      const double facing = std::cos(radians(alpha - theta)), mirrored = -std::cos(radians(alpha + theta));
      const double exact = (std::max(facing, 0.0) + std::max(mirrored, 0.0)) / M_PI;
      const std::string sun = fmt::format(R"({{"directional": {{"direction": [{}, {}, 0], "irradiance": {}}}}})",
                                          -std::sin(radians(alpha)), -std::cos(radians(alpha)), gray(1));
      for (const double seen : {-70.0, 10.0, 60.0}) {
        const TestScene scene =
            floor_seen_from({std::sin(radians(seen)), std::cos(radians(seen)), 0.0}, 0.1, kWhite, sun,
                            one_normal({std::sin(radians(theta)), 0, std::cos(radians(theta))}));
        for (const char* method : {"raycast", "path"}) {
          EXPECT_NEAR(mean_of(scene.render({method, 1, 1}, 1), 0).value, exact, 2e-5)
              << theta << " " << alpha << " " << seen;
        }
      }
    }
  }
}

/// Under a sky of radiance 1, seen at this angle to the vertical.
Estimate bumpy_under_sky(const std::string& kind, double degrees, const std::string& method = "path", double fov = 20,
                         const CompiledScene::ImageDecoder& normals = many_normals) {
  const double theta = degrees * M_PI / 180;
  const TestScene scene = floor_seen_from({std::sin(theta), std::cos(theta), 0}, fov, kind,
                                          R"({"environment": {"radiance": {"rgb": [1, 1, 1]}}})", normals, 5);
  const HalfImages image = scene.render({method, 2, 0}, 8);
  EXPECT_EQ(image.non_finite, 0u);
  return mean_of(image, 0);
}

TEST(BumpyFurnace, LosslessSurfacesAreInvisible) {
  for (const double degrees : {0.0, 50.0, 80.0, 87.0}) {
    for (const char* kind : {kWhite, R"("mirror": {"reflectance": {"rgb": [1, 1, 1]}})",
                             R"("conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [1000, 1000, 1000]}})"}) {
      EXPECT_NEAR(bumpy_under_sky(kind, degrees).value, 1, 3e-3) << kind << " " << degrees;
    }
    EXPECT_NEAR(bumpy_under_sky(kWhite, degrees, "ao").value, 1, 1e-6) << degrees;
  }
}

constexpr std::array kRough{
    R"("conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [1000, 1000, 1000]}, "roughness": 0.3})",
    R"("conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [1000, 1000, 1000]}, "roughness": 1})",
    R"("phong": {"diffuse": {"rgb": [0.5, 0.5, 0.5]}, "specular": {"rgb": [0.5, 0.5, 0.5]}, "exponent": 30})",
    R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "roughness": 0.4, "coat": 1})"};

TEST(BumpyFurnace, RoughSurfacesConserveEnergy) {
  for (const double degrees : {0.0, 50.0, 80.0, 87.0}) {
    for (const char* kind : kRough) {
      const Estimate got = bumpy_under_sky(kind, degrees);
      const bool layers = std::string_view(kind).find("coat") != std::string_view::npos;  // a fit of gloss below coats
      EXPECT_LT(got.value, 1 + (layers ? 4e-3 : 1e-3) + 5 * got.standard_error) << kind << " " << degrees;
    }
  }
}

/// A tilted normal loses what the BSDF itself loses at the angle between the normal and the view, and nothing more. If
/// the normal is seen from behind, at 110 degrees, that is the angle of the mirror image, 70.
TEST(BumpyFurnace, TiltedSurfacesHaveTheAlbedoOfTheirAngle) {
  const double tilt = 40 * M_PI / 180;
  for (const char* kind : kRough) {
    for (const auto& [seen, angle] : {std::pair(60.0, 20.0), {5.0, 35.0}, {-20.0, 60.0}, {-70.0, 70.0}}) {
      const Estimate tilted = bumpy_under_sky(kind, seen, "path", 0.1, one_normal({std::sin(tilt), 0, std::cos(tilt)}));
      const Estimate flat = bumpy_under_sky(kind, angle, "path", 0.1, one_normal({0, 0, 1}));
      EXPECT_NEAR(tilted.value, flat.value, 5 * std::hypot(tilted.standard_error, flat.standard_error) + 1e-3)
          << kind << " " << seen;
      EXPECT_LT(flat.standard_error, 0.005);
    }
  }
}

/// A closed box whose faces have the texture.
std::string textured_box() {
  std::string text = "vt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\n";
  for (int i = 0; i < 8; ++i) {
    text += fmt::format("v {} {} {}\n", i & 1 ? 1 : -1, i & 2 ? 0.5 : -0.5, i & 4 ? 1 : -1);
  }
  for (const auto& [a, b, c, d] : std::vector<std::array<int, 4>>{
           {1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5}, {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}}) {
    text += fmt::format("f {}/1 {}/2 {}/3 {}/4\n", a, b, c, d);
  }
  return text;
}

TEST(BumpyFurnace, GlassIsInvisible) {
  for (const auto& [roughness, lost] : {std::pair(0.0, 0.004), {0.3, 0.1}}) {
    std::string text = document(R"("eye": [0.7, 0.9, 2.5], "look_at": [0, 0, 0])", 35, 16,
                                named("glass", fmt::format(R"("dielectric": {{"ior": 1.5, "roughness": {}}},
                                               "normal_map": {{"texture": "bumps"}})",
                                                           roughness)),
                                mesh("glass", "box.obj"), R"({"environment": {"radiance": {"rgb": [1, 1, 1]}}})");
    text.insert(1, R"("textures": [{"name": "bumps", "file": "bumps.exr"}], )");
    const TestScene scene =
        TestScene::from_text(text, {{"box.obj", textured_box()}, {"bumps.exr", "normals"}}, many_normals);
    const HalfImages image = scene.render({"path", 3, 0}, 8);
    EXPECT_EQ(image.non_finite, 0u);
    const Estimate got = mean_of(image, 0);
    EXPECT_LT(got.value, 1 + 1e-3 + 5 * got.standard_error) << roughness;
    EXPECT_GT(got.value, 1 - lost - 5 * got.standard_error) << roughness;
  }
}

}  // namespace
}  // namespace lightmill::test
