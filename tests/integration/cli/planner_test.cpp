// The planner's results, from `check` to the EXR.
#include <csignal>

#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/support/fault_proxy.h"

namespace lightmill::test {
namespace {

const std::string kGlassUnderABulb = scene("course-default.json");

const nlohmann::json& verdict_on(const nlohmann::json& checked, const std::string& method) {
  const nlohmann::json& all = checked["methods"];
  const auto found = std::ranges::find_if(all, [&](const nlohmann::json& each) { return each["name"] == method; });
  EXPECT_NE(found, all.end()) << all;
  return *found;
}

using CheckTest = CliTest;

TEST_F(CheckTest, AutoFindsAMethodForEveryIncludedScene) {
  int checked = 0;
  for (const auto& entry : std::filesystem::directory_iterator(scene(""))) {
    if (entry.path().extension() != ".json") {
      continue;
    }
    SCOPED_TRACE(entry.path());
    const CommandResult result = lightmill({"check", entry.path().string(), "--json"});
    const nlohmann::json said = nlohmann::json::parse(result.out, nullptr, false);
    if (result.exit_code != 0) {  // its model must be downloaded first
      EXPECT_NE(said["failure"]["message"].get<std::string>().find("models/"), std::string::npos) << said;
      continue;
    }
    ++checked;
    EXPECT_FALSE(said["auto"]["methods"].empty());
    EXPECT_FALSE(said["auto"]["reasons"].empty());
    EXPECT_FALSE(said["features"].empty());
    // course-default has a light without extent, and glass below it. One box has a light, a mesh, that covers a
    // hundred-thousandth of the view from its balls.
    const std::string name = entry.path().filename().string();
    const bool caustics_unseen = name.starts_with("course-default") || name == "cornell-bench-small-lamp.json";
    EXPECT_EQ(verdict_on(said, "path")["admitted"], !caustics_unseen);
  }
  EXPECT_GE(checked, 8);
}

std::size_t count_of(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) {
    ++count;
  }
  return count;
}

TEST_F(CheckTest, ReasonsNameTheObstacleOnce) {
  const std::string text = lightmill({"check", kGlassUnderABulb}).out;
  EXPECT_EQ(count_of(" is missing", text), 1u) << text;
  EXPECT_NE(text.find("caustic, because path misses light\n"), std::string::npos) << text;
  for (const char* part : {"method path", "the point light 'bulb'", "glass", "auto chooses", "features"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST_F(SharedFarmTest, TheFarmInspectsSmallMeshes) {
  const std::string id =
      submit({scene("cornell-bench-small-lamp.json"), "--size", "16x16", "--spp", "1", "--method", "path"});
  const nlohmann::json watched = on_farm({"watch", id, "-o", file("a.exr")});
  ASSERT_EQ(watched["notices"].size(), 1u) << watched;
  EXPECT_TRUE(
      watched["notices"][0].get<std::string>().starts_with("path: camera paths rarely hit so small a light as the "
                                                           "emitter 'box/lamp'"))
      << watched["notices"];
}

TEST_F(SharedFarmTest, APictureThatLacksLightSaysSoWhereverItIsShown) {
  const std::string id = submit({kGlassUnderABulb, "--size", "48x48", "--spp", "2", "--method", "path"});
  const nlohmann::json watched = on_farm({"watch", id, "-o", file("a.exr")});
  ASSERT_EQ(watched["notices"].size(), 1u) << watched;
  const auto notice = watched["notices"][0].get<std::string>();
  EXPECT_TRUE(notice.starts_with("path: camera paths never hit the point light 'bulb'")) << notice;
  EXPECT_EQ(on_farm({"show", id})["notices"][0], notice);
  EXPECT_EQ(on_farm({"jobs"})["jobs"][0]["notices"][0], notice);
  EXPECT_EQ(watched["method_chosen"], false);
  const Result<FilmPicture> picture = load_film_picture(file("a.exr"));
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->receipt.notices, std::vector<std::string>{notice});

  const auto said = [&](std::vector<std::string> command) {
    command.insert(command.end(), {"--server", server()});
    const CommandResult result = lightmill(command);
    return result.out + result.err;
  };
  const std::vector<std::string> small{kGlassUnderABulb, "--size", "8x8", "--spp", "1", "--method", "path"};
  for (const std::vector<std::string>& command : {std::vector<std::string>{"show", id},
                                                  {"watch", id},
                                                  {"watch", id, "-o", file("b.png")},
                                                  {"fetch", id, "-o", file("b.png")},
                                                  with({"submit"}, small),
                                                  with(with({"render"}, small), {"-o", file("c.png")})}) {
    const std::string text = said(command);
    EXPECT_EQ(count_of(notice, text), 1u) << command[0] << "\n" << text;
  }
  EXPECT_NE(said({"jobs"}).find("path !"), std::string::npos);
}

TEST_F(SharedFarmTest, AutoReportsItsMethodAndKeepsItsBits) {
  const auto render = [&](const std::vector<std::string>& method, const std::string& out) {
    std::vector<std::string> command{
        "render", scene("cornell-bench-blocks.json"), "--size", "48x48", "--spp", "4", "-o", file(out)};
    command.insert(command.end(), method.begin(), method.end());
    return on_farm(command);
  };
  const nlohmann::json chosen = render({}, "auto.exr");
  EXPECT_EQ(chosen["method"], "path");
  EXPECT_EQ(chosen["method_chosen"], true);
  EXPECT_EQ(chosen["method_reasons"].size(), 1u) << "there is no pilot for one method";
  EXPECT_TRUE(chosen["notices"].empty());
  const nlohmann::json asked = render({"--method", "auto"}, "asked.exr");
  EXPECT_EQ(asked["render_digest"], chosen["render_digest"]);
  const nlohmann::json named = render({"--method", "path"}, "path.exr");
  EXPECT_EQ(chosen["film_hash"], named["film_hash"]);
  EXPECT_EQ(chosen["render_digest"], named["render_digest"])
      << "samples depend on the method, not on how it was chosen";
  const Result<FilmPicture> picture = load_film_picture(file("auto.exr"));
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->receipt.method, "path");
  EXPECT_EQ(picture->receipt.method_reasons.size(), 1u);
  EXPECT_TRUE(load_film_picture(file("path.exr"))->receipt.method_reasons.empty());
}

TEST_F(FarmCliTest, ChoiceAndNoticesOutliveTheCoordinator) {
  const std::string id = submit({kGlassUnderABulb, "--size", "16x16", "--spp", "1", "--method", "auto"});
  const nlohmann::json before = on_farm({"show", id});
  EXPECT_EQ(before["method_chosen"], true);
  const std::string listen = server();
  server_->send(SIGKILL);
  ASSERT_TRUE(server_->wait().has_value());
  start_server(listen);
  const nlohmann::json after = on_farm({"show", id});
  for (const char* field : {"method", "method_chosen", "method_reasons", "notices"}) {
    EXPECT_EQ(after[field], before[field]) << field;
  }
}

TEST_F(FarmCliTest, AdaptiveJobsGiveNoisyTilesMoreSamplesReproducibly) {
  start_worker("w1");
  const auto render = [&](const std::vector<std::string>& more, const char* out) {
    std::vector<std::string> arguments{"render",   scene("course-default.json"),
                                       "--size",   "192x192",
                                       "--spp",    "16",
                                       "--method", "path",
                                       "--seed",   "4",
                                       "-o",       file(out)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return on_farm(arguments);
  };
  const nlohmann::json adaptive = render({"--adaptive"}, "adaptive.exr");
  EXPECT_EQ(adaptive["goal"]["adaptive"], true);
  EXPECT_LT(adaptive["min_tile_samples"], 16u);
  EXPECT_GT(adaptive["max_tile_samples"], 16u);
  EXPECT_LE(adaptive["samples_done"], 16u * 192 * 192);
  EXPECT_GE(adaptive["samples_done"], 15u * 192 * 192) << "the same average";
  EXPECT_EQ(adaptive["frame_samples"], 16u);
  EXPECT_EQ(adaptive["samples_done"], adaptive["samples_wanted"]);
  ASSERT_FALSE(adaptive["method_reasons"].empty()) << adaptive;
  EXPECT_NE(adaptive["method_reasons"].back().get<std::string>().find("times the mean number of samples"),
            std::string::npos);
  start_worker("w2");
  EXPECT_EQ(render({"--adaptive"}, "again.exr")["film_hash"], adaptive["film_hash"]);
  const nlohmann::json even = render({}, "even.exr");
  EXPECT_EQ(even["goal"]["adaptive"], false);
  EXPECT_EQ(even["min_tile_samples"], even["max_tile_samples"]);
  EXPECT_EQ(even["render_digest"], adaptive["render_digest"]) << "the samples are the same, only their number differs";
}

TEST_F(FarmCliTest, APilotPicksTheSameMethodWhateverIsKilledMeanwhile) {
  const std::vector<std::string> job{
      scene("cornell-bench-balls.json"), "--size", "96x96", "--spp", "32", "--method", "auto", "--seed", "4"};
  const auto submit_job = [&] { return submit(job); };
  const nlohmann::json checked = json({"check", job[0]});
  ASSERT_EQ(checked["auto"]["methods"].size(), 2u) << "otherwise no pilot runs";

  start_worker("quiet");
  const std::string quiet_id = submit_job();
  const nlohmann::json quiet = on_farm({"watch", quiet_id, "-o", file("quiet.exr")});
  EXPECT_EQ(quiet["state"], "done");
  EXPECT_NE(quiet["method"], "auto");
  EXPECT_EQ(quiet["method_chosen"], true);
  ASSERT_EQ(quiet["method_reasons"].size(), 2u) << quiet;
  const std::string chosen = lightmill({"show", quiet_id, "--server", server()}).out;
  EXPECT_NE(chosen.find("\nchosen "), std::string::npos) << chosen;
  EXPECT_EQ(chosen.find("\nchosen "), chosen.rfind("\nchosen ")) << chosen;
  workers_.clear();  // the worker ends

  const std::string id = submit_job();
  const nlohmann::json open = on_farm({"show", id});
  EXPECT_EQ(open["method"], "auto") << "no worker can run the pilot";
  EXPECT_EQ(open["method_candidates"], (std::vector<std::string>{"path", "caustic"}));
  EXPECT_TRUE(quiet["method_candidates"].empty());
  const std::string shown = lightmill({"show", id, "--server", server()}).out;
  EXPECT_NE(shown.find("path or caustic (a pilot compares them)"), std::string::npos) << shown;
  const std::string given_up = submit_job();
  on_farm({"cancel", given_up});
  const std::string left = lightmill({"show", given_up, "--server", server()}).out;
  EXPECT_NE(left.find("path or caustic (it ended before a pilot chose)"), std::string::npos) << left;
  for (int i = 0; i < 3; ++i) {
    const std::string name = fmt::format("short-lived-{}", i);
    on_farm({"pause", id});
    FaultProxy line(server());
    start_worker(name, {}, line.address());
    ASSERT_TRUE(server_said(name + " connected"));
    line.stall(Way::back, true);  // the worker never gets its grant
    on_farm({"resume", id});
    ASSERT_TRUE(server_said(fmt::format("worker {} compares path and caustic for job {}", name, id)));
    workers_.back()->send(SIGKILL);
    ASSERT_TRUE(workers_.back()->wait().has_value());
    EXPECT_EQ(on_farm({"show", id})["method"], "auto");
    if (i == 1) {
      const std::string listen = server();
      server_->send(SIGKILL);
      ASSERT_TRUE(server_->wait().has_value());
      start_server(listen);
    }
  }
  start_worker("last");
  const nlohmann::json troubled = on_farm({"watch", id, "-o", file("troubled.exr")});
  for (const char* field : {"state", "method", "method_reasons", "render_digest", "film_hash"}) {
    EXPECT_EQ(troubled[field], quiet[field]) << field;
  }
  EXPECT_GE(troubled["counters"]["leases_lost"].get<int>(), 1) << troubled;
  EXPECT_EQ(load_film_picture(file("troubled.exr"))->receipt.method_reasons.size(), 2u);
}

}  // namespace
}  // namespace lightmill::test
