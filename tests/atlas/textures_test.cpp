// The failure atlas for textures: odd sizes, seams, coordinates outside the image, huge coordinates, and invalid
// images, each with its right outcome.
#include "common/image/exr.h"
#include "tests/atlas/atlas.h"
#include "tests/support/read_image.h"

namespace lightmill::test {
namespace {

/// An EXR file with one value per texel in all channels, rows from the top.
std::string image_of(int width, const std::vector<float>& values) {
  Image image;
  image.display = image.data = {0, 0, width, static_cast<int>(values.size()) / width};
  for (const char* const name : {"R", "G", "B"}) {
    image.channels.push_back({name, values});
  }
  return *encode_exr(image);
}

struct Texels2D {
  int width, height;
  std::vector<float> values;
  /// Rows count upwards.
  double at(int x, int y) const { return values[static_cast<std::size_t>((height - 1 - y) * width + x)]; }
  std::string file() const { return image_of(width, values); }
};

/// Texels that all differ.
Texels2D numbered(int width, int height) {
  Texels2D out{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    out.values.push_back(static_cast<float>(i + 1) / static_cast<float>(width * height + 1));
  }
  return out;
}

int modulo(int a, int n) {
  return ((a % n) + n) % n;
}

/// A floor with u = x and v = −z, seen from straight above. The square film covers [x − half, x + half] and [z − half,
/// z + half].
std::string floor_document(const std::string& texture, double x, double z, double half, int size) {
  return fmt::format(
      R"({{"camera": {{"eye": [{0:.17g}, {3:.17g}, {1:.17g}], "look_at": [{0:.17g}, 0, {1:.17g}], "up": [0, 0, -1],
        "vertical_fov_degrees": {4}}},
      "film": {{"width": {5}, "height": {5}, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "textures": [{{"name": "t", "file": "t.exr", {2}}}],
      "materials": [{{"name": "floor", "diffuse": {{"reflectance": {{"texture": "t"}}}}}}],
      "objects": [{{"material": "floor", "plane": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}]}})",
      x, z, texture, half, 90, size);
}

HalfImages preview_of(const std::string& text, const Texels2D& texels) {
  return clean_picture(TestScene::from_text(text, {{"t.exr", texels.file()}}, read_image), "preview", 1);
}

TEST(Textures, RepeatOrClampOnBothSidesOfZeroAtAnySize) {
  // Coordinates from −2 to 2. A pixel is a texel.
  for (const auto& [width, height] : {std::pair(3, 5), {1, 1}, {1, 7}, {6, 1}, {2, 2}}) {
    const Texels2D texels = numbered(width, height);
    const int size = 12;
    for (const bool repeats : {true, false}) {
      const std::string settings =
          fmt::format(R"("filter": "NEAREST", "wrap": "{}", "scale": [{:.17g}, {:.17g}])", repeats ? "REPEAT" : "CLAMP",
                      3.0 / width, 3.0 / height);  // three texels per unit
      const HalfImages image = preview_of(floor_document(settings, 0, 0, 2, size), texels);
      int off = 0;
      for (int row = 0; row < size; ++row) {
        for (int column = 0; column < size; ++column) {
          const int x = column - size / 2, y = size / 2 - 1 - row;
          const double exact = repeats ? texels.at(modulo(x, width), modulo(y, height))
                                       : texels.at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
          off += std::abs(image.mean(static_cast<std::size_t>(3 * (row * size + column))) - exact) > 1e-6 ? 1 : 0;
        }
      }
      EXPECT_EQ(off, 0) << width << 'x' << height << repeats;
    }
  }
}

