// The failure atlas for many shapes: a million triangles, and copies of one mesh, each with its right outcome.
#include "tests/atlas/atlas.h"

namespace lightmill::test {
namespace {

/// A hilly floor of 2·n² triangles over [-1, 1]². Its highest point is below 0.1.
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

TEST(ManyShapes, AMillionTrianglesAreWhiteInAWhiteSky) {
  const auto scene = TestScene::from_text(document(R"("eye": [0.3, 0.8, 0.9], "look_at": [0, 0, 0])", 50, 32,
                                                   diffuse("white", 1), mesh("white", "hills.obj"), sky(1)),
                                          {{"hills.obj", hills(708)}});
  for (const std::string method : {"path", "raycast", "preview"}) {
    expect_even(clean_picture(scene, method, 1), 1, 1e-3);
  }
}

TEST(ManyShapes, AHundredThousandInstancesAreWhiteInAWhiteSky) {
  // Small hilly tiles, each mirrored and stretched in its own way.
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

/// A ball of enough triangles that two copies become instances.
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

TEST(Instances, KeepTheirOutsideWhenMirroredOrStretched) {
  // A convex shape under a sky of radiance 1 shows its albedo, and its emission only on the outside.
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

TEST(Instances, AreRefusedWithoutAnInverse) {
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

}  // namespace
}  // namespace lightmill::test
