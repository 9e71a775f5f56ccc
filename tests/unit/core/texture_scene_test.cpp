// Textures from image files to pictures, through public scene documents.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "common/image/exr.h"
#include "common/image/png.h"
#include "tests/analytic/meter_text.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"

namespace lightmill::test {
namespace {

/// 2×2: red, green above blue, white.
std::string small_png() {
  const std::vector<std::uint8_t> rgb{255, 0, 0, 0, 255, 0, 0, 0, 255, 188, 188, 188};
  return *encode_png(2, 2, rgb);
}

TEST(ReadImage, PngGivesBytesThatAreEncoded) {
  const std::string png = small_png();
  const auto texels = read_image(as_byte_view(png), "small.png");
  ASSERT_TRUE(texels.ok()) << message_of(texels.status());
  EXPECT_EQ(texels->width, 2);
  EXPECT_EQ(texels->height, 2);
  EXPECT_TRUE(texels->encoded);
  EXPECT_EQ(texels->bytes, (std::vector<std::uint32_t>{0xff0000ff, 0xff00ff00, 0xffff0000, 0xffbcbcbc}));
}

/// One pixel with alpha: at 8 bits (200, 200, 200, 64), at 16 bits 257 times (200, 0, 255, 64).
std::string png_with_alpha(int bits) {
  const std::string header("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1", 24);
  const std::string end("\0\0\0\0IEND\xae\x42\x60\x82", 12);
  const std::string byte_pixel(
      "\x08\x06\x00\x00\x00\x1f\x15\xc4\x89\x00\x00\x00\x0d\x49\x44\x41\x54\x78\x9c\x63\x38\x71\xe2\x84\x03\x00\x07\x4d"
      "\x02\x99\xfb\x57\x3a\xf6",
      34);
  const std::string word_pixel(
      "\x10\x06\x00\x00\x00\x4f\x85\x18\xca\x00\x00\x00\x11\x49\x44\x41\x54\x78\x9c\x63\x38\x71\x82\x81\xe1\xff\x7f\x07"
      "\x07\x00\x13\x7a\x04\x0f\xab\x71\xbe\xc9",
      38);
  return header + (bits == 8 ? byte_pixel : word_pixel) + end;
}

TEST(ReadImage, ColoursAreNotMultipliedByAlpha) {
  const std::string bytes = png_with_alpha(8), words = png_with_alpha(16);
  const auto small = read_image(as_byte_view(bytes), "leaf.png");
  ASSERT_TRUE(small.ok()) << message_of(small.status());
  EXPECT_EQ(small->bytes, std::vector<std::uint32_t>{0x40c8c8c8});
  const auto deep = read_image(as_byte_view(words), "leaf.png");
  ASSERT_TRUE(deep.ok()) << message_of(deep.status());
  const std::array<float, 4> expected{200 / 255.0f, 0, 1, 64 / 255.0f};
  EXPECT_EQ(deep->words, std::vector<std::uint64_t>{0x4040ffff0000c8c8}) << "16 bits stay 16 bits";
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(values_of(*deep)[i], expected[i], 1e-6f) << i;
  }
}

TEST(ReadImage, DetectsTheFormatByContentNotByName) {
  const std::string png = small_png();
  for (const std::string name : {"a.png", "a.PNG", "a.jpg", "noending", "a.b c.tif"}) {
    const auto texels = read_image(as_byte_view(png), name);
    ASSERT_TRUE(texels.ok()) << texels.status();
    EXPECT_EQ(texels->bytes, read_image(as_byte_view(png), "small.png")->bytes) << name;
  }
  EXPECT_NE(message_of(read_image(as_byte_view("nothing"), "a.png").status()).find("none of the formats PNG, "),
            std::string::npos);
}

TEST(ReadImage, AnErrorNamesTheFileThatIsNoImage) {
  const std::string garbage = "this is no image";
  for (const std::string name : {"a.png", "b.exr", "c.hdr", "d.jpg", "e.tif", "noending"}) {
    const auto texels = read_image(as_byte_view(garbage), name);
    ASSERT_FALSE(texels.ok()) << name;
    EXPECT_TRUE(message_of(texels.status()).starts_with(name + ":")) << message_of(texels.status());
  }
#ifndef __SANITIZE_ADDRESS__  // libpng leaves a truncated file by a jump that leaks a string of OpenImageIO's
  const std::string png = small_png();
  EXPECT_FALSE(read_image(as_byte_view(png.substr(0, png.size() / 2)), "cut.png").ok());
  EXPECT_EQ(
      message_of(read_image(as_byte_view(png.substr(0, png.size() - 20)), "cut.png").status()),
      "cut.png: the image is damaged: not all of its pixels can be read: Read error: hit end of file. Save it again")
      << "the error is reported once, not by each caller";
#endif
}

/// A square of two units in the plane z = 0 that fills the picture. Each quarter of the picture is one texel.
std::string document(const std::string& texture, const std::string& materials) {
  return fmt::format(R"({{"camera": {{"eye": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 90}},
      "film": {{"width": 8, "height": 8, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
      "textures": [{}], "materials": [{}],
      "objects": [{{"material": "picture", "mesh": {{"file": "square.obj"}}}}]}})",
                     texture, materials);
}
const std::string kSquare =
    "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
