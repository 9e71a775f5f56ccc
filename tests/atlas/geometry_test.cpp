// The failure atlas for shapes: degenerate, huge, tiny, far away, touching and many, each with its right outcome.
#include "tests/analytic/meter_text.h"
#include "tests/atlas/atlas.h"

namespace lightmill::test {
namespace {

constexpr const char* kAbove = R"("eye": [0.1, 0.5, 0.3], "look_at": [0, 0, 0])";
const char* const kPoint = R"({"point": {"position": [0, 2, 0], "intensity": {"rgb": [6, 6, 6]}}})";

/// A closed box as an OBJ file.
std::string box(double x0, double x1, double y0, double y1, double z0, double z1) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0);
  }
  return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

// ---- triangles ----

TEST(Triangles, WithoutAreaAndDuplicatesChangeNothing) {
  // On a white floor: the same floor again, points, lines, and needles thinner than single precision can tell.
  const std::string floor = plane(40, 0, true);
  const std::string worse = floor + plane(40, 0, true) +
                            "f 1 1 1\nf 1 2 2\nf 1 2 1\nv 0 0 0\nv 0.1 0 0.1\nv 0.2 0 0.2\nf 9 10 11\n"
                            "v -3 0 -0.01\nv 3 0 -0.01\nv 3 0 -0.010000001\nf 12 13 14\nv 3 0 -0.0100000000001\n"
                            "f 12 13 15\n";
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

TEST(Triangles, OfALampWithoutAreaShineNotAtAll) {
  const std::string lamp = horizontal_square(1, 1, false) + "f 1 1 2\nf 1 2 2\nv 0 1 0\nv 0.1 1 0\nf 1 5 5\nf 5 6 5\n";
  const auto scene = TestScene::from_text(document(R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])", 0.01, 8,
                                                   diffuse("floor", 1) + also(diffuse("lamp", 0, 1)),
                                                   mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj"))),
                                          {{"floor.obj", plane(20, 0, true)}, {"lamp.obj", lamp}});
  expect_answer(mean_of(clean_picture(scene, "path", 10, 1), 0), 0.2394565, 2e-3);
}

TEST(Triangles, ThatAreNoneAreAllThatThereIs) {
  // Nothing can be hit: the sky is seen.
  const std::string text =
      document(kAbove, 60, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj") + also(shape("floor", R"("triangle":
          {"a": [0, 0, 0], "b": [1, 1, 1], "c": [2, 2, 2]})")),
               sky(2));
  for (const std::string method : {"path", "raycast", "whitted", "preview"}) {
    expect_even(
        clean_picture(TestScene::from_text(text, {{"floor.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"}}), method, 2),
        2, 1e-6);
  }
}

TEST(Triangles, OfNumbersThatAreNoneAreRefusedByTheirLine) {
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
    const std::string message =
        refusal(text, {{"floor.obj", "v 0 0 0\nv 1 0 0\nv 2 0 1\nvn " + normal + "\nf 1//1 2//1 3//1\n"}});
    EXPECT_NE(message.find("floor.obj:4: "), std::string::npos) << normal << ": " << message;
  }
  // A normal of length zero says nothing: the face is flat.
  const auto scene =
      TestScene::from_text(document(kAbove, 10, 8, diffuse("floor", 0.5), mesh("floor", "floor.obj"), sky(1)),
                           {{"floor.obj", "v -9 0 9\nv 9 0 9\nv 0 0 -9\nvn 0 0 0\nf 1//1 2//1 3//1\n"}});
  expect_even(clean_picture(scene, "path", 3), 0.5, 1e-5);
}

// ---- size and place ----

/// The form factor of a unit square from straight below its centre, in a scene that is scaled and then moved; seen by
/// path, and the floor under a point by raycast.
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
  const auto lamp = TestScene::from_text(document(view, 0.01, 8, diffuse("floor", 1) + also(diffuse("lamp", 0, 1)),
                                                  mesh("floor", "floor.obj") + also(mesh("lamp", "lamp.obj"))),
                                         files);
  expect_answer(mean_of(clean_picture(lamp, "path", 10, 1), 0), 0.2394565, 2e-3);
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

