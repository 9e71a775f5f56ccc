// The failure atlas for single shapes: degenerate, huge, tiny and far away, each with its right outcome.
#include "tests/analytic/meter_text.h"
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/face_scenes.h"
#include "tests/atlas/cases/material_scenes.h"

namespace lightmill::test {
namespace {

const char* const kPoint = R"({"point": {"position": [0, 2, 0], "intensity": {"rgb": [6, 6, 6]}}})";

// ---- triangles ----

TEST(Triangles, ChangeNothingAsDuplicatesOrWithoutArea) {
  const std::string floor = plane(40, 0, true), worse = degenerate_floor(40);
  const std::string second = "v -20 0 -20\nv -20 0 20\nv 20 0 20\nf 1 2 3\nf 1 2 3\nf 3 2 1\n";
  for (const std::string method : {"path", "raycast", "whitted", "preview", "path:brute-force"}) {
    std::vector<double> seen;
    for (const std::string& obj : {floor, worse, worse + second}) {
      const auto scene = TestScene::from_text(
          document(kAbove, 60, 16, diffuse("floor", 0.7), mesh("floor", "floor.obj"), kPoint), {{"floor.obj", obj}});
      seen.push_back(mean_of(clean_picture(scene, method, 4, 1), 0).value);
    }
    EXPECT_GT(seen[0], 0.1);
    EXPECT_NEAR(seen[1], seen[0], 2e-5 * seen[0]) << method;
    EXPECT_NEAR(seen[2], seen[0], 2e-5 * seen[0]) << method;
  }
}

TEST(Triangles, EmitNothingWithoutArea) {
  const std::string emitter =
      horizontal_square(1, 1, false) + "f 1 1 2\nf 1 2 2\nv 0 1 0\nv 0.1 1 0\nf 1 5 5\nf 5 6 5\n";
  const auto scene = TestScene::from_text(document(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])", 0.01, 8,
                                                   diffuse("floor", 1) + also(diffuse("lamp", 0, 1)),
                                                   mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj"))),
                                          {{"floor.obj", plane(20, 0, true)}, {"lamp.obj", emitter}});
  expect_answer(mean_of(clean_picture(scene, "path", 10, 1), 0), 0.2394565, 2e-3);
}

TEST(Triangles, AreNotSeenWithoutArea) {
  // Rays hit nothing and see the sky. The second face is behind the camera: a file without any area is refused.
  const std::string faces = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 9e3 0\nv 1 9e3 0\nv 0 9e3 1\nf 1 2 3\nf 4 5 6\n";
  const std::string text =
      document(kAbove, 60, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj") + also(shape("floor", R"("triangle":
          {"a": [0, 0, 0], "b": [1, 1, 1], "c": [2, 2, 2]})")),
               sky(2));
  for (const std::string method : {"path", "raycast", "whitted", "preview"}) {
    expect_even(clean_picture(TestScene::from_text(text, {{"floor.obj", faces}}), method, 2), 2, 1e-6);
  }
}

TEST(Triangles, AreRefusedWithTheLineOfAnInvalidCoordinate) {
  const std::string text = document(kAbove, 60, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj"));
  const auto why = [&](const std::string& vertex) {
    const std::string message = refusal(text, {{"floor.obj", "v 0 0 0\nv " + vertex + "\nv 2 0 0\nf 1 2 3\n"}});
    const std::size_t at = message.find("floor.obj:2: ");
    return at == std::string::npos ? "elsewhere: " + message : message.substr(at);
  };
  for (const std::string value : {"nan", "-inf", "1e400", "1e13", "0x10"}) {
    EXPECT_NE(why("1 " + value + " 0").find(value), std::string::npos) << why("1 " + value + " 0");
  }
  for (const std::string normal : {"nan 0 1", "0 inf 0", "0 1"}) {
    EXPECT_EQ(refusal(text, {{"floor.obj", "v 0 0 0\nv 1 0 0\nv 2 0 1\nvn " + normal + "\nf 1//1 2//1 3//1\n"}}), "")
        << normal << " does not count: the face is flat";
  }
  // A normal of length zero is ignored: the face is flat.
  const auto scene =
      TestScene::from_text(document(kAbove, 10, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj"), sky(1)),
                           {{"floor.obj", "v -9 0 9\nv 9 0 9\nv 0 0 -9\nvn 0 0 0\nf 1//1 2//1 3//1\n"}});
  expect_even(clean_picture(scene, "path", 3), 0.5, 1e-5);
}

// ---- size and place ----

/// Checks the form factor of a unit square from straight below its centre, in a scaled and then moved scene. It checks
/// `path`, and `raycast` for the floor under a point.
void expect_form_factor(double scale, const Vec3d& offset) {
  const auto at = [&](double x, double y, double z) {
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", x * scale + offset.x, y * scale + offset.y, z * scale + offset.z);
  };
  const auto moved = [&](const std::vector<std::array<double, 3>>& corners) {
    std::string text, face = "f";
    for (std::size_t i = 0; i < corners.size(); ++i) {
      text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", corners[i][0] * scale + offset.x,
                          corners[i][1] * scale + offset.y, corners[i][2] * scale + offset.z);
      face += fmt::format(" {}", i + 1);
    }
    return text + face + "\n";
  };
  const std::map<std::string, std::string> files{
      {"floor.obj", moved({{-8, 0, -11}, {-8, 0, 9}, {12, 0, 9}, {12, 0, -11}})},
      {"lamp.obj", moved({{-0.5, 1, -0.5}, {0.5, 1, -0.5}, {0.5, 1, 0.5}, {-0.5, 1, 0.5}})}};
  const std::string view = fmt::format(R"("eye": {}, "look_at": {})", at(0, 0.5, 1), at(0, 0, 0));
  const auto emitter = TestScene::from_text(document(view, 0.01, 8, diffuse("floor", 1) + also(diffuse("lamp", 0, 1)),
                                                     mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj"))),
                                            files);
  expect_answer(mean_of(clean_picture(emitter, "path", 10, 1), 0), 0.2394565, 2e-3);
  const auto point = TestScene::from_text(
      document(view, 0.01, 8, diffuse("floor", 1), mesh("floor", "floor.obj"),
               fmt::format(R"({{"point": {{"position": {}, "intensity": {}}}}})", at(0, 1, 0), gray(scale * scale))),
      files);
  for (const std::string method : {"raycast", "whitted"}) {
    EXPECT_NEAR(mean_of(clean_picture(point, method, 1), 0).value, 1 / M_PI, 1e-4) << method;
  }
}

TEST(Place, ScenesOfAnySizeLookTheSame) {
  for (const double scale : {1e-9, 1e-4, 1e-2, 1e2, 1e4, 1e8}) {
    SCOPED_TRACE(scale);
    expect_form_factor(scale, Vec3d(0));
  }
}

TEST(Place, ScenesFarAwayLookTheSame) {
  for (const double distance : {1e2, 1e4, 1e6, 1e8}) {
    SCOPED_TRACE(distance);
    expect_form_factor(1, Vec3d(distance, -0.7 * distance, 0.3 * distance));
  }
}

TEST(Place, ScenesBeyondTheLimitsAreRefused) {
  const auto why = [&](double x, double radius) {
    return refusal(document(kAbove, 60, 8, diffuse("m", 0.5),
                            shape("m", fmt::format(R"("sphere": {{"center": [{}, 0, 0], "radius": {}}})", x, radius))));
  };
  EXPECT_NE(why(1e13, 1).find("objects[0].sphere.center: coordinates must be finite and at most 1000000000000"),
            std::string::npos)
      << why(1e13, 1);
  for (const double radius : {0.0, -1.0, 1e13}) {
    EXPECT_NE(why(0, radius).find("objects[0].sphere.radius: must be positive and at most 1000000000000"),
              std::string::npos)
        << why(0, radius);
  }
}

// ---- spheres ----

TEST(Spheres, ShowTheirAlbedoInAUniformSkyAtAnySize) {
  // A convex shape receives none of its own light, and clear glass is invisible.
  for (const double radius : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    for (const bool glass : {false, true}) {
      const auto scene = TestScene::from_text(
          document(fmt::format(R"("eye": [0, {:.17g}, {:.17g}], "look_at": [0, 0, 0])", radius, 3 * radius), 10, 16,
                   diffuse("ball", 0.8) + also(R"({"name": "glass", "dielectric": {"ior": 1.5}})"),
                   sphere(glass ? "glass" : "ball", "[0, 0, 0]", radius), sky(1)));
      SCOPED_TRACE(radius);
      if (glass) {
        EXPECT_NEAR(mean_of(clean_picture(scene, "path", 8), 0).value, 1, 5e-3);
      } else {
        expect_even(clean_picture(scene, "path", 4), 0.8, 1e-5);
      }
    }
  }
}

TEST(Spheres, AreAFloorAtAMillionUnits) {
  // Emitters down to a thousandth of the radius above the surface. Rays start 4e-6 of the radius off the surface.
  for (const double height : {1e6, 1e4, 1e3}) {
    const auto scene = TestScene::from_text(document(
        fmt::format(R"("eye": [0, {0}, {0}], "look_at": [0, 0, 0])", 2 * height), 0.01, 8, diffuse("ground", 1),
        sphere("ground", "[0, -1e6, 0]", 1e6),
        fmt::format(R"({{"point": {{"position": [0, {}, 0], "intensity": {}}}}})", height, gray(3 * height * height))));
    for (const std::string method : {"path", "raycast"}) {
      EXPECT_NEAR(mean_of(clean_picture(scene, method, 4, 1), 0).value, 3 / M_PI, (1e-3 + 10 / height) * 3 / M_PI)
          << method << height;
    }
  }
}

TEST(Spheres, GiveTheirIrradianceWhenTinyOrHuge) {
  // E = πL(R/d)² of a light with a radius of a millionth of its distance, and from the surface of one a million times
  // as large.
  const auto irradiance = [](double radius, double distance) {
    const auto scene = scene_with(fmt::format(
        R"("materials": [{}], "objects": [{}],
           "meters": [{{"name": "m", "irradiance": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}])",
        diffuse("lamp", 0, 2), sphere("lamp", fmt::format("[0, {:.17g}, 0]", distance), radius)));
    return read_meters(scene, 4).front();
  };
  for (const double radius : {1e-6, 1e-4, 1e-2, 0.5, 0.999}) {
    expect_reading(irradiance(radius, 1), 2 * M_PI * radius * radius, 2e-2);
    expect_reading(irradiance(1e6 * radius, 1e6), 2 * M_PI * radius * radius, 2e-2);
  }
}

// ---- planes ----

TEST(Planes, AreALineWhenSeenEdgeOn) {
  // In the plane, the camera sees the sky above and below. Just above it, the lower half of the picture is the plane.
  for (const double height : {0.0, 1e-6, 1e-3}) {
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [0, {0}, 0], "look_at": [0, {0}, -1])", height), 60, 16, diffuse("floor", 0.5),
                 plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(sphere("floor", "[0, -50, 0]", 1)), sky(1)));
    for (const std::string method : {"path", "raycast", "whitted"}) {
      const HalfImages image = clean_picture(scene, method, 4);
      for (int y = 0; y < 16; ++y) {
        const double value = image.mean(static_cast<std::size_t>(3 * (16 * y + 5)));
        EXPECT_NEAR(value, y < 8 || height == 0 ? 1 : 0.5, 1e-4) << method << ' ' << height << ' ' << y;
      }
    }
  }
}