const std::string kNearest = R"({"name": "t", "file": "small.png", "filter": "NEAREST"})";

HalfImages preview(const std::string& document) {
  return TestScene::from_text(document, {{"square.obj", kSquare}, {"small.png", small_png()}}, read_image)
      .render({"preview", 1, 0}, 1);
}

void expect_pixel(const HalfImages& image, int x, int y, std::array<double, 3> rgb) {
  const auto i = static_cast<std::size_t>(3 * (y * image.width + x));
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(image.mean(i + c), rgb[c], 1e-6) << x << ", " << y << " channel " << c;
  }
}

TEST(TextureScene, ReflectanceIsTheTexelTimesItsFactor) {
  const HalfImages image = preview(document(
      kNearest, R"({"name": "picture", "diffuse": {"reflectance": {"texture": "t", "rgb": [0.5, 1, 0.25]}}})"));
  expect_pixel(image, 1, 1, {0.5, 0, 0});
  expect_pixel(image, 6, 1, {0, 1, 0});
  expect_pixel(image, 1, 6, {0, 0, 0.25});
  const double gray = std::pow((188 / 255.0 + 0.055) / 1.055, 2.4);
  expect_pixel(image, 6, 6, {0.5 * gray, gray, 0.25 * gray});
}

TEST(TextureScene, TransparentTexelsKeepTheirColour) {
  const std::string text = document(kNearest, R"({"name": "picture", "diffuse": {"reflectance": {"texture": "t"}}})");
  const HalfImages image =
      TestScene::from_text(text, {{"square.obj", kSquare}, {"small.png", png_with_alpha(8)}}, read_image)
          .render({"preview", 1, 0}, 1);
  const double grey = std::pow((200 / 255.0 + 0.055) / 1.055, 2.4);
  expect_pixel(image, 4, 4, {grey, grey, grey});
}

TEST(TextureScene, DataAreNotDecoded) {
  const HalfImages image =
      preview(document(R"({"name": "t", "file": "small.png", "filter": "NEAREST", "color_space": "LINEAR"})",
                       R"({"name": "picture", "diffuse": {"reflectance": {"texture": "t"}}})"));
  expect_pixel(image, 6, 6, {188 / 255.0, 188 / 255.0, 188 / 255.0});
}

TEST(TextureScene, FactorMapsMixMaterials) {
  const HalfImages image = preview(document(kNearest, R"({"name": "picture", "mixture": {
      "first": {"diffuse": {"reflectance": {"rgb": [1, 0.5, 0.25]}}}, "second": {"diffuse": {"reflectance": {"rgb": [0, 0, 0]}}},
      "factor": 1, "factor_map": {"texture": "t", "channel": "G"}}})"));
  expect_pixel(image, 1, 1, {1, 0.5, 0.25});
  expect_pixel(image, 6, 1, {0, 0, 0});
  expect_pixel(image, 1, 6, {1, 0.5, 0.25});
}