TEST(Textures, SeamsAtWholeNumbersAreBlendedOrClamped) {
  // Bilinear, four texels wide. At u = 0, 1, −1, … it is half of the first and half of the last texel. When clamped, it
  // is the border texel.
  const Texels2D texels{4, 1, {0.1f, 0.3f, 0.5f, 0.9f}};
  for (const auto& [wrap, u, exact] : {std::tuple("REPEAT", 0.0, 0.5),
                                       {"REPEAT", 1.0, 0.5},
                                       {"REPEAT", -1.0, 0.5},
                                       {"REPEAT", 7.0, 0.5},
                                       {"REPEAT", -0.125, 0.9},
                                       {"REPEAT", 1.125, 0.1},
                                       {"REPEAT", 0.0625, 0.3 * 0 + 0.1 * 0.75 + 0.9 * 0.25},
                                       {"CLAMP", 0.0, 0.1},
                                       {"CLAMP", 1.0, 0.9},
                                       {"CLAMP", -1.0, 0.1},
                                       {"CLAMP", 7.0, 0.9},
                                       {"CLAMP", 0.25, 0.2}}) {
    const HalfImages image =
        preview_of(floor_document(fmt::format(R"("filter": "BILINEAR", "wrap": "{}")", wrap), u, 0.3, 1e-4, 4), texels);
    expect_even(image, exact, 1e-3);
  }
}

TEST(Textures, CornersOfAMeshAreCornersOfTheImage) {
  // Just inside each corner of a square with the coordinates 0 and 1, and 2 and −1. It shows the texel of that corner.
  const Texels2D texels = numbered(3, 3);
  for (const auto& [low, high] : {std::pair(0, 1), {-1, 2}}) {
    const std::string square = fmt::format(
        "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt {0} {0}\nvt {1} {0}\nvt {1} {1}\nvt {0} {1}\nf 1/1 2/2 3/3 4/4\n",
        low, high);
    for (const std::string wrap : {"REPEAT", "CLAMP"}) {
      for (const int x : {0, 1}) {
        for (const int y : {0, 1}) {
          std::string text = floor_document(fmt::format(R"("filter": "NEAREST", "wrap": "{}")", wrap),
                                            0.999 * (2 * x - 1), 0.999 * (1 - 2 * y), 1e-4, 4);
          const std::size_t shape = text.find(R"("plane")");
          text.replace(shape, text.size() - shape, R"("mesh": {"file": "square.obj"}}]})");
          const auto scene = TestScene::from_text(text, {{"t.exr", texels.file()}, {"square.obj", square}}, read_image);
          expect_even(clean_picture(scene, "preview", 1), texels.at(2 * x, 2 * y), 1e-6);
        }
      }
    }
  }
}

TEST(Textures, StayWithinTheirTexelsAtHugeCoordinates) {
  // Coordinates so large that single precision has no fraction of them, or all equal. Each shows some texel, never
  // another value.
  const Texels2D texels{2, 2, {0.2f, 0.4f, 0.6f, 0.8f}};
  for (const std::string filter : {"NEAREST", "BILINEAR"}) {
    for (const std::string wrap : {"REPEAT", "CLAMP"}) {
      for (const std::string where : {R"("scale": [1e6, -1e6])", R"("scale": [1e6, 1e6], "offset": [-1e6, 1e6])",
                                      R"("scale": [0, 0])", R"("scale": [1e-300, 1e-300])"}) {
        for (const double x : {0.0, 1e6, -1e12}) {
          const std::string text =
              floor_document(fmt::format(R"("filter": "{}", "wrap": "{}", {})", filter, wrap, where), x, -x, 10, 16);
          expect_even(preview_of(text, texels), 0.5, 0.3 + 1e-6);
        }
      }
    }
  }
  // To the horizon.
  std::string text = floor_document(R"("scale": [1e6, 1e6])", 0, 0, 10, 32);
  text.replace(text.find(R"("up": [0, 0, -1])"), 16, R"("up": [0, 1, 0])");
  text.replace(text.find(R"("look_at": [0, 0, 0])"), 20, R"("look_at": [0, 10, -1])");
  expect_even(preview_of(text, texels), 0.4, 0.4 + 1e-6);
}