TEST(Place, BeyondTheLimitsIsRefused) {
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

TEST(Spheres, OfAnySizeShowTheirAlbedoInAnEvenSky) {
  // Nothing that a convex shape sends out comes back to it, and clear glass is not seen at all.
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

TEST(Spheres, OneOfAMillionUnitsIsAFloor) {
  // Lamps as near to its ground as a thousandth of its radius, 4e-6 of which rays keep off it.
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

TEST(Spheres, AMoteShinesByItsIntensity) {
  // E = πL(R/d)² of a lamp a millionth as large as its distance; and from the surface of one a million times as large.
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

TEST(Planes, SeenEdgeOnAreALine) {
  // The eye in the plane sees the sky above and below; a hair above it the lower half is the plane.
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

TEST(Planes, TouchingAndCrossingOnesHideEachOther) {
  // Two planes in one place, with a ball cut in half by them: all white under a white sky.
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 1, 3], "look_at": [0, 0, 0])", 60, 16, diffuse("floor", 1),
               plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(plane_shape("floor", "[5, 0, 2]", "[0, -2, 0]")) +
                   also(sphere("floor", "[0, 0, 0]", 0.5)),
               sky(1)));
  expect_even(clean_picture(scene, "path", 5), 1, 1e-4);
}

// ---- touching, coplanar and near faces ----

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

// ---- many ----

/// A hilly floor of 2·n² triangles over [-1, 1]², and its highest point below 0.1.
std::string hills(int n) {
  std::string text;
  text.reserve(static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * 60);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double x = 2.0 * i / n - 1, z = 2.0 * j / n - 1;
      fmt::format_to(std::back_inserter(text), "v {:.6f} {:.6f} {:.6f}\n", x, 0.1 * std::sin(40 * x) * std::sin(30 * z),
                     z);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int a = i * (n + 1) + j + 1;
      fmt::format_to(std::back_inserter(text), "f {} {} {} {}\n", a, a + 1, a + n + 2, a + n + 1);
    }
  }
  return text;
}

TEST(Many, AMillionTrianglesAreWhiteInAWhiteSky) {
  const auto scene = TestScene::from_text(document(R"("eye": [0.3, 0.8, 0.9], "look_at": [0, 0, 0])", 50, 32,
                                                   diffuse("white", 1), mesh("white", "hills.obj"), sky(1)),
                                          {{"hills.obj", hills(708)}});
  for (const std::string method : {"path", "raycast", "preview"}) {
    expect_even(clean_picture(scene, method, 1), 1, 1e-3);
  }
}

TEST(Many, AHundredThousandInstancesAreWhiteInAWhiteSky) {
  // Small hilly tiles, mirrored and stretched each in its own way.
  std::string objects;
  objects.reserve(20'000'000);
  for (int i = 0; i < 100'000; ++i) {
    fmt::format_to(std::back_inserter(objects),
                   R"({}{{"material":"white","mesh":{{"file":"hills.obj"}},"transform":{{"scale":[{},{},0.5],)"
                   R"("translate":[{},{},{}]}}}})",
                   i == 0 ? "" : ",", i % 2 == 0 ? 1 : -1, 0.5 + 0.01 * (i % 100), i % 316 - 158, -0.01 * (i % 7),
                   -(i / 316));
  }
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 30, 20], "look_at": [0, 0, -60])", 60, 32, diffuse("white", 1), objects, sky(1)),
      {{"hills.obj", hills(6)}});
  for (const std::string method : {"path", "raycast"}) {
    expect_even(clean_picture(scene, method, 1), 1, 1e-3);
  }
}

// ---- instances ----

/// A ball of triangles, so many that two of it are instances.
std::string ball() {
  constexpr int kRings = 8, kParts = 16;
  std::string text = "v 0 1 0\nv 0 -1 0\n", faces;
  const auto vertex = [](int ring, int part) { return 3 + (ring - 1) * kParts + part % kParts; };
  for (int ring = 1; ring < kRings; ++ring) {
    for (int part = 0; part < kParts; ++part) {
      const double theta = M_PI * ring / kRings, phi = 2 * M_PI * part / kParts;
      text += fmt::format("v {:.9f} {:.9f} {:.9f}\n", std::sin(theta) * std::cos(phi), std::cos(theta),
                          -std::sin(theta) * std::sin(phi));
    }
  }
  for (int part = 0; part < kParts; ++part) {
    faces += fmt::format("f 1 {} {}\nf 2 {} {}\n", vertex(1, part), vertex(1, part + 1), vertex(kRings - 1, part + 1),
                         vertex(kRings - 1, part));
    for (int ring = 1; ring + 1 < kRings; ++ring) {
      faces += fmt::format("f {} {} {} {}\n", vertex(ring, part), vertex(ring + 1, part), vertex(ring + 1, part + 1),
                           vertex(ring, part + 1));
    }
  }
  return text + faces;
}