TEST(TextureScene, EmissionTakesTextures) {
  const std::string text = document(
      kNearest,
      R"({"name": "picture", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"texture": "t", "rgb": [3, 3, 3]}})");
  const HalfImages image = TestScene::from_text(text, {{"square.obj", kSquare}, {"small.png", small_png()}}, read_image)
                               .render({"path", 1, 0}, 1);
  expect_pixel(image, 1, 1, {3, 0, 0});
  expect_pixel(image, 6, 1, {0, 3, 0});
}

/// Irradiance at p = (x, z) on a floor that faces up. The emitter at height 1 is a square, or its half next to the
/// origin. Uses the midpoint rule; `radiance` is a function of places in [0, 1]².
template <class Radiance>
double irradiance_by(std::array<double, 2> p, double side, bool triangle, Radiance radiance) {
  constexpr int kSteps = 800;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < (triangle ? kSteps - i : kSteps); ++j) {
      const double u = (i + 0.5) / kSteps, v = (j + 0.5) / kSteps;
      const double share = triangle && j == kSteps - i - 1 ? 0.5 : 1;  // half a cell where the diagonal cuts it
      const double x = u * side - p[0], z = v * side - p[1], d2 = 1 + x * x + z * z;
      sum += share * radiance(u, v) / (d2 * d2);
    }
  }
  return sum * side * side / (kSteps * kSteps);
}

// Without points drawn on the emitter the noise would be far too large, except beneath large emitters.
TEST(TexturedLight, EmitsByItsTexels) {
  // Luminances: red and green above blue and grey.
  const std::array<double, 4> texels{0.2126, 0.7152, 0.0722, std::pow((188 / 255.0 + 0.055) / 1.055, 2.4)};
  const auto by_texels = [&](double u, double v) { return 3 * texels[(v > 0.5 ? 0 : 2) + (u > 0.5 ? 1 : 0)]; };
  const auto read = [&](const std::string& shape, const std::string& obj, std::array<double, 2> p) {
    const auto scene = scene_with(
        fmt::format(
            R"("textures": [{}], "materials": [{{"name": "lamp", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}},
            "emission": {{"texture": "t", "rgb": [3, 3, 3]}}, "two_sided_emission": true}}],
            "objects": [{{"material": "lamp", {}}}],
            "meters": [{{"name": "m", "irradiance": {{"point": [{}, 0, {}], "normal": [0, 1, 0]}}}}])",
            kNearest, shape, p[0], p[1]),
        {{"lamp.obj", obj}, {"small.png", small_png()}}, read_image);
    return read_meters(scene, 4, 1, read_image)[0];
  };
  const std::string mesh = R"("mesh": {"file": "lamp.obj"})";
  for (const double side : {0.1, 1.5}) {
    for (const std::array<double, 2> p : {std::array<double, 2>{0, 0}, {1.4, 0.2}}) {
      const std::string square = fmt::format(
          "v 0 1 0\nv {0} 1 0\nv {0} 1 {0}\nv 0 1 {0}\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n", side);
      expect_reading(read(mesh, square, p), irradiance_by(p, side, false, by_texels), 4e-2);
      // As two triangles. The second one begins at another corner.
      const std::string halves = square.substr(0, square.find('f')) + "f 1/1 2/2 3/3\nf 4/4 1/1 3/3\n";
      expect_reading(read(mesh, halves, p), irradiance_by(p, side, false, by_texels), 4e-2);
      const std::string triangle =
          fmt::format(R"("triangle": {{"a": [0, 1, 0], "b": [{0}, 1, 0], "c": [0, 1, {0}]}})", side);
      expect_reading(read(triangle, "", p), irradiance_by(p, side, true, by_texels), 4e-2);
    }
  }
  // Coordinates that do not fit a parallelogram: green only near the last corner.
  const std::string mapped =
      "v 0 1 0\nv 0.1 1 0\nv 0.1 1 0.1\nv 0 1 0.1\nvt 0.1 0.9\nvt 0.2 0.9\nvt 0.1 0.8\nvt 0.9 0.9\n"
      "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
  const auto by_halves = [&](double u, double v) { return 3 * texels[v - u > 0.5 ? 1 : 0]; };
  expect_reading(read(mesh, mapped, {0, 0}), irradiance_by({0, 0}, 0.1, false, by_halves), 4e-2);
}

