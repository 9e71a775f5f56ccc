// OBJ files without a scene on the command line: what they lack, and what is wrong in them.
#include <numeric>

#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

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

TEST_F(CliTest, ACubeFillsThePictureUnderAWhiteSky) {
  const std::string cube = write("cube.obj", kCube);
  const nlohmann::json answer =
      json({"render", cube, "--local", "--size", "64x64", "--spp", "16", "-o", file("a.exr")});
  EXPECT_TRUE(has_notice(answer, "nothing emits light: an even white sky was added")) << answer["notices"];
  EXPECT_FALSE(has_notice(answer, "the picture is almost black"));
  const Result<RgbImage> image = load_rgb(file("a.exr"));
  ASSERT_TRUE(image.ok()) << image.status();
  // The grey of a convex body under a white sky is its reflectance 0.5. Seen in parallel along (0.48, 0.36, 0.8), the
  // cube covers 4 (0.48 + 0.36 + 0.8) of the film's (2 √3 / cos 20°)², which is 0.48.
  const double mean =
      std::accumulate(image->values.begin(), image->values.end(), 0.0) / static_cast<double>(image->values.size());
  EXPECT_NEAR(mean, 1 - 0.5 * 0.48, 0.04);
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
  EXPECT_TRUE(has_notice(answer, odd + ":1: mtllib: there is no file none.mtl; ")) << answer["notices"];
  EXPECT_TRUE(has_notice(answer, odd + ":16: unknown statement \"odd\"; ")) << answer["notices"];
  for (const char* command : {"check", "render"}) {
    const CommandResult strict = lightmill({command, odd, "--strict"});
    EXPECT_EQ(strict.exit_code, 2) << command;
    EXPECT_EQ(strict.err.find("lightmill: --strict: " + odd + ":16: unknown statement"), 0u) << strict.err;
  }
}

}  // namespace
}  // namespace lightmill::test