TEST(Instances, MirroredAndStretchedOnesKeepTheirOutside) {
  // A convex thing under a sky of radiance 1 shows its albedo, and its emission on the outside only.
  for (const std::string scale : {"[1, 1, 1]", "[-1, 1, 1]", "[-1, -1, -1]", "[0.001, 1, 0.5]", "[1, 0.0001, 1]",
                                  "[-1000, 1, 3]", "[0.00001, 0.00001, 0.00001]", "[1e5, -1e5, 1e5]"}) {
    const double size = scale.find("0.00001") != std::string::npos ? 1e-5 : scale.find("1e5") == 1 ? 1e5 : 1;
    const auto place = [&](double x) {
      return fmt::format(R"({{"scale": {}, "translate": [{:.17g}, 0, 0]}})", scale, x);
    };
    const auto scene = TestScene::from_text(
        document(fmt::format(R"("eye": [0.0, {0:.17g}, {1:.17g}], "look_at": [0, 0, 0])", 0.9 * size, 5 * size), 0.02,
                 8, diffuse("clay", 0.7),
                 shape("clay", R"("mesh": {"file": "ball.obj"})", place(0)) +
                     also(shape("clay", R"("mesh": {"file": "ball.obj"})", place(1e4 * size))),
                 sky(1)),
        {{"ball.obj", ball()}});
    SCOPED_TRACE(scale);
    if (scale != "[1, 0.0001, 1]" && scale != "[0.001, 1, 0.5]") {
      expect_even(clean_picture(scene, "path", 3), 0.7, 1e-4);
    } else {
      expect_even(clean_picture(scene, "path", 3), 0.85, 0.1501);  // thin: some rays miss
    }
  }
}

TEST(Instances, ThatHaveNoInverseAreRefused) {
  for (const std::string scale : {"[0, 1, 1]", "[1, 1e-31, 1]", "[0, 0, 0]"}) {
    const std::string why =
        refusal(document(kAbove, 60, 8, diffuse("m", 0.5),
                         shape("m", R"("triangle": {"a": [0, 0, 0], "b": [1, 0, 0], "c": [0, 1, 0]})",
                               fmt::format(R"({{"scale": {}}})", scale))));
    EXPECT_NE(why.find("objects[0].transform: the map is not invertible (a scale of zero, or axes in one plane)"),
              std::string::npos)
        << scale << why;
  }
  const std::string why =
      refusal(document(kAbove, 60, 8, diffuse("m", 0.5),
                       shape("m", R"("sphere": {"center": [0, 0, 0], "radius": 1})", R"({"scale": [1, 2, 1]})")));
  EXPECT_NE(why.find("objects[0].transform: a sphere can be moved, rotated and scaled equally along all axes"),
            std::string::npos)
      << why;
}

/// A regular octahedron; `normal` gives the normal of a corner.
std::string octahedron(const std::function<std::array<double, 3>(const std::array<double, 3>&)>& normal) {
  const std::array<std::array<double, 3>, 6> corners{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  std::string text;
  for (const auto& c : corners) {
    const auto n = normal(c);
    text += fmt::format("v {} {} {}\nvn {} {} {}\n", c[0], c[1], c[2], n[0], n[1], n[2]);
  }
  return text +
         "f 1//1 2//2 3//3\nf 2//2 4//4 3//3\nf 4//4 5//5 3//3\nf 5//5 1//1 3//3\n"
         "f 2//2 1//1 6//6\nf 4//4 2//2 6//6\nf 5//5 4//4 6//6\nf 1//1 5//5 6//6\n";
}

TEST(Normals, ThatAreFarFromTheSurfacesOwnAddNoLight) {
  // White under a sky of radiance 1: what the two normals disagree about may be lost, and nothing is made up. Normals
  // the wrong way round are turned.
  const auto picture = [](const std::string& obj, const std::string& method, const std::string& material) {
    return clean_picture(TestScene::from_text(document(R"("eye": [1, 2, 3], "look_at": [0, 0, 0])", 30, 32, material,
                                                       mesh("white", "o.obj"), sky(1)),
                                              {{"o.obj", obj}}),
                         method, 4);
  };
  using Corner = std::array<double, 3>;
  const std::string materials[] = {
      diffuse("white", 1), R"({"name": "white", "phong": {"specular": {"rgb": [1, 1, 1]}, "exponent": 20}})",
      R"({"name": "white", "conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [900, 900, 900]}, "roughness": 0.3}})",
      R"({"name": "white", "mirror": {}})", R"({"name": "white", "dielectric": {"ior": 1.5}})"};
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
        for (const double value : image.a) {
          ASSERT_GE(value, 0);
          ASSERT_LE(value, 1 + 2e-3);
        }
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