TEST(TexturedLight, IsAPointOfItsMeanColourInRaycast) {
  const std::string text = R"({"camera": {"eye": [0, 0, 0.5], "look_at": [0, 0.0001, 0], "vertical_fov_degrees": 0.01},
      "film": {"width": 8, "height": 8, "filter": {"kind": "BOX", "radius_pixels": 0.5}},
      "textures": [)" + kNearest +
                           R"(], "materials": [
          {"name": "white", "diffuse": {"reflectance": {"rgb": [1, 1, 1]}}},
          {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "two_sided_emission": true,
           "emission": {"texture": "t", "rgb": [3, 6, 3]}}],
      "objects": [{"material": "white", "plane": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
                  {"material": "lamp", "mesh": {"file": "square.obj"}, "transform": {"translate": [0, 0, 2]}}]})";
  const HalfImages image = TestScene::from_text(text, {{"square.obj", kSquare}, {"small.png", small_png()}}, read_image)
                               .render({"raycast", 1, 0}, 1);
  const double grey = std::pow((188 / 255.0 + 0.055) / 1.055, 2.4), of_power = 4.0 / 4 / M_PI * (1 + grey) / 4;
  EXPECT_NEAR(mean_of(image, 0).value, 3 * of_power, 1e-4);
  EXPECT_NEAR(mean_of(image, 1).value, 6 * of_power, 1e-4);
}

/// The square under a sun and a uniform sky.
HalfImages shaded(const std::string& textures, const std::string& material, const std::string& method = "path") {
  std::string text = document(textures, R"({"name": "picture", )" + material + "}");
  text.insert(text.size() - 1, R"(, "lights": [
      {"directional": {"direction": [0.3, 0.1, -1], "irradiance": {"rgb": [3, 3, 3]}}},
      {"environment": {"radiance": {"rgb": [0.2, 0.5, 0.9]}}}])");
  return TestScene::from_text(text, {{"square.obj", kSquare}, {"small.png", small_png()}}, read_image)
      .render({method, 1, 0}, 4);
}

