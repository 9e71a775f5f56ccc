// `render --local`: a farm of its own, gone with the command, whatever ends it.
#include <csignal>

#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

/// A render that would take hours.
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
  EXPECT_NE(result.err.find("private"), std::string::npos) << result.err;
  for (const char* name : {"a.exr", "a.png"}) {
    const Result<RgbImage> image = load_rgb(file(name));
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_EQ(image->width, 80);
    EXPECT_EQ(image->height, 64);
  }
  EXPECT_TRUE(left_over().empty());
  EXPECT_TRUE(temporary_is_empty());
}

TEST_F(CliTest, TheSameSeedGivesTheSameFilmOnAnotherFarm) {
  const std::vector<std::string> render{
      "render",     scene("cornell-bench-balls.json"), "--local", "--size", "70x70", "--spp", "5", "--seed", "11", "-o",
      file("a.exr")};
  std::vector<std::string> one_thread = render;
  one_thread.insert(one_thread.end(), {"--threads", "1"});
  EXPECT_EQ(json(render)["film_hash"], json(one_thread)["film_hash"]);
}

class EndedBySignal : public CliTest, public ::testing::WithParamInterface<int> {};

TEST_P(EndedBySignal, ThePrivateFarmGoesWithItsCommand) {
  BackgroundProcess render(endless(file("a.png")), file("render.log"), environment());
  ASSERT_TRUE(eventually([&] { return left_over().size() == 3; })) << "client, coordinator and worker";
  render.send(GetParam());
  EXPECT_EQ(render.wait(std::chrono::seconds(20)), GetParam() == SIGKILL ? 128 + SIGKILL : 130);
  EXPECT_TRUE(eventually([&] { return left_over().empty(); }));
  if (GetParam() != SIGKILL) {
    EXPECT_TRUE(temporary_is_empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Signals, EndedBySignal, ::testing::Values(SIGINT, SIGTERM, SIGKILL),
                         [](const auto& info) { return "Signal" + std::to_string(info.param); });

TEST_F(CliTest, WhatAKilledCommandLeftIsRemovedByTheNext) {
  {
    BackgroundProcess render(endless(file("a.png")), file("render.log"), environment());
    ASSERT_TRUE(eventually([&] { return left_over().size() == 3; }));
    render.send(SIGKILL);
    render.wait(std::chrono::seconds(20));
  }
  ASSERT_TRUE(eventually([&] { return left_over().empty(); }));
  EXPECT_FALSE(temporary_is_empty());
  json({"render", scene("cornell-bench-blocks.json"), "--local", "--size", "16x16", "--spp", "1", "-o", file("a.png")});
  EXPECT_TRUE(temporary_is_empty());
}

TEST_F(CliTest, AWorkerThatDiesEndsThePrivateRender) {
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
  EXPECT_EQ(render.wait(std::chrono::seconds(20)), 1);
  EXPECT_TRUE(eventually([&] { return left_over().empty(); }));
}

}  // namespace
}  // namespace lightmill::test
