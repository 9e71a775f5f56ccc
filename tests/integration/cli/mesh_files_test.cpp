// Mesh files on the command line: what they lack, what is wrong in them, and moments of animations.
#include <numeric>

#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/unit/scene_io/gltf_text.h"

namespace lightmill::test {
namespace {

const std::string kCube =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
constexpr const char* kBlack = "the picture is almost black (its mean is 0.0 of 255)";

bool has_notice(const nlohmann::json& answer, const std::string& begin) {
  const auto notices = answer["notices"].get<std::vector<std::string>>();
  return std::ranges::any_of(notices, [&](const std::string& notice) { return notice.starts_with(begin); });
}

TEST_F(CliTest, ACubeFillsThePictureUnderASoftSky) {
  const std::string cube = write("cube.obj", kCube);
  const nlohmann::json answer =
      json({"render", cube, "--local", "--size", "64x64", "--spp", "16", "-o", file("a.exr")});
  EXPECT_TRUE(has_notice(answer, "nothing emits light: a soft sky was added")) << answer["notices"];
  EXPECT_FALSE(has_notice(answer, "the picture is almost black"));
  const Result<RgbImage> image = load_rgb(file("a.exr"));
  ASSERT_TRUE(image.ok()) << image.status();
  // A side of normal n has the radiance 0.5 (0.6 + 0.4 n · d), and the sky behind the middle 0.6 (1 + w · d). Seen in
  // parallel along (0.48, 0.36, 0.8), the sides cover 4 × 0.48, 0.36 and 0.8 of the film's (2 √3 / cos 20°)².
  const std::array<double, 3> d{-0.25 / 1.0173, 0.85 / 1.0173, 0.5 / 1.0173}, view{0.48, 0.36, 0.8};
  double sides = 0, covered = 0, behind = 0.6;
  for (std::size_t i = 0; i < 3; ++i) {
    const double share = 4 * view[i] / 13.588;
    covered += share;
    sides += share * 0.5 * (0.6 + 0.4 * d[i]);
    behind -= 0.6 * view[i] * d[i];
  }
  const double mean =
      std::accumulate(image->values.begin(), image->values.end(), 0.0) / static_cast<double>(image->values.size());
  EXPECT_NEAR(mean, sides + (1 - covered) * behind, 0.02);
}

TEST_F(CliTest, ABlackPictureIsReported) {
  const std::string cube = write("cube.obj", kCube);
  const nlohmann::json answer = json({"render", cube, "--local", "--size", "16x16", "--spp", "1", "--method", "path",
                                      "--sky", "off", "-o", file("a.png")});
  EXPECT_TRUE(has_notice(answer, kBlack)) << answer["notices"];
}

TEST_F(CliTest, FaultsOfMeshFilesAreNoticesUnlessStrict) {
  const std::string odd = write("odd.obj", "mtllib none.mtl\n" + kCube + "odd line\nusemtl (null)\nf 1 2 3\n");
  const nlohmann::json answer = json({"check", odd});
  EXPECT_EQ(answer["triangles"], 13);
  EXPECT_EQ(answer["lights"]["environment"], 1);
  EXPECT_TRUE(has_notice(answer, odd + ":1: mtllib: there is no file none.mtl. ")) << answer["notices"];
  EXPECT_TRUE(has_notice(answer, odd + ":16: unknown statement \"odd\". ")) << answer["notices"];
  for (const char* command : {"check", "render"}) {
    const CommandResult strict = lightmill({command, odd, "--strict"});
    EXPECT_EQ(strict.exit_code, 2) << command;
    EXPECT_EQ(strict.err.find("lightmill: --strict: " + odd + ":16: unknown statement"), 0u) << strict.err;
  }
}

/// A triangle in front of a camera. The animation `leaves` moves it out of the picture in two seconds, `stays` does not.
std::string moving_triangle() {
  GltfBuffer buffer;
  const int corners = buffer.positions({-1, -1, 0, 1, -1, 0, 0, 1, 0});
  const int times = buffer.add(packed<float>({0, 2}), "SCALAR", 5126, 2);
  const int away = buffer.add(packed<float>({0, 0, 0, 99, 0, 0}), "VEC3", 5126, 2);
  const int here = buffer.add(packed<float>({0, 0, 0, 0, 0, 0}), "VEC3", 5126, 2);
  const auto animation = [&](std::string_view name, int positions) {
    return fmt::format(R"({{"name":"{}","channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}],
"samplers":[{{"input":{},"output":{}}}]}})",
                       name, times, positions);
  };
  return gltf(
      fmt::format(R"({},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],"scenes":[{{"nodes":[0,1]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":0.1}}}}],
"nodes":[{{"mesh":0}},{{"camera":0,"translation":[0,0,4]}}],"animations":[{},{}])",
                  buffer.embedded(), corners, animation("leaves", away), animation("stays", here)));
}

TEST_F(CliTest, AMomentOfAnAnimationIsRendered) {
  const std::string file_name = write("a.gltf", moving_triangle());
  const auto shows_triangle = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command{"render",   file_name, "--local", "--size", "16x16", "--spp",      "4",
                                     "--method", "path",    "--sky",   "on",     "-o",    file("a.exr")};
    command.insert(command.end(), options.begin(), options.end());
    json(command);
    const Result<RgbImage> image = load_rgb(file("a.exr"));
    EXPECT_TRUE(image.ok()) << image.status();
    // Alone, the white sky has the value 1.
    return image.ok() && std::ranges::any_of(image->values, [](float value) { return value < 0.99F; });
  };
  EXPECT_TRUE(shows_triangle({"--at", "0"}));
  EXPECT_FALSE(shows_triangle({"--at", "2"}));
  EXPECT_TRUE(shows_triangle({"--at", "2", "--animation", "stays"}));
  EXPECT_TRUE(shows_triangle({"--animation", "leaves"})) << "its beginning";
}

TEST_F(CliTest, MomentsThatAFileLacksAreRefused) {
  const std::string animated = write("a.gltf", moving_triangle()), cube = write("cube.obj", kCube);
  const auto refusal = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command{"check"};
    command.insert(command.end(), options.begin(), options.end());
    const CommandResult refused = lightmill(command);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    return refused.err;
  };
  EXPECT_EQ(refusal({animated, "--animation", "run"}),
            "lightmill: " + animated + ": there is no animation run. It has 2 animations: leaves, stays\n");
  EXPECT_EQ(refusal({animated, "--at", "nan"}).substr(0, 56),
            "lightmill: --at: must be a number from 0 to 1000000000, ");
  EXPECT_EQ(refusal({cube, "--at", "1"}),
            "lightmill: --at and --animation apply only to glTF files, and " + cube + " is not one: leave them out\n");
}

}  // namespace
}  // namespace lightmill::test