TEST(TextureScene, MapsTakeOneChannel) {
  // One texel is (188, 188, 188). The others have 0 or 255 in each channel. Data are not decoded.
  const std::string data = R"({"name": "t", "file": "small.png", "filter": "NEAREST"})";
  const auto principled = [](double metallic, double roughness) {
    return fmt::format(R"("principled": {{"metallic": {}, "roughness": {}}})", metallic, roughness);
  };
  const std::string gold = R"("conductor": {"metal": "gold", "roughness": 0.6})";
  const std::string glass = R"("dielectric": {"roughness": 0.6})";
  const auto clay = [](double roughness) {
    return fmt::format(R"("diffuse": {{"reflectance": {{"rgb": [0.7, 0.7, 0.7]}}, "roughness": {}}})", roughness);
  };
  // A principled material with all layers. One number has this value, and a map.
  const auto layered = [](const std::string& name, double value, bool map) {
    std::string fields = R"("sheen_color": {"rgb": [0.4, 0.5, 0.6]})";
    for (const auto& [other, its] : {std::pair{"specular", 0.6}, {"transmission", 0.3}, {"coat", 0.7}}) {
      fields += name == other ? "" : fmt::format(R"(, "{}": {})", other, its);
    }
    fields += fmt::format(R"(, "{}": {})", name, value);
    fields += map ? fmt::format(R"(, "{}_map": {{"texture": "t", "channel": "G"}})", name) : "";
    return R"("principled": {)" + fields + "}";
  };
  struct Case {
    std::string mapped;
    double factor;
    std::string as;
  };
  for (const Case& c :
       {Case{gold + R"(, "roughness_map": {"texture": "t", "channel": "G"})", 188 / 255.0,
             R"("conductor": {"metal": "gold", "roughness": 0.44235294})"},
        Case{glass + R"(, "roughness_map": {"texture": "t"})", 188 / 255.0,
             R"("dielectric": {"roughness": 0.44235294})"},
        Case{clay(0.6) + R"(, "roughness_map": {"texture": "t"})", 188 / 255.0, clay(0.44235294)},
        Case{principled(1, 0.6) + R"(, "roughness_map": {"texture": "t", "channel": "B"})", 0,
             principled(1, 0.44235294)},
        Case{principled(0.8, 0.3) + R"(, "metallic_map": {"texture": "t", "channel": "R"})", 0,
             principled(0.58980392, 0.3)},
        Case{layered("specular", 0.8, true), 0, layered("specular", 0.58980392, false)},
        Case{layered("transmission", 0.8, true), 0, layered("transmission", 0.58980392, false)},
        Case{layered("coat", 0.8, true), 0, layered("coat", 0.58980392, false)},
        Case{layered("coat_roughness", 0.8, true), 0, layered("coat_roughness", 0.58980392, false)},
        Case{layered("sheen_roughness", 0.8, true), 0, layered("sheen_roughness", 0.58980392, false)}}) {
    const HalfImages mapped = shaded(data, c.mapped), plain = shaded(data, c.as);
    for (const auto& [x, y] : {std::pair{5, 5}, {6, 6}, {7, 5}}) {
      const auto i = static_cast<std::size_t>(3 * (y * mapped.width + x));
      EXPECT_GT(plain.mean(i), 0);
      EXPECT_NEAR(mapped.mean(i), plain.mean(i), 1e-4 * plain.mean(i)) << c.mapped;
    }
  }
  // The red texel has no green, so gold is smooth there and shows only the sky.
  const HalfImages mapped = shaded(data, gold + R"(, "roughness_map": {"texture": "t", "channel": "G"})");
  const HalfImages smooth = shaded(data, R"("conductor": {"metal": "gold"})");
  const std::size_t red = 3 * (1 * 8 + 1);
  EXPECT_NEAR(mapped.mean(red), smooth.mean(red), 1e-4);
}

TEST(TextureScene, WhittedFollowsReflectionsOfTexturedSmoothSurfaces) {
  const std::string data = R"({"name": "t", "file": "small.png", "filter": "NEAREST"})";
  const std::string map = R"(, "roughness_map": {"texture": "t", "channel": "G"})";
  const auto at = [](const HalfImages& image, int x, int y) {
    return image.mean(static_cast<std::size_t>(3 * (y * image.width + x)));
  };
  struct Case {
    std::string rough, smooth;
  };
  for (const Case& c :
       {Case{R"("conductor": {"metal": "gold", "roughness": 0.6})", R"("conductor": {"metal": "gold"})"},
        Case{R"("dielectric": {"roughness": 0.6})", R"("dielectric": {})"},
        Case{R"("principled": {"metallic": 1, "roughness": 0.6})",
             R"("principled": {"metallic": 1, "roughness": 0})"}}) {
    const HalfImages mapped = shaded(data, c.rough + map, "whitted");
    // The red texel has no green, the green one has all.
    const HalfImages smooth = shaded(data, c.smooth, "whitted"), rough = shaded(data, c.rough, "raycast");
    EXPECT_GT(at(smooth, 1, 1), 0.05) << c.smooth;
    EXPECT_NEAR(at(mapped, 1, 1), at(smooth, 1, 1), 1e-6) << c.smooth;
    EXPECT_NEAR(at(mapped, 6, 1), at(rough, 6, 1), 1e-6) << c.rough;
    EXPECT_EQ(at(shaded(data, c.rough + map, "raycast"), 1, 1), 0) << c.rough;
  }
}