TEST(Planes, HideEachOtherWhereTheyTouchOrCross) {
  // Two coincident planes, and a ball that they cut in half. All is white under a white sky.
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 1, 3], "look_at": [0, 0, 0])", 60, 16, diffuse("floor", 1),
               plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(plane_shape("floor", "[5, 0, 2]", "[0, -2, 0]")) +
                   also(sphere("floor", "[0, 0, 0]", 0.5)),
               sky(1)));
  expect_even(clean_picture(scene, "path", 5), 1, 1e-4);
}

// ---- normals ----

TEST(Normals, AddNoLightFarFromTheGeometricNormal) {
  // White under a sky of radiance 1. Light that the two normals disagree about may be lost, but none is added. Normals
  // of the wrong orientation are flipped.
  const auto picture = [](const std::string& obj, const std::string& method, const std::string& material) {
    return clean_picture(TestScene::from_text(document(R"("eye": [1, 2, 3], "look_at": [0, 0, 0])", 30, 32, material,
                                                       mesh("white", "o.obj"), sky(1)),
                                              {{"o.obj", obj}}),
                         method, 4);
  };
  using Corner = std::array<double, 3>;
  const std::string rough_metal =
      R"({"name": "white", "conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [900, 900, 900]}, "roughness": 0.3})";
  const std::string materials[] = {diffuse("white", 1),
                                   R"({"name": "white", "phong": {"specular": {"rgb": [1, 1, 1]}, "exponent": 20}})",
                                   rough_metal + "}",
                                   rough_metal + R"(, "single_scattering": true})",
                                   R"({"name": "white", "mirror": {}})",
                                   R"({"name": "white", "dielectric": {"ior": 1.5}})"};
  for (const std::string& material : materials) {
    for (const std::string method : {"path", "raycast", "whitted"}) {
      SCOPED_TRACE(method + material);
      for (const std::string& obj : {octahedron([](const Corner& c) { return c; }), octahedron([](const Corner& c) {
                                       return Corner{c[1], c[2], c[0]};
                                     }),
                                     octahedron([](const Corner&) {
                                       return Corner{0, 1, 0};
                                     }),
                                     octahedron([](const Corner& c) {
                                       return Corner{c[0], 1e-3, c[2]};
                                     })}) {
        const HalfImages image = picture(obj, method, material);
        double sum = 0;
        for (const double value : image.a) {
          ASSERT_GE(value, 0);
          // With the light of several bounces, a direction's weight can exceed 1. The mean over directions cannot.
          ASSERT_LE(value, material == rough_metal + "}" ? 1.25 : 1 + 2e-3);
          sum += value;
        }
        ASSERT_LE(sum, (1 + 2e-3) * static_cast<double>(image.a.size()));
      }
      EXPECT_EQ(picture(octahedron([](const Corner& c) {
                          return Corner{-c[0], -c[1], -c[2]};
                        }),
                        method, material)
                    .a,
                picture(octahedron([](const Corner& c) { return c; }), method, material).a);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
