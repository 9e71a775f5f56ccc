// The failure atlas for faces together: coplanar, touching and near ones, thin walls, corners, gaps and closed rooms,
// each with its right outcome.
#include "tests/analytic/meter_text.h"
#include "tests/atlas/atlas.h"

namespace lightmill::test {
namespace {

TEST(Faces, OfBlocksThatStandAndTouchLeakNothing) {
  // In a closed room whose every surface sends out 1 and reflects a half, there is radiance 2 whatever stands in it;
  // behind faces, which send out nothing backwards, there would be less. Blocks on the floor, against each other and
  // the walls, one in others, with faces that are there twice.
  const std::map<std::string, std::string> files{{"room.obj",
                                                  // faces inwards
                                                  "v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nv -1 0 1\nv 1 0 1\n"
                                                  "v 1 2 1\nv -1 2 1\nf 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 4 3 7 8\n"
                                                  "f 1 4 8 5\nf 2 6 7 3\n"},
                                                 {"a.obj", box(-0.8, -0.2, 0, 1, -0.8, 0)},
                                                 {"b.obj", box(-0.2, 0.3, 0, 1, -0.8, 0)},
                                                 {"c.obj", box(-0.5, 0.1, 0.5, 0.9, -0.6, -0.1)},
                                                 {"d.obj", box(0.4, 1, 0, 0.6, -1, -0.5)},
                                                 {"e.obj", box(0.5, 0.9, 0.6, 0.9, -0.9, -0.6)},
                                                 {"d2.obj", box(0.4, 1, 0, 0.6, -1, -0.5)},
                                                 {"hair.obj", box(-0.3, 0.3, 1.9998, 1.9999, 0.2, 0.6)}};
  std::string objects;
  for (const auto& [name, text] : files) {
    objects += (objects.empty() ? "" : ", ") + mesh("wall", name);
  }
  const auto scene = TestScene::from_text(
      document(R"("eye": [0.3, 1.2, 0.9], "look_at": [-0.1, 0.5, -0.5])", 80, 32, diffuse("wall", 0.5, 1), objects),
      files);
  expect_answer(mean_of(clean_picture(scene, "path", 8), 0), 2, 2e-3);
}

TEST(Faces, ALampAHairBelowTheCeilingLightsTheFloorAlone) {
  for (const double gap : {1e-2, 1e-4, 1e-5}) {
    const auto seen = [&](const std::string& view) {
      const auto scene = TestScene::from_text(
          document(view, 0.01, 8, diffuse("wall", 1) + also(diffuse("lamp", 0, 1)),
                   mesh("wall", "floor.obj") + also(mesh("wall", "ceiling.obj")) + also(mesh("lamp", "lamp.obj"))),
          {{"floor.obj", plane(20, 0, true)},
           {"ceiling.obj", plane(20, 1 + gap, false)},
           {"lamp.obj", horizontal_square(1, 1, false)}});
      return mean_of(clean_picture(scene, "path", 10, 1), 0);
    };
    expect_answer(seen(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])"), 0.2394565, 2e-3);
    EXPECT_EQ(seen(R"("eye": [2, 0.5, 1], "look_at": [2, 1.1, 0])").value, 0) << gap;
    EXPECT_EQ(seen(R"("eye": [0, 0.5, 0.2], "look_at": [0.2, 1, 0])").value, 1) << gap;
  }
}

TEST(Faces, ANarrowGapIsNoContact) {
  // Parallel unit squares a hair apart: what passes between them is what the form factor says, not more and not less.
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

TEST(Walls, ThinOnesKeepAllLightOnOneSide) {
  // A closed room, a wall across it, and glaring lamps on its far side: in front of it there is nothing at all. The
  // wall goes on through the floor and the others, as walls do.
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

/// Form factor of a wall a high and b to either side that stands on a floor, seen from the floor at distance c from its
/// foot's middle (Siegel & Howell, C-5).
double standing_form_factor(double a, double b, double c) {
  const double d = std::sqrt(a * a + c * c);
  return (std::atan(b / c) - c / d * std::atan(b / d)) / M_PI;
}

TEST(Walls, TheirFootIsLitAsMuchAsTheRest) {
  // Right beside a glowing wall half of all that a point sees is the wall.
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

TEST(Walls, ADoorAjarLetsThroughWhatIsSeenOfTheLamp) {
  // A door's gap 1 high in a wall, all of which glows that is seen through it from a distance of 1.
  for (const double width : {0.5, 0.1, 0.01}) {
    const auto upright = [](double x, double y0, double y1, double z0, double z1) {
      return polygon({{x, y0, z1}, {x, y0, z0}, {x, y1, z0}, {x, y1, z1}});  // faces +x
    };
    const auto scene = TestScene::from_text(
        document(R"("eye": [1, 0.5, 0.01], "look_at": [1, 0, 0])", 1e-3, 8,
                 diffuse("floor", 1) + also(diffuse("wall", 0)) + also(diffuse("lamp", 0, 1)),
                 plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(mesh("lamp", "lamp.obj")) +
                     also(mesh("wall", "left.obj")) + also(mesh("wall", "right.obj")) + also(mesh("wall", "top.obj"))),
        {{"lamp.obj", upright(-1, 0, 3, -2, 2)},
         {"left.obj", upright(0, 0, 1, -9, -width / 2)},
         {"right.obj", upright(0, 0, 1, width / 2, 9)},
         {"top.obj", upright(0, 1, 9, -9, 9)}});
    SCOPED_TRACE(width);
    expect_answer(mean_of(clean_picture(scene, "path", 14, 1), 0), standing_form_factor(1, width / 2, 1), 3e-2);
  }
}

TEST(Faces, ADuplicatedLampIsOneLamp) {
  // Again in its own file, from another corner, as triangles, as another object; by its radiance and by its power.
  const std::string lamp = horizontal_square(1, 1, false);
  for (const std::string& obj : {lamp + "f 1 2 3 4\n", lamp + "f 2 3 4 1\n", lamp + "f 3 4 1 2\nf 1 2 3 4\n"}) {
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

TEST(Rooms, OfAlbedoOneComeToAnEnd) {
  // What goes in never comes out: the sum over a thousand bounces is finite, and that is what is shown.
  const auto scene = TestScene::from_text(
      document(kInside, 60, 2, diffuse("wall", 1), sphere("wall", "[0, 0, 0]", 1, true),
               R"({"point": {"position": [0, 0, 0], "intensity": {"rgb": [3.14159265, 3.14159265, 3.14159265]}}})"));
  expect_answer(mean_of(clean_picture(scene, "path", 2), 0), 1000, 1e-2);
  const auto nearly =
      TestScene::from_text(document(kInside, 60, 4, diffuse("wall", 0.99, 1), sphere("wall", "[0, 0, 0]", 1, true)));
  expect_answer(mean_of(clean_picture(nearly, "path", 10), 0), 100, 1e-2);
}

}  // namespace
}  // namespace lightmill::test