TEST(TextureScene, ATextureForColourAndDataIsDecodedForBothByDefault) {
  const std::string both = R"("principled": {"base_color": {"texture": "t"}, "metallic": 1, "roughness": 0.6},
      "roughness_map": {"texture": "t", "channel": "G"})";
  const double gray = std::pow((188 / 255.0 + 0.055) / 1.055, 2.4);
  const std::string same =
      fmt::format(R"("principled": {{"base_color": {{"texture": "t"}}, "metallic": 1, "roughness": {}}})", 0.6 * gray);
  const HalfImages mapped = shaded(kNearest, both), plain = shaded(kNearest, same);
  const std::size_t i = 3 * (6 * 8 + 6);
  EXPECT_NEAR(mapped.mean(i), plain.mean(i), 1e-4 * plain.mean(i));
}

TEST(TextureScene, TexelsAreClampedToReflectances) {
  // As reflectances the EXR values 2, −1 and 0.5 count as 1, 0 and 0.5, which conserves energy. As emission only −1 is
  // clamped.
  const std::string exr =
      *encode_exr({{0, 0, 1, 1},
                   {0, 0, 1, 1},
                   {{"R", std::vector<float>{2}}, {"G", std::vector<float>{-1}}, {"B", std::vector<float>{0.5f}}},
                   {}});
  const auto seen = [&](const std::string& material) {
    return TestScene::from_text(
               document(R"({"name": "t", "file": "a.exr"})", R"({"name": "picture", )" + material + "}"),
               {{"square.obj", kSquare}, {"a.exr", exr}}, read_image)
        .render({"preview", 1, 0}, 1);
  };
  expect_pixel(seen(R"("diffuse": {"reflectance": {"texture": "t"}})"), 3, 3, {1, 0, 0.5});
  expect_pixel(seen(R"("diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"texture": "t"})"), 3, 3,
               {2, 0, 0.5});
}

TEST(TextureScene, PlanesHaveCoordinatesOfLengthOneAlongTheirTangents) {
  // Seen from above with x to the right and z downwards: u = x, v = −z.
  const std::string text = R"({"camera": {"eye": [1, 1, -1], "look_at": [1, 0, -1], "up": [0, 0, -1],
        "vertical_fov_degrees": 90},
      "film": {"width": 8, "height": 8, "filter": {"kind": "BOX", "radius_pixels": 0.5}},
      "textures": [{"name": "t", "file": "small.png", "filter": "NEAREST", "scale": [0.5, 0.5]}],
      "materials": [{"name": "floor", "diffuse": {"reflectance": {"texture": "t"}}}],
      "objects": [{"material": "floor", "plane": {"point": [0, 0, 0], "normal": [0, 3, 0]}}]})";
  const HalfImages image =
      TestScene::from_text(text, {{"small.png", small_png()}}, read_image).render({"preview", 1, 0}, 1);
  expect_pixel(image, 1, 1, {1, 0, 0});
  expect_pixel(image, 6, 1, {0, 1, 0});
  expect_pixel(image, 1, 6, {0, 0, 1});
}

