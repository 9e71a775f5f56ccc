#include "common/scene/compiled/material_table.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

/// Single precision has these and their squares.
float number(std::uint32_t i) {
  return static_cast<float>(i + 1) / 64;
}

::testing::AssertionResult is(F8 found, float expected) {
  std::array<float, 8> lanes{};
  found.store(lanes.data());
  for (const float lane : lanes) {
    if (lane != expected) {
      return ::testing::AssertionFailure() << lane << ", not " << expected;
    }
  }
  return ::testing::AssertionSuccess();
}

// Columns of up to eight rows are looked up in another way than longer ones.
TEST(MaterialTable, HasEachMaterialsParametersByTheirNames) {
  for (const std::uint32_t of_each_kind : {3u, 8u, 21u}) {
    Scene scene;
    for (std::uint32_t i = 0; i < of_each_kind; ++i) {
      const float x = number(i);
      scene.materials.emplace_back().kind = DiffuseMaterial{{x, 0, 0}};
      scene.materials.emplace_back().kind = DielectricMaterial{1 + x, x};
      scene.materials.emplace_back().kind = ConductorMaterial{{x, 2 * x, 3 * x}, {4 * x, 5 * x, 6 * x}, x};
      scene.materials.emplace_back().kind = PhongMaterial{{x, 0, 0}, {0, x, 0}, 64 * x};
      scene.materials.emplace_back().kind =
          PrincipledMaterial{{x, 0, 0}, x, x / 2, x / 4, x / 8, 1 + x, x / 16, x / 32};
    }
    const MaterialTable table(scene, {});
    for (std::uint32_t i = 0; i < of_each_kind; ++i) {
      SCOPED_TRACE(fmt::format("{} of {}", i, of_each_kind));
      const float x = number(i);
      const auto surface = [&](std::uint32_t kind) {
        Surface8 out{};
        out.material = U8(5 * i + kind);
        return out;
      };
      const M8 all(true);
      EXPECT_TRUE(is(table.reflectance(surface(0), all).x, x));
      EXPECT_TRUE(is(table.ior(surface(1), all), 1 + x));
      EXPECT_TRUE(is(table.dielectric_alpha(surface(1), all), x * x));
      const Conductor8 metal = table.conductor(surface(2), all);
      const std::array found{metal.eta.x, metal.eta.y, metal.eta.z, metal.k.x, metal.k.y, metal.k.z};
      for (std::size_t j = 0; j < found.size(); ++j) {
        EXPECT_TRUE(is(found[j], static_cast<float>(j + 1) * x)) << j;
      }
      EXPECT_TRUE(is(metal.alpha, x * x));
      const Phong8 phong = table.phong(surface(3), all);
      EXPECT_TRUE(is(phong.diffuse.x, x));
      EXPECT_TRUE(is(phong.specular.y, x));
      EXPECT_TRUE(is(phong.exponent, 64 * x));
      const PrincipledParameters8 layers = table.principled(surface(4), all);
      EXPECT_TRUE(is(layers.base_color.x, x));
      EXPECT_TRUE(is(layers.metallic, x));
      EXPECT_TRUE(is(layers.roughness, x / 2));
      EXPECT_TRUE(is(layers.specular, x / 4));
      EXPECT_TRUE(is(layers.transmission, x / 8));
      EXPECT_TRUE(is(layers.ior, 1 + x));
      EXPECT_TRUE(is(layers.coat, x / 16));
      EXPECT_TRUE(is(layers.coat_roughness, x / 32));
    }
  }
}

}  // namespace
}  // namespace lightmill
