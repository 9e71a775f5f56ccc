#include "common/scene/compiled/material_table.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

/// A number that is exact in single precision, as is its square.
float number(std::uint32_t i) {
  return static_cast<float>(i + 1) / 64;
}

// Columns of up to eight rows use another lookup than longer ones.
TEST(MaterialTable, ReturnsTheParametersOfEachMaterial) {
  for (const std::uint32_t of_each_kind : {3u, 8u, 21u}) {
    Scene scene;
    for (std::uint32_t i = 0; i < of_each_kind; ++i) {
      const float x = number(i);
      scene.materials.emplace_back().kind = DiffuseMaterial{{x, 0, 0}};
      scene.materials.emplace_back().kind = DielectricMaterial{1 + x, x};
      scene.materials.emplace_back().kind = ConductorMaterial{{x, 2 * x, 3 * x}, {4 * x, 5 * x, 6 * x}, x};
      scene.materials.emplace_back().kind = PhongMaterial{{x, 0, 0}, {0, x, 0}, 64 * x};
      scene.materials.emplace_back().kind =
          PrincipledMaterial{{x, 0, 0}, x,          x / 2,        x / 4,     x / 8,   1 + x,        x / 16,
                             x / 32,    i % 2 == 1, {x / 64, 45}, {0, x, 0}, x / 128, {0, 0, x / 2}};
    }
    const MaterialTable table(scene, material_rows(scene), {}, std::vector<Vec3>(scene.materials.size()));
    for (std::uint32_t i = 0; i < of_each_kind; ++i) {
      SCOPED_TRACE(fmt::format("{} of {}", i, of_each_kind));
      const float x = number(i);
      const auto surface = [&](std::uint32_t kind) {
        Surface8 out{};
        out.material = U8(5 * i + kind);
        return out;
      };
      const M8 all(true);
      const Conductor8 c = table.conductor(surface(2), all);
      const Phong8 g = table.phong(surface(3), all);
      const PrincipledParameters8 p = table.principled(surface(4), all);
      const F8 red = table.reflectance(surface(0), all).x, ior = table.ior(surface(1), all);
      const F8 alpha = table.dielectric(surface(1), F8(1.5f), all).alpha;
      const std::array found{red,
                             ior,
                             alpha,
                             c.eta.x,
                             c.eta.y,
                             c.eta.z,
                             c.k.x,
                             c.k.y,
                             c.k.z,
                             c.facets.alpha(),
                             g.diffuse.x,
                             g.specular.y,
                             g.exponent,
                             p.base_color.x,
                             p.metallic,
                             p.roughness,
                             p.specular,
                             p.transmission,
                             p.ior,
                             p.coat,
                             p.coat_roughness,
                             p.anisotropy->strength,
                             p.sheen->color.y,
                             p.sheen->roughness};
      const std::array<float, found.size()> expected{x,     1 + x, x * x, x,      2 * x,  3 * x,  4 * x, 5 * x,
                                                     6 * x, x * x, x,     x,      64 * x, x,      x,     x / 2,
                                                     x / 4, x / 8, 1 + x, x / 16, x / 32, x / 64, x,     x / 128};
      for (std::size_t j = 0; j < found.size(); ++j) {
        EXPECT_EQ((found[j] == F8(expected[j])).bits(), 0xff) << j;
      }
      EXPECT_EQ(p.burley.bits(), i % 2 == 1 ? 0xff : 0);
      EXPECT_EQ((p.sheet->transmittance.z == F8(x / 2)).bits(), 0xff);
      EXPECT_EQ(p.sheet->closed.bits(), 0xff) << "light enters its shares of glass";
    }
  }
}

TEST(MaterialTable, LightThatReturnsToTheBaseDeepensItsColour) {
  // b (1 − r)/(1 − b r), and nothing for the other materials.
  Scene scene;
  scene.materials.resize(3);
  scene.materials[0].kind = PrincipledMaterial{.base_color = {0.5f, 0, 1}, .inner_reflectance = 0.5};
  scene.materials[1].kind = PrincipledMaterial{.base_color = {0.5f, 0, 1}, .specular_color = {1, 0.5f, 0}};
  scene.materials[2].kind = DiffuseMaterial{{0.5f, 0, 1}};
  const MaterialTable table(scene, material_rows(scene), {}, std::vector<Vec3>(scene.materials.size()));
  for (std::uint32_t i = 0; i < 3; ++i) {
    Surface8 surface{};
    surface.material = U8(i);
    const V8 color = table.reflectance(surface, M8(true));
    EXPECT_EQ((color.x == F8(i == 0 ? 1 / 3.0f : 0.5f)).bits(), 0xff) << i;
    EXPECT_EQ((color.y == F8(0.0f)).bits() & (color.z == F8(1.0f)).bits(), 0xff) << i;
    if (i < 2) {
      EXPECT_EQ((table.principled(surface, M8(true)).specular_color->y == F8(i == 0 ? 1 : 0.5f)).bits(), 0xff) << i;
    }
  }
}

TEST(MaterialTable, SheetsAroundAMediumAreClosed) {
  const PrincipledMaterial sheet{.base_color = {0.5f, 0.5f, 0.5f}, .transmittance = {0.25f, 0.5f, 1}};
  Scene scene;
  scene.materials.resize(4);
  scene.materials[0].kind = sheet;
  scene.materials[1].kind = sheet;
  scene.materials[1].interior.scattering = {1, 1, 1};
  scene.materials[2].kind = PrincipledMaterial{};
  scene.materials[3].kind = PrincipledMaterial{.metallic = 1, .transmittance = {1, 1, 1}};
  const MaterialTable table(scene, material_rows(scene), {}, std::vector<Vec3>(scene.materials.size()));
  for (std::uint32_t i = 0; i < 4; ++i) {
    Surface8 surface{};
    surface.material = U8(i);
    EXPECT_EQ(table.principled(surface, M8(true)).sheet->closed.bits(), i == 1 ? 0xff : 0) << i;
    // A thin sheet reflects half of what it does not transmit. A body has its base colour, and metal transmits nothing.
    const float expected[] = {0.625f, 0.5f, 0.8f, 0.8f};
    EXPECT_EQ((table.albedo(surface, M8(true)).x == F8(expected[i])).bits(), 0xff) << i;
  }
}

}  // namespace
}  // namespace lightmill
