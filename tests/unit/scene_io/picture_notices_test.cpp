// Notices about the picture to expect.
#include "common/scene_io/picture_notices.h"

#include <gtest/gtest.h>

#include "common/scene/mesh.h"

namespace lightmill {
namespace {

/// Seen from (0, 0, 5) towards the origin, 90° high and wide: at the origin's distance from −5 to 5.
LoadedScene seen(const std::vector<Object>& objects) {
  LoadedScene loaded;
  loaded.scene.camera = {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 90};
  loaded.scene.film = {200, 200, {FilterKind::box, 0.5}};
  loaded.scene.materials = {{"white", DiffuseMaterial{}, {}}, {"lamp", DiffuseMaterial{}, {1, 1, 1}}};
  loaded.scene.objects = objects;
  return loaded;
}
Object ball(const Point3d& center, double radius, std::uint32_t material = 0) {
  return {"ball", material, SphereShape{center, radius}};
}

TEST(PictureNotices, ASceneWithoutLightIsReportedAsBlack) {
  const std::vector<std::string> black{"nothing emits light: the picture will be black"};
  LoadedScene loaded = seen({ball({0, 0, 0}, 1)});
  EXPECT_EQ(picture_notices(loaded, true), black);
  EXPECT_TRUE(picture_notices(loaded, false).empty());
  EnvironmentLight night;
  night.radiance = {0, 0, 0};
  loaded.scene.lights = {{"off", PointLight{{0, 3, 0}, {0, 0, 0}}}, {"night", night}};
  IesLight ies;
  ies.scale = 0;
  loaded.scene.lights.push_back({"dim", ies});
  EXPECT_EQ(picture_notices(loaded, true), black);
  loaded.scene.lights[0].kind = PointLight{{0, 3, 0}, {0, 0, 1}};
  EXPECT_TRUE(picture_notices(loaded, true).empty());
  EXPECT_TRUE(picture_notices(seen({ball({0, 0, 0}, 1, 1)}), true).empty());
}

std::string view_of(const LoadedScene& loaded) {
  const std::vector<std::string> notices = picture_notices(loaded, false);
  return notices.empty() ? "" : notices[0];
}
const std::string kNothing =
    "the camera at (0, 0, 5), looking at (0, 0, 0), sees nothing of the scene: choose another with --camera";

TEST(PictureNotices, ASceneOutOfViewIsReported) {
  EXPECT_EQ(view_of(seen({ball({0, 0, 0}, 1)})), "");
  EXPECT_EQ(view_of(seen({ball({0, 0, 8}, 1)})), kNothing);  // behind
  EXPECT_EQ(view_of(seen({ball({0, 0, 5.5}, 1)})), "");      // around the camera
  for (const Point3d& aside : {Point3d{8, 0, 0}, {-8, 0, 0}, {0, 8, 0}, {0, -8, 0}}) {
    EXPECT_EQ(view_of(seen({ball(aside, 1)})), kNothing);
    EXPECT_EQ(view_of(seen({ball(aside, 1), ball({0, 0, 8}, 1)})), kNothing);
    EXPECT_EQ(view_of(seen({ball(aside, 3.5)})), "");
  }
  LoadedScene wide = seen({ball({8, 0, 0}, 1)});
  wide.scene.film.width = 400;
  EXPECT_EQ(view_of(wide), "");
}

TEST(PictureNotices, TransformsMoveMeshesOutOfView) {
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {}, {{0, 1, 2}}};
  LoadedScene loaded = seen({});
  const std::string bytes = encode_mesh(mesh);
  const MeshShape shape{"a.obj", sha256(bytes)};
  loaded.assets[shape.asset] = bytes;
  loaded.scene.objects = {{"here", 0, shape}};
  EXPECT_EQ(view_of(loaded), "");
  loaded.scene.objects[0].transform = {{{1, 0, 0, 100}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  EXPECT_EQ(view_of(loaded), kNothing);
  loaded.scene.objects.push_back({"there", 0, shape});
  EXPECT_EQ(view_of(loaded), "");
}

TEST(PictureNotices, FogTooDenseForThePathLengthIsReported) {
  const auto dense = [](double radius, const Medium& medium, std::uint32_t max_bounces) {
    LoadedScene loaded = seen({ball({0, 0, 0}, radius, 2)});
    loaded.scene.materials.push_back({"fog", DielectricMaterial{1}, {}});
    loaded.scene.materials.back().interior = medium;
    const std::vector<std::string> notices = picture_notices(loaded, false, max_bounces);
    return notices.empty() ? "" : notices.back();
  };
  Medium white;
  white.scattering = {1000, 1000, 1000};
  EXPECT_EQ(
      dense(1, white, 1000),
      "the medium \"fog\" scatters so densely (optical thickness 2e+03) that some of its light, perhaps a few per "
      "cent, is lost, because paths end after 1000 bounces (--max-bounces)");
  EXPECT_EQ(dense(1, white, 0), "");          // of a method without paths
  EXPECT_EQ(dense(1, white, 4'000'000), "");  // long enough: the square of the thickness
  Medium thinner;
  thinner.scattering = {60, 60, 60};
  EXPECT_EQ(dense(0.8, thinner, 1000), "");  // 96 across
  EXPECT_NE(dense(1, thinner, 1000), "");    // 120
  Medium grey = white;
  grey.absorption = {10, 10, 10};  // of 1000 scatterings .99^1000 are left
  EXPECT_EQ(dense(1, grey, 1000), "");
  grey.absorption = {10, 10, 1};  // .999^1000
  EXPECT_NE(dense(1, grey, 1000), "");
}

TEST(PictureNotices, SpheresTooLargeForNearDetailAreReported) {
  // The camera is 5 above the surface.
  EXPECT_EQ(view_of(seen({ball({0, 0, -4e4}, 4e4)})), "");
  const std::string said =
      "the sphere \"ball\" is so large (radius 60000) that near the camera its surface is only exact to about 0.01: "
      "use a plane instead";
  EXPECT_EQ(view_of(seen({ball({0, 0, -6e4}, 6e4)})), said);
  EXPECT_EQ(view_of(seen({ball({0, 0, 4}, 1)})), "");    // the camera is on it
  EXPECT_EQ(view_of(seen({ball({0, 0, 0}, 6e4)})), "");  // a sky around all: its surface is far
  LoadedScene enlarged = seen({ball({0, 0, -6}, 6)});
  enlarged.scene.objects[0].transform = {{{1e4, 0, 0, 0}, {0, 1e4, 0, 0}, {0, 0, 1e4, 0}}};
  EXPECT_EQ(view_of(enlarged), said);
}

TEST(PictureNotices, ASceneOfFewPixelsIsReported) {
  // Ten wide at the origin's distance: a ball of radius 0.1 there, its nearest side at 4.9, takes 200 · 0.2 / 9.8.
  EXPECT_EQ(
      view_of(seen({ball({0, 0, 0}, 0.1)})),
      "the camera at (0, 0, 5), looking at (0, 0, 0), sees all of the scene within 5x5 pixels: choose another with "
      "--camera");
  EXPECT_EQ(view_of(seen({ball({0, 0, 0}, 0.1), ball({3, 0, 0}, 0.1)})), "");
  EXPECT_EQ(view_of(seen({ball({0, 0, 0}, 0.5)})), "");
}

TEST(PictureNotices, PlanesAndSkiesCountAsVisible) {
  LoadedScene loaded = seen({ball({0, 0, 8}, 1), {"floor", 0, PlaneShape{}}});
  EXPECT_EQ(view_of(loaded), "");
  loaded.scene.objects.pop_back();
  EXPECT_EQ(view_of(loaded), kNothing);
  loaded.scene.lights = {{"sky", EnvironmentLight{}}};
  EXPECT_EQ(view_of(loaded), "");
}

}  // namespace
}  // namespace lightmill