TEST(Textures, ObjectsWithoutCoordinatesHaveTheFirstTexel) {
  // A sphere has (0, 0) everywhere, the lower left texel. So has a mesh without `vt`, or with a single one.
  const Texels2D texels = numbered(3, 2);
  const std::string nearest = R"("filter": "NEAREST")";
  for (const std::string shape : {R"("sphere": {"center": [0, -1, 0], "radius": 1}}]})",
                                  R"("mesh": {"file": "plain.obj"}}]})", R"("mesh": {"file": "one.obj"}}]})"}) {
    std::string text = floor_document(nearest, 0, 0, 0.1, 8);
    const std::size_t at = text.find(R"("plane")");
    text.replace(at, text.size() - at, shape);
    const auto scene = TestScene::from_text(text,
                                            {{"t.exr", texels.file()},
                                             {"plain.obj", "v -9 0 9\nv 9 0 9\nv 0 0 -9\nf 1 2 3\n"},
                                             {"one.obj", "v -9 0 9\nv 9 0 9\nv 0 0 -9\nvt 0 0\nf 1/1 2/1 3/1\n"}},
                                            read_image);
    SCOPED_TRACE(shape);
    expect_even(clean_picture(scene, "preview", 1), texels.at(0, 0), 1e-6);
  }
}

TEST(Textures, ReflectanceIsClampedToZeroAndOne) {
  // A float image can have any value, but a surface reflects at most all light. The sky has radiance 1.
  for (const auto& [value, exact] : {std::pair(5.0f, 1.0), {-3.0f, 0.0}, {0.25f, 0.25}, {1e30f, 1.0}}) {
    std::string text = floor_document(R"("filter": "BILINEAR")", 0, 0, 1, 8);
    text.insert(text.size() - 1, fmt::format(R"(, "lights": [{}])", sky(1)));
    const auto scene = TestScene::from_text(text, {{"t.exr", image_of(1, {value})}}, read_image);
    for (const std::string method : {"path", "raycast", "whitted"}) {
      expect_even(clean_picture(scene, method, 3), exact, 1e-5);
    }
  }
}

TEST(Textures, EmissionByATextureIsItsTexels) {
  // A glowing square of four texels from black to very bright. A floor far below it receives their mean.
  for (const float bright : {1.0f, 1e6f}) {
    const Texels2D texels{2, 2, {0, bright, bright / 2, bright / 4}};
    const auto scene = TestScene::from_text(
        fmt::format(R"({{"camera": {{"eye": [0, 1, 0.01], "look_at": [0, 0, 0], "vertical_fov_degrees": 0.01}},
            "film": {{"width": 8, "height": 8}}, "textures": [{{"name": "t", "file": "t.exr", "filter": "NEAREST"}}],
            "materials": [{}, {{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {{"texture": "t", "rgb": [1, 1, 1]}}}}],
            "objects": [{}, {}]}})",
                    diffuse("floor", 1), gray(0), mesh("floor", "floor.obj"), mesh("lamp", "lamp.obj")),
        {{"t.exr", texels.file()},
         {"floor.obj", plane(400, 0, true)},
         {"lamp.obj",
          "v -60 90 -60\nv 60 90 -60\nv 60 90 60\nv -60 90 60\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"}},
        read_image);
    // By symmetry each quarter has a quarter of the square's form factor, that of a corner.
    const double x = 60.0 / 90, s = std::sqrt(1 + x * x);
    const double corner = 2 * x / s * std::atan(x / s) / (2 * M_PI);
    const Estimate seen = mean_of(clean_picture(scene, "path", 12, 1), 0);
    expect_answer(seen, 1.75 * static_cast<double>(bright) * corner, 1e-2);
  }
}

TEST(Textures, AreRefusedWhenInvalid) {
  const auto why = [](const std::string& settings, const std::map<std::string, std::string>& files) {
    return refusal(floor_document(settings, 0, 0, 1, 4), files, read_image);
  };
  const std::string plain = R"("filter": "NEAREST")";
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(why(plain, {}), "textures[0].file: cannot open t.exr: No such file or directory");
  expect(why(plain, {{"t.exr", ""}}), "t.exr");
  expect(why(plain, {{"t.exr", "no picture"}}), "textures[0] \"t\": t.exr: ");
  expect(why(plain, {{"t.exr", numbered(9, 9).file().substr(0, 300)}}), "textures[0] \"t\": t.exr: ");
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    expect(why(plain, {{"t.exr", image_of(2, {0.5f, 0.5f, 0.5f, value})}}),
           "textures[0] \"t\": t.exr: pixel (1, 1) is not finite");
  }
  expect(why(R"("scale": [1e7, 1])", {{"t.exr", numbered(1, 1).file()}}),
         "textures[0].scale: must be finite and at most 1000000");
}

}  // namespace
}  // namespace lightmill::test
