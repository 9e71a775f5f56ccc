// Affine maps of scene files.
#include "common/scene_io/transforms.h"

#include <cmath>

#include "tests/unit/scene_io/text_scene.h"

namespace lightmill {
namespace {

using test::expect_near;

TEST(Transforms, QuarterTurnTakesXToY) {
  const Transform turn = rotation(90, {0, 0, 5});
  expect_near(map_point(turn, {1, 0, 0}), {0, 1, 0});
  expect_near(map_point(turn, {0, 1, 0}), {-1, 0, 0});
  expect_near(map_point(rotation(120, {1, 1, 1}), {1, 2, 3}), {3, 1, 2});  // exchanges the axes in a circle
}

TEST(Transforms, ComposeAppliesTheSecondFirst) {
  const Transform t = compose(translation({1, 2, 3}), scaling({2, 3, 4}));
  expect_near(map_point(t, {1, 1, 1}), {3, 5, 7});
  expect_near(map_vector(t, {1, 1, 1}), {2, 3, 4});
  EXPECT_DOUBLE_EQ(determinant(t), 24);
}

TEST(Transforms, TheInverseMapsPointsBack) {
  const Transform t = compose(rotation(37, {1, -2, 0.5}), compose(translation({4, 5, -6}), scaling({-1, 0.5, 3})));
  expect_near(map_point(inverse(t).value(), map_point(t, {7, 8, 9})), {7, 8, 9});
  EXPECT_FALSE(inverse(scaling({1, 0, 1})).has_value());
}

TEST(Transforms, OnlySimilaritiesHaveAScale) {
  const Transform turn = rotation(37, {1, -2, 0.5});
  EXPECT_NEAR(similarity_scale(compose(scaling({-2, 2, 2}), turn)).value(), 2, 1e-12);
  EXPECT_FALSE(similarity_scale(compose(scaling({2, 2, 2.01}), turn)).has_value());
}

TEST(Transforms, LookingAtTurnsZToTheTarget) {
  const Transform t = looking_at({1, 2, 3}, {9, 2, 3}, {0.5, 2, 0}).value();
  expect_near(map_point(t, {0, 0, 2}), {3, 2, 3});
  expect_near(map_vector(t, {0, 1, 0}), {0, 1, 0});
  expect_near(map_vector(t, {1, 0, 0}), {0, 0, -1});  // y × z
  EXPECT_FALSE(looking_at({1, 2, 3}, {1, 2, 3}, {0, 1, 0}).has_value());
  EXPECT_FALSE(looking_at({0, 0, 0}, {0, 2, 0}, {0, 1, 0}).has_value());
}

TEST(Transforms, CamerasLookAlongTheirZ) {
  const Camera camera = camera_along_z(compose(translation({1, 2, 3}), rotation(90, {1, 0, 0})));
  expect_near(camera.eye, {1, 2, 3});
  EXPECT_NEAR(camera.look_at[0], 1, 1e-12);
  EXPECT_LT(camera.look_at[1], 2);  // z turns to -y
  EXPECT_NEAR(camera.look_at[2], 3, 1e-12);
  expect_near(camera.up, {0, 0, 1});
}

}  // namespace
}  // namespace lightmill
