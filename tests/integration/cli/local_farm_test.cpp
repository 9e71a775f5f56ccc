// `render --local`: its local farm ends with the command, whatever ends the command.
#include <csignal>

#include "client/cli/film_fetch.h"
#include "common/base/file.h"
#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

/// A render that takes hours.
std::vector<std::string> endless(const std::string& output) {
  return {program("lightmill"),
          "render",
          scene("cornell-bench-blocks.json"),
          "--local",
          "--spp",
          "1000000000",
          "-o",
          output};
}

TEST_F(CliTest, RendersAndLeavesNothingButThePictures) {
  const CommandResult result =
      lightmill({"render", scene("cornell-bench-balls.json"), "--local", "--size", "80x64", "--spp", "4", "-o",
                 file("a.exr"), "-o", file("a.png"), "--exposure", "1", "--view", "filmic"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("farm: a local one"), std::string::npos) << result.err;
  for (const char* name : {"a.exr", "a.png"}) {
    const Result<RgbImage> image = load_rgb(file(name));
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_EQ(image->width, 80);
    EXPECT_EQ(image->height, 64);
  }
  EXPECT_TRUE(left_over().empty());
  EXPECT_TRUE(temporary_is_empty());
}

TEST_F(CliTest, ALocalFarmIgnoresTheConnectionSettingsOfAnother) {
  Environment of_another = environment();
  for (const char* name : {"LIGHTMILL_TLS_CA", "LIGHTMILL_TLS_CERT"}) {
    of_another[name] = file("none");
  }
  const CommandResult result = run_command({program("lightmill"), "render", scene("cornell-bench-balls.json"),
                                            "--local", "--size", "16x16", "--spp", "1", "-o", file("a.png")},
                                           of_another);
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(CliTest, TheSameSeedGivesTheSameFilmOnAnotherFarm) {
  const std::vector<std::string> render{
      "render",     scene("cornell-bench-balls.json"), "--local", "--size", "70x70", "--spp", "5", "--seed", "11", "-o",
      file("a.exr")};
  std::vector<std::string> one_thread = render;
  one_thread.insert(one_thread.end(), {"--threads", "1"});
  EXPECT_EQ(json(render)["film_hash"], json(one_thread)["film_hash"]);
}

TEST_F(SharedFarmTest, TheFirstOfThreeLimitsEndsTheJobAndIsNamed) {
  const auto render = [&](std::vector<std::string> limits) {
    std::vector<std::string> arguments{"render",     scene("cornell-bench-blocks.json"), "--size", "64x64", "-o",
                                       file("a.exr")};
    arguments.insert(arguments.end(), limits.begin(), limits.end());
    return arguments;
  };
  const auto ended = [&] { return load_film_picture(file("a.exr"))->receipt.ended; };

  const nlohmann::json by_error = on_farm(render({"--error", "0.05", "--spp", "1000", "--seconds", "10m"}));
  EXPECT_EQ(by_error["reached"], "error");
  EXPECT_EQ(by_error["goal"]["error"], 0.05);
  EXPECT_LE(by_error["error"]["rel_mse"].get<double>() + by_error["error"]["half_width"].get<double>(), 0.05);
  EXPECT_EQ(ended(), by_error["reason"]);
  EXPECT_NE(ended().find("reached relMSE 0.0"), std::string::npos) << ended();

  const nlohmann::json by_samples = on_farm(render({"--error", "1e-9", "--spp", "20", "--seconds", "10m"}));
  EXPECT_EQ(by_samples["reached"], "samples");
  EXPECT_EQ(by_samples["min_tile_samples"], 20);
  EXPECT_EQ(ended(), "reached 20 samples per pixel");
  const CommandResult fetched =
      lightmill({"fetch", by_samples["id"].dump(), "-o", file("fetched.png"), "--server", server()});
  EXPECT_NE(fetched.out.find(" done: reached 20 samples per pixel, error ±"), std::string::npos) << fetched.out;

  const CommandResult by_seconds =
      lightmill(with(render({"--error", "1e-9", "--spp", "1000000000", "--seconds", "1"}), {"--server", server()}));
  EXPECT_EQ(by_seconds.exit_code, 0) << by_seconds.err;
  EXPECT_NE(by_seconds.out.find("reached 1 second;"), std::string::npos) << by_seconds.out;
  EXPECT_NE(by_seconds.err.find("relMSE "), std::string::npos) << by_seconds.err;
  EXPECT_EQ(ended(), "reached 1 second");
}

/// "SIGINT"
std::string name_of_signal(const ::testing::TestParamInfo<int>& info) {
  return fmt::format("SIG{}", ::sigabbrev_np(info.param));
}

class SignalledRender : public CliTest, public ::testing::WithParamInterface<int> {};

TEST_P(SignalledRender, EndsItsLocalFarm) {
  BackgroundProcess render(endless(file("a.png")), file("render.log"), environment());
  ASSERT_TRUE(eventually([&] { return left_over().size() == 3; })) << "client, coordinator and worker";
  render.send(GetParam());
  EXPECT_EQ(render.wait(), GetParam() == SIGKILL ? 128 + SIGKILL : 130);
  EXPECT_TRUE(eventually([&] { return left_over().empty(); }));
  if (GetParam() != SIGKILL) {
    EXPECT_TRUE(temporary_is_empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Signals, SignalledRender, ::testing::Values(SIGINT, SIGTERM, SIGKILL), name_of_signal);

class InterruptedRender : public CliTest, public ::testing::WithParamInterface<int> {};

TEST_P(InterruptedRender, WritesThePictureSoFar) {
  std::vector<std::string> render = endless(file("a.exr"));
  render.insert(render.end(), {"--size", "48x48"});
  BackgroundProcess client(render, file("render.log"), environment());
  const auto log = [&] { return read_file(file("render.log"), 1 << 20).value_or(""); };
  // There is one tile. When it has a rate, every pixel has a sample.
  ASSERT_TRUE(eventually([&] { return log().find("samples/s") != std::string::npos; })) << log();
  client.send(GetParam());
  EXPECT_EQ(client.wait(), 130);
  const std::size_t notice = log().find("interrupted: the picture so far (");
  EXPECT_TRUE(notice != std::string::npos && notice == log().rfind("interrupted")) << log();
  EXPECT_TRUE(load_rgb(file("a.exr")).ok());
}

INSTANTIATE_TEST_SUITE_P(Signals, InterruptedRender, ::testing::Values(SIGINT, SIGTERM, SIGHUP), name_of_signal);

TEST_F(CliTest, AnInterruptedPictureWithGapsIsNotWritten) {
  BackgroundProcess client(endless(file("a.exr")), file("render.log"), environment());
  ASSERT_TRUE(eventually([&] { return left_over().size() == 3; }));  // the worker still has to measure its class
  client.send(SIGINT);
  EXPECT_EQ(client.wait(), 130);
  EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
}

TEST_F(CliTest, ProgressGoesToStandardErrorAndNoticesIntoTheJson) {
  write("dark.json", R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1},
"film": {"width": 8, "height": 8}, "materials": [{"name": "m", "mirror": {}}],
"objects": [{"material": "m", "sphere": {"center": [0, 0, 0], "radius": 1}}]})");
  const CommandResult result = lightmill(
      {"render", file("dark.json"), "--local", "--method", "path", "--spp", "1", "-o", file("a.exr"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string black = "nothing emits light: the picture will be black";
  EXPECT_NE(result.err.find("note: " + black), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("farm: a local one"), std::string::npos) << result.err;
  const auto notices = nlohmann::json::parse(result.out)["notices"].get<std::vector<std::string>>();
  EXPECT_EQ(std::ranges::count(notices, black), 1) << result.out;
}

TEST_F(CliTest, TheNextCommandRemovesWhatAKilledOneLeft) {
  {
    BackgroundProcess render(endless(file("a.png")), file("render.log"), environment());
    ASSERT_TRUE(eventually([&] { return left_over().size() == 3; }));
    render.send(SIGKILL);
    render.wait();
  }
  ASSERT_TRUE(eventually([&] { return left_over().empty(); }));
  EXPECT_FALSE(temporary_is_empty());
  json({"render", scene("cornell-bench-blocks.json"), "--local", "--size", "16x16", "--spp", "1", "-o", file("a.png")});
  EXPECT_TRUE(temporary_is_empty());
}

TEST_F(CliTest, ADeadWorkerEndsTheLocalRender) {
  BackgroundProcess render(endless(file("a.png")), file("render.log"), environment());
  const auto workers = [&] {
    std::vector<pid_t> found = left_over();
    std::erase_if(found, [](pid_t pid) {
      std::error_code error;
      const auto exe = std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/exe", error);
      return exe.filename() != "lightmill-worker";
    });
    return found;
  };
  ASSERT_TRUE(eventually([&] { return workers().size() == 1; }));
  ::kill(workers().front(), SIGKILL);
  EXPECT_EQ(render.wait(), 1);
  EXPECT_TRUE(eventually([&] { return left_over().empty(); }));
}

}  // namespace
}  // namespace lightmill::test
