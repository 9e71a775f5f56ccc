// The failure atlas for several faces: coplanar, touching and near ones, thin walls, corners, gaps and closed rooms,
// each with its right outcome.
#include "tests/analytic/meter_text.h"
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/face_scenes.h"

namespace lightmill::test {
namespace {

TEST(Faces, TouchingBlocksLeakNoLight) {
  expect_answer(mean_of(clean_picture(scene_of(blocks_in_a_furnace()), "path", 8), 0), 2, 2e-3);
}

TEST(Faces, AnEmitterJustBelowTheCeilingLightsOnlyTheFloor) {
  for (const double gap : {1e-2, 1e-4, 1e-5}) {
    const auto seen = [&](const std::string& view) {
      return mean_of(clean_picture(scene_of(emitter_below_a_ceiling(gap, view)), "path", 10, 1), 0);
    };
    expect_answer(seen(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])"), 0.2394565, 2e-3);
    EXPECT_EQ(seen(R"("eye": [2, 0.5, 1], "look_at": [2, 1.1, 0])").value, 0) << gap;
    EXPECT_EQ(seen(R"("eye": [0, 0.5, 0.2], "look_at": [0.2, 1, 0])").value, 1) << gap;
  }
}

TEST(Faces, ANarrowGapPassesItsFormFactor) {
  // Parallel unit squares very close together. The form factor says how much light passes between them.
  for (const double gap : {1e-1, 1e-3, 1e-4}) {
    const auto scene = scene_with(fmt::format(
                                      R"("materials": [{}], "objects": [{}],
               "meters": [{{"name": "m", "patch": {{"corner": [-0.5, 0, -0.5], "edge1": [0, 0, 1], "edge2": [1, 0, 0]}}}}])",
                                      diffuse("lamp", 0, 1), mesh("lamp", "lamp.obj")),
                                  {{"lamp.obj", horizontal_square(1, gap, false)}});
    const MeterReading reading = read_meters(scene, 8).front();
    EXPECT_NEAR(reading.value, M_PI * parallel_form_factor(1, 1, gap), 4.5 / 1.96 * reading.half_width + 1e-4) << gap;
    EXPECT_LT(reading.half_width, 0.01) << gap;
  }
}

TEST(Walls, StopAllLightHoweverThin) {
  // A closed room with a wall across it, and very bright lights on the far side. This side is black. The wall passes
  // through the floor and the other walls, as in real models.
  for (const double thickness : {0.1, 1e-3, 1e-5}) {
    for (const std::string& light :
         {std::string(R"({"point": {"position": [-0.01, 1.5, 0.2], "intensity": {"rgb": [1e6, 1e6, 1e6]}}})"),
          std::string()}) {
      const auto scene = TestScene::from_text(
          document(R"("eye": [0.8, 1.4, 0.5], "look_at": [0, 0.1, -0.2])", 60, 32,
                   diffuse("wall", 0.8) + also(diffuse("lamp", 0, 1e6)),
                   mesh("wall", "room.obj") + also(mesh("wall", "wall.obj")) +
                       (light.empty() ? also(sphere("lamp", "[-0.6, 0.4, 0]", 0.3)) : ""),
                   light),
          {{"room.obj", box(-1, 1, 0, 2, -1, 1)}, {"wall.obj", box(0, thickness, -0.1, 2.1, -1.1, 1.1)}});
      for (const std::string method : {"path", "raycast", "whitted"}) {
        SCOPED_TRACE(fmt::format("{} {} {}", method, thickness, light));
        expect_even(clean_picture(scene, method, method == "path" ? 6 : 3), 0, 0);
      }
    }
  }
}

TEST(Walls, FillHalfOfTheViewAtTheirFoot) {
  // Right beside a glowing wall, the wall fills half of a point's view.
  EXPECT_NEAR(standing_form_factor(1e9, 1e9, 1e-3), 0.5, 1e-9);
  for (const double distance : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [{0:.17g}, {1}, 0.01], "look_at": [{0:.17g}, 0, 0])", distance, 0.05), 1e-3, 8,
                 diffuse("floor", 1) + also(diffuse("lamp", 0, 1)),
                 mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj"))),
        {{"floor.obj", plane(20, 0, true)},
         {"lamp.obj", polygon({{0, 0, 0.5}, {0, 0, -0.5}, {0, 1, -0.5}, {0, 1, 0.5}})}});
    SCOPED_TRACE(distance);
    expect_answer(mean_of(clean_picture(scene, "path", 13, 1), 0), standing_form_factor(1, 0.5, distance), 1e-2);
  }
}

TEST(Walls, ADoorAjarPassesTheVisiblePartOfTheLight) {
  for (const double width : {0.5, 0.1, 0.01}) {
    const AtlasCase door = door_ajar(width);
    SCOPED_TRACE(width);
    expect_answer(mean_of(clean_picture(scene_of(door), "path", 14, 1), 0), *door.exact, 3e-2);
  }
}

TEST(Faces, ADuplicatedEmitterCountsOnce) {
  // The same emitter again: in its own file, from another corner, as triangles, as another object; by radiance and by
  // power.
  const std::string emitter = horizontal_square(1, 1, false);
  for (const std::string& obj :
       {emitter + "f 1 2 3 4\n", emitter + "f 2 3 4 1\n", emitter + "f 3 4 1 2\nf 1 2 3 4\n"}) {
    for (const double objects : {1, 2}) {
      for (const std::string emission :
           {R"("emission": {"rgb": [1, 1, 1]})", R"("emission_strength": {"watt": 3.14159265})"}) {
        const auto scene = TestScene::from_text(
            document(
                R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])", 0.01, 8,
                diffuse("floor", 1) +
                    also(fmt::format(R"({{"name": "lamp", "diffuse": {{"reflectance": {}}}, {}}})", gray(0), emission)),
                mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj")) +
                    (objects > 1 ? also(mesh("lamp", "lamp.obj")) : "")),
            {{"floor.obj", plane(20, 0, true)}, {"lamp.obj", obj}});
        expect_answer(mean_of(clean_picture(scene, "path", 10, 1), 0), 0.2394565, 2e-3);
        EXPECT_NEAR(mean_of(clean_picture(scene, "raycast", 1), 0).value, 1 / M_PI, 1e-4);
      }
    }
  }
  const std::string ball = sphere("lamp", "[0, 2, 0]", 0.7);
  const auto balls = TestScene::from_text(
      document(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])", 0.01, 8,
               diffuse("floor", 1) + also(diffuse("lamp", 0, 1)), mesh("floor", "floor.obj") + also(ball) + also(ball)),
      {{"floor.obj", plane(20, 0, true)}});
  expect_answer(mean_of(clean_picture(balls, "path", 10, 1), 0), 0.49 / 4, 2e-3);
}

TEST(Rooms, TerminateAtAlbedoOne) {
  expect_answer(mean_of(clean_picture(scene_of(room_without_losses()), "path", 2), 0), 1000, 1e-2);
  expect_answer(mean_of(clean_picture(scene_of(room_of_albedo(0.99)), "path", 10), 0), 100, 1e-2);
}

}  // namespace
}  // namespace lightmill::test