// The lower left quarter is tile 1001, red, and the upper right one tile 1012, grey. The others have no tile.
TEST(TextureScene, TilesComeFromFilesWithNumbers) {
  const std::string text = document(R"({"name": "t", "file": "wall.<UDIM>.png", "scale": [2, 2]})",
                                    R"({"name": "picture", "diffuse": {"reflectance": {"texture": "t"}}})");
  const std::vector<std::uint8_t> red{255, 0, 0}, grey{188, 188, 188};
  std::map<std::string, std::string> files{{"square.obj", kSquare},
                                           {"wall.1001.png", *encode_png(1, 1, red)},
                                           {"wall.1012.png", *encode_png(1, 1, grey)},
                                           {"wall.100.png", "no tile"},
                                           {"wall.2001.png", "no tile"},
                                           {"wall.10a1.png", "no tile"}};
  const TestScene scene = TestScene::from_text(text, files, read_image);
  ASSERT_EQ(scene.scene().textures.size(), 2u);
  EXPECT_EQ(scene.scene().textures[0].tile, 1001);
  EXPECT_EQ(scene.scene().textures[1].tile, 1012);
  EXPECT_EQ(scene.scene().textures[1].tile_of, 0u);
  const HalfImages image = scene.render({"preview", 1, 0}, 1);
  expect_pixel(image, 1, 6, {1, 0, 0});
  expect_pixel(image, 6, 6, {0, 0, 0});
  expect_pixel(image, 1, 1, {0, 0, 0});
  const double linear = std::pow((188 / 255.0 + 0.055) / 1.055, 2.4);
  expect_pixel(image, 6, 1, {linear, linear, linear});
  EXPECT_NE(refusal(document(R"({"name": "t", "file": "<UDIM>/wall.png"})",
                             R"({"name": "picture", "diffuse": {"reflectance": {"texture": "t"}}})"),
                    files, read_image),
            "")
      << "only file names have tiles";
  files.erase("wall.1001.png");
  files.erase("wall.1012.png");
  EXPECT_EQ(refusal(text, files, read_image),
            "scene.json:3:42: textures[0].file: there is no tile, such as wall.1001.png");
}

TEST(TextureScene, TilesOfDocumentsAreChecked) {
  const auto refused = [](const std::string& second) {
    const std::string message =
        refusal(document(R"({"name": "t", "file": "small.png", "tile": 1001}, )" + second,
                         R"({"name": "picture", "diffuse": {"reflectance": {"texture": "t"}}})"),
                {{"square.obj", kSquare}, {"small.png", small_png()}}, read_image);
    return message.substr(std::min(message.find("textures[1]"), message.size()));
  };
  EXPECT_EQ(refused(R"({"name": "u", "file": "small.png", "tile": 1002, "tile_of": "t"})"), "");
  EXPECT_EQ(refused(R"({"name": "u", "file": "small.png", "tile": 1001, "tile_of": "t"})"),
            "textures[1].tile: the texture has an image for tile 1001 already");
  EXPECT_EQ(refused(R"({"name": "u", "file": "small.png", "tile": 1000})"),
            "textures[1].tile: a UDIM number from 1001 to 2000 is expected, got 1000");
  EXPECT_EQ(refused(R"({"name": "u", "file": "small.png", "tile": 1002, "tile_of": "v"})"),
            "textures[1].tile_of: no texture before this one is called \"v\"");
  EXPECT_EQ(
      refused(R"({"name": "u", "file": "small.png", "tile_of": "t"})"),
      "textures[1].tile_of: the texture and the one that it names must both have a tile, and that one no tile_of");
}

TEST(TextureScene, MistakesAreNamed) {
  const auto names = [](const std::string& message, const std::string& part) {
    return message.find(part) == std::string::npos ? testing::AssertionFailure() << message
                                                   : testing::AssertionSuccess();
  };
  const auto error = [](const std::string& textures, const std::string& reflectance) {
    const std::filesystem::path folder = std::filesystem::temp_directory_path();
    const std::filesystem::path path = folder / fmt::format("lightmill-texture-{}.json", ::getpid());
    std::ofstream(path) << document(textures,
                                    R"({"name": "picture", "diffuse": {"reflectance": )" + reflectance + "}}");
    const auto loaded = load_scene(std::span(&path, 1));
    std::filesystem::remove(path);
    return loaded.ok() ? std::string() : message_of(loaded.status());
  };
  EXPECT_TRUE(names(error(kNearest, R"({"texture": "u"})"), "unknown texture \"u\""));
  EXPECT_TRUE(names(error("", R"({"texture": "t"})"), "there are no textures"));
  EXPECT_TRUE(names(error(R"({"name": "t", "file": "nowhere.png"})", R"({"texture": "t"})"), "textures[0].file"));
  EXPECT_TRUE(names(error(kNearest + "," + kNearest, R"({"texture": "t"})"), "names an earlier texture"));
}

}  // namespace
}  // namespace lightmill::test
