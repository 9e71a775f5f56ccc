// Commands on a shared farm.
#include <csignal>

#include "client/cli/film_fetch.h"
#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(FarmCliTest, AJobGoesFromSubmitToDelete) {
  const std::string id = submit(with({scene("cornell-bench-blocks.json"), "--name", "box", "--owner", "ada"}, kSmall));
  EXPECT_EQ(on_farm({"show", id})["state"], "queued");
  EXPECT_EQ(on_farm({"pause", id})["state"], "paused");
  EXPECT_EQ(on_farm({"resume", id})["state"], "queued");
  on_farm({"fetch", id, "-o", file("early.png")}, 3);  // nothing is rendered yet
  EXPECT_FALSE(std::filesystem::exists(file("early.png")));
  start_worker("w1");
  const nlohmann::json watched = on_farm({"watch", id, "-o", file("a.exr"), "-o", file("a.png")});
  EXPECT_EQ(watched["state"], "done");
  EXPECT_EQ(watched["samples_done"], 96 * 80 * 8);
  const nlohmann::json shown = on_farm({"show", id});
  EXPECT_EQ(shown["name"], "box");
  EXPECT_EQ(shown["owner"], "ada");
  EXPECT_EQ(shown["film_hash"], watched["film_hash"]);
  EXPECT_EQ(shown["min_tile_samples"], 8);
  EXPECT_GT(shown["seconds"].get<double>(), 0);
  EXPECT_GT(shown["error"]["rel_mse"].get<double>(), 0);
  EXPECT_EQ(on_farm({"jobs"})["jobs"].size(), 1u);
  on_farm({"cancel", id}, 2);  // it has ended
  on_farm({"delete", id});
  EXPECT_TRUE(on_farm({"jobs"})["jobs"].empty());
}

TEST_F(SharedFarmTest, TheFileStatesTheHashOfItsOwnFilm) {
  const nlohmann::json job =
      on_farm(with({"render", scene("cornell-bench-balls.json"), "--seed", "5", "-o", file("a.exr")}, kSmall));
  const Result<FilmPicture> picture = load_film_picture(file("a.exr"));
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->receipt.film_hash, job["film_hash"].get<std::string>());
  EXPECT_EQ(film_hash_of(*picture).hex(), picture->receipt.film_hash);
  EXPECT_EQ(picture->receipt.render_digest, job["render_digest"].get<std::string>());
  EXPECT_EQ(picture->receipt.seed, 5u);
  EXPECT_EQ(picture->receipt.method, job["method"].get<std::string>());
  EXPECT_EQ(picture->receipt.asset_digests.size(), 4u);
  EXPECT_EQ(picture->display, (ImageWindow{0, 0, 96, 80}));
  for (std::size_t i = 0; i < picture->pixels(); ++i) {
    ASSERT_EQ(picture->samples_a[i], 4u);
    ASSERT_EQ(picture->samples_b[i], 4u);
  }
}

TEST_F(SharedFarmTest, ACropHasTheBitsOfTheWhole) {
  const std::string box = scene("cornell-bench-balls.json");
  on_farm(with({"render", box, "-o", file("whole.exr")}, kSmall));
  on_farm(with({"render", box, "--crop", "50,30,33,40", "-o", file("crop.exr"), "-o", file("crop.png")}, kSmall));
  const Result<FilmPicture> whole = load_film_picture(file("whole.exr"));
  const Result<FilmPicture> crop = load_film_picture(file("crop.exr"));
  ASSERT_TRUE(whole.ok() && crop.ok());
  EXPECT_EQ(crop->display, whole->display);
  EXPECT_EQ(crop->data, (ImageWindow{50, 30, 33, 40}));
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 33; ++x) {
      const std::size_t small = static_cast<std::size_t>(y * 33 + x);
      const std::size_t large = static_cast<std::size_t>((y + 30) * 96 + x + 50);
      ASSERT_EQ(crop->half_a[small], whole->half_a[large]) << x << "," << y;
      ASSERT_EQ(crop->half_b[small], whole->half_b[large]) << x << "," << y;
    }
  }
  const Result<RgbImage> png = load_rgb(file("crop.png"));
  ASSERT_TRUE(png.ok());
  EXPECT_EQ(png->width, 33);
  const CommandResult compared = lightmill({"error", file("crop.exr"), file("whole.exr")});
  EXPECT_NE(compared.out.find("the pictures are equal"), std::string::npos) << compared.out;
  EXPECT_NE(compared.err.find("compared with this part of the reference, 33x40 at 50,30"), std::string::npos)
      << compared.err;
  const CommandResult refused = lightmill({"error", file("whole.exr"), file("crop.exr")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("must have the same size"), std::string::npos) << refused.err;
}

TEST_F(SharedFarmTest, ColumnsSetsTheWidthOfAPipe) {
  submit({scene("cornell-bench-blocks.json"), "--size", "8x8", "--spp", "1", "--name", std::string(60, 'n')});
  const auto jobs = [&](const char* columns) {
    Environment variables = environment();
    variables["COLUMNS"] = columns;
    return run_command({program("lightmill"), "jobs", "--limit", "1", "--server", server()}, variables).out;
  };
  EXPECT_NE(jobs("").find(std::string(60, 'n')), std::string::npos) << "nothing is shortened in a pipe";
  const std::string narrow = jobs("80");
  EXPECT_EQ(std::ranges::count(narrow, '\n'), 2) << narrow;
  EXPECT_NE(narrow.find("nn…nn"), std::string::npos) << narrow;
}

TEST_F(SharedFarmTest, ErrorIsZeroAgainstItselfAndFallsWithSamples) {
  const std::string box = scene("cornell-bench-blocks.json");
  for (const char* samples : {"2", "32", "256"}) {
    on_farm({"render", box, "--size", "48x48", "--seed", samples, "--spp", samples, "-o",
             file(std::string(samples) + ".exr")});
  }
  EXPECT_EQ(json({"error", file("2.exr"), file("2.exr")})["rel_mse"], 0.0);
  const double coarse = json({"error", file("2.exr"), file("256.exr")})["rel_mse"];
  const double fine = json({"error", file("32.exr"), file("256.exr")})["rel_mse"];
  EXPECT_LT(fine, coarse / 4);  // 1/n at least, at 16 times the samples
}

TEST_F(FarmCliTest, WorkersAreWantedWhileAJobRuns) {
  const auto wanted = [&] { return lightmill({"workers", "--wanted", "--server", server()}).out; };
  EXPECT_EQ(wanted(), "0\n");
  const std::string job =
      std::to_string(on_farm({"submit", scene("cornell-bench-blocks.json"), "--spp", "1"})["id"].get<int>());
  EXPECT_EQ(wanted(), "1\n");
  EXPECT_EQ(on_farm({"workers"})["wanted_workers"], 1);
  on_farm({"cancel", job});
  EXPECT_EQ(wanted(), "0\n");
}

TEST_F(FarmCliTest, WorkersAreListedAndDrained) {
  start_worker("w1");
  ASSERT_TRUE(eventually([&] { return on_farm({"workers"})["workers"].size() == 1; }));
  EXPECT_EQ(on_farm({"workers"})["workers"][0]["name"], "w1");
  EXPECT_EQ(on_farm({"workers", "quarantine", "w1", "--reason", "smells of smoke"})["quarantine"],
            "put there by hand: smells of smoke");
  const std::string notices = lightmill({"workers", "--server", server()}).err;
  EXPECT_NE(
      notices.find(
          "w1 is in quarantine (put there by hand: smells of smoke). Check its machine, then release it with `lightmill workers "
          "release w1 --server " +
          server() + "`"),
      std::string::npos)
      << notices;
  const std::string again =
      lightmill({"workers", "quarantine", "w1", "--reason", "and of fire", "--server", server()}).out;
  EXPECT_NE(again.find("are in quarantine (put there by hand: and of fire)"), std::string::npos)
      << "a later reason replaces the first: " << again;
  on_farm({"workers", "release", "w1"});
  EXPECT_TRUE(on_farm({"workers"})["workers"][0]["quarantine"].is_null());
  on_farm({"workers", "drain", "w1"});
  EXPECT_EQ(workers_[0]->wait(), 0);
}

TEST_F(FarmCliTest, ASecondWorkerOfOneNameIsRefusedAndTheFirstStays) {
  start_worker("w1");
  ASSERT_TRUE(eventually([&] { return on_farm({"workers"})["workers"].size() == 1; }));
  BackgroundProcess second({program("lightmill-worker"), "--server", server(), "--name", "w1", "--threads", "1"},
                           file("second.log"));
  EXPECT_EQ(second.wait(), 1);
  std::ifstream log(file("second.log"));
  EXPECT_NE(std::string(std::istreambuf_iterator<char>(log), {}).find("another worker named w1 is connected"),
            std::string::npos);
  const nlohmann::json workers = on_farm({"workers"})["workers"];
  ASSERT_EQ(workers.size(), 1u);
  EXPECT_EQ(workers[0]["threads"], 2);
}

TEST_F(FarmCliTest, CancellingAJobOfEndlessPathsFreesItsWorker) {
  start_worker("w1");
  // No light leaves the room, so each of its samples takes a minute.
  const std::string room = write("room.json", R"({
    "film": {"width": 128, "height": 64},
    "camera": {"eye": [0, 0, 0], "look_at": [0, 0, -1], "vertical_fov_degrees": 60},
    "materials": [{"name": "white", "diffuse": {"reflectance": {"rgb": [1, 1, 1]}}},
                  {"name": "lamp", "diffuse": {"reflectance": {"rgb": [1, 1, 1]}}, "emission": {"rgb": [1, 1, 1]}}],
    "objects": [{"material": "white", "sphere": {"center": [0, 0, 0], "radius": 10}},
                {"material": "lamp", "sphere": {"center": [0, 5, 0], "radius": 1}}]})");
  const std::string id = submit({room, "--method", "path", "--spp", "64", "--max-bounces", "1000000"});
  ASSERT_TRUE(server_said("worker w1 connected"));
  ASSERT_TRUE(eventually([&] { return on_farm({"workers"})["workers"].at(0)["leases"] > 0; }));
  on_farm({"cancel", id});
  BackgroundProcess render({program("lightmill"), "render", scene("cornell-bench-blocks.json"), "--size", "32x32",
                            "--spp", "2", "-o", file("a.png"), "--server", server()},
                           file("render.log"), environment());
  EXPECT_EQ(render.wait(), 0);
  workers_[0]->send(SIGTERM);
  EXPECT_EQ(workers_[0]->wait(), 0);
}

TEST_F(FarmCliTest, CommandsNeitherFollowNorCancelAJobOfAnotherFarmWithTheSameNumber) {
  const std::string address = server();
  const auto replace_data = [&](const char* put_away, const char* taken) {
    server_->send(SIGKILL);
    server_->wait();
    std::filesystem::rename(file("data"), file(put_away));
    if (std::filesystem::exists(file(taken))) {
      std::filesystem::rename(file(taken), file("data"));
    }
  };
  const auto start = [&](std::vector<std::string> arguments, const std::string& log) {
    arguments.insert(arguments.begin(), program("lightmill"));
    arguments.insert(arguments.end(), {"--server", address});
    return std::make_unique<BackgroundProcess>(arguments, file(log), environment());
  };
  const auto said = [&](const std::string& log, const std::string& text) {
    return eventually([&] {
      std::ifstream in(file(log));
      return std::string(std::istreambuf_iterator<char>(in), {}).find(text) != std::string::npos;
    });
  };
  ASSERT_EQ(submit(with({scene("cornell-bench-blocks.json"), "--name", "other"}, kSmall)), "1");
  replace_data("other farm", "none");
  ASSERT_NO_FATAL_FAILURE(start_server(address));
  const auto render =
      start(with({"render", scene("cornell-bench-blocks.json"), "-o", file("a.png")}, kSmall), "render");
  ASSERT_TRUE(said("render", "job 1: waits for a worker"));
  const auto watch = start({"watch", "1", "-o", file("w.png")}, "watch");
  ASSERT_TRUE(said("watch", "job 1: waits for a worker"));
  replace_data("this farm", "other farm");
  const std::string lost = "lost the connection to " + address;
  ASSERT_TRUE(said("render", lost) && said("watch", lost));
  render->send(SIGSTOP);
  ASSERT_NO_FATAL_FAILURE(start_server(address));
  EXPECT_TRUE(said("watch", "job 1 is not the same job as before: another farm answers at " + address));
  EXPECT_EQ(watch->wait(), 1);
  render->send(SIGINT);  // it would cancel its job
  render->send(SIGCONT);
  EXPECT_NE(render->wait(), 0);
  const nlohmann::json other = on_farm({"show", "1"});
  EXPECT_EQ(other["name"], "other");
  EXPECT_EQ(other["state"], "queued");
}

TEST_F(FarmCliTest, WatchingSurvivesARestartOfTheCoordinator) {
  const std::string id = submit({scene("cornell-bench-blocks.json"), "--size", "96x80", "--spp", "8"});
  BackgroundProcess watch({program("lightmill"), "watch", id, "--server", server(), "-o", file("live.png")},
                          file("watch.log"), environment());
  const auto log_has = [&](const char* text) {
    std::ifstream log(file("watch.log"));
    return std::string(std::istreambuf_iterator<char>(log), {}).find(text) != std::string::npos;
  };
  ASSERT_TRUE(eventually([&] { return log_has("queued"); }));
  const std::string address = server();
  server_->send(SIGKILL);
  server_->wait();
  ASSERT_TRUE(eventually([&] { return log_has("lost the connection"); }));
  start_server(address);
  ASSERT_TRUE(eventually([&] { return log_has("connected again"); }));
  start_worker("w1");
  EXPECT_EQ(watch.wait(), 0);
  EXPECT_TRUE(load_rgb(file("live.png")).ok());
}

TEST_F(FarmCliTest, RenderReportsMissingWorkersAndContinuesWhenOneConnects) {
  BackgroundProcess render({program("lightmill"), "render", scene("cornell-bench-blocks.json"), "--size", "32x32",
                            "--spp", "2", "--layers", "albedo", "-o", file("a.png"), "--server", server()},
                           file("render.log"), environment());
  const auto said = [&](const std::string& text) {
    return eventually([&] {
      std::ifstream log(file("render.log"));
      return std::string(std::istreambuf_iterator<char>(log), {}).find(text) != std::string::npos;
    });
  };
  EXPECT_TRUE(said(fmt::format("no worker is connected to {}, so the job waits: start one", server())));
  EXPECT_TRUE(said("job 1: waits for a worker: none is connected")) << "the same as in `show`";
  EXPECT_TRUE(said("--layers are written only to EXR files, and none is written: " + file("a.png")));
  BackgroundProcess worker({program("lightmill-worker"), "--threads", "1"}, file("worker.log"),
                           {{"LIGHTMILL_SERVER", server()}});
  EXPECT_EQ(render.wait(), 0);
}

TEST_F(FarmCliTest, InterruptingWatchLeavesTheJobAndInterruptingRenderCancelsIt) {
  const std::string box = scene("cornell-bench-blocks.json");  // no worker: the jobs wait
  const std::string id = submit({box});
  for (const bool rendering : {false, true}) {
    std::vector<std::string> command{program("lightmill"), "watch", id, "--server", server()};
    if (rendering) {
      command = {program("lightmill"), "render", box, "-o", file("a.png"), "--server", server()};
    }
    BackgroundProcess client(command, file("client.log"), environment());
    ASSERT_TRUE(eventually([&] {
      std::ifstream log(file("client.log"));
      return std::string(std::istreambuf_iterator<char>(log), {}).find("queued") != std::string::npos;
    }));
    client.send(SIGINT);
    EXPECT_EQ(client.wait(), 130);
    std::filesystem::remove(file("client.log"));
  }
  const nlohmann::json jobs = on_farm({"jobs"})["jobs"];
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0]["state"], "cancelled");
  EXPECT_EQ(jobs[1]["state"], "queued");
}

TEST_F(FarmCliTest, AnswersSayWhatChangedOrWhatToDo) {
  const std::string box = scene("cornell-bench-blocks.json");  // no worker: the jobs wait
  const std::string first = submit({box}), second = submit({box});
  const auto asked = [&](std::vector<std::string> command) {
    return lightmill(with(std::move(command), {"--server", server()}));
  };
  EXPECT_EQ(asked({"priority", first, "--to", "10"}).out, fmt::format("job {} has priority 10\n", first));
  EXPECT_NE(asked({"delete", first}).err.find("it is queued. Give --cancel to cancel it first\n"), std::string::npos);
  const std::string digest = asked({"show", first, "--verbose"}).out;
  EXPECT_NE(digest.find("render digest  none yet\n"), std::string::npos) << digest;
  EXPECT_NE(asked({"jobs"}).err.find(fmt::format("jobs {}, {}: wait for a worker", second, first)), std::string::npos);
}

TEST_F(FarmCliTest, SeveralJobsAreChangedAtOnceDespiteOneFailure) {
  const std::string box = scene("cornell-bench-blocks.json");  // no worker: the jobs wait
  const std::string first = submit({box}), second = submit({box}), third = submit({box});
  nlohmann::json all = on_farm({"priority", first, second, third, "--to", "-4"});
  ASSERT_EQ(all["jobs"].size(), 3u);
  EXPECT_TRUE(all["failed"].empty());
  for (const nlohmann::json& job : all["jobs"]) {
    EXPECT_EQ(job["priority"], -4);
  }
  on_farm({"cancel", second});
  all = on_farm({"pause", first, second, "77", third}, 2);
  ASSERT_EQ(all["jobs"].size(), 2u);
  EXPECT_EQ(all["jobs"][0]["state"], "paused");
  EXPECT_EQ(std::to_string(all["jobs"][1].value("id", 0)), third);
  ASSERT_EQ(all["failed"].size(), 2u);
  EXPECT_EQ(std::to_string(all["failed"][0].value("id", 0)), second);
  EXPECT_NE(all["failed"][1]["message"].get<std::string>().find("77"), std::string::npos);
  EXPECT_EQ(all["failure"]["message"], "failed for 2 of 4 jobs");
  const std::string errors = lightmill({"pause", second, "77", "--server", server()}).err;
  EXPECT_EQ(errors.find(fmt::format("job {0}: job {0}", second)), std::string::npos) << errors;
  EXPECT_NE(errors.find("\nthere is no job 77\n"), std::string::npos) << errors;
  EXPECT_EQ(on_farm({"delete", first, third, "--cancel"})["jobs"].size(), 2u);
  EXPECT_EQ(on_farm({"jobs"})["jobs"].size(), 1u);
}

TEST_F(FarmCliTest, JobsAreListedByStateOwnerAndName) {
  const std::string box = scene("cornell-bench-blocks.json");  // no worker: the jobs wait
  const auto numbers = [&](const std::vector<std::string>& options) {
    std::vector<std::string> ids;
    const nlohmann::json listed = on_farm(with({"jobs"}, options));
    for (const nlohmann::json& job : listed["jobs"]) {
      ids.push_back(std::to_string(job.value("id", 0)));
    }
    return ids;
  };
  const std::string first = submit({box, "--owner", "ada", "--name", "kitchen, day"});
  const std::string second = submit({box, "--owner", "ada", "--name", "kitchen, night"});
  const std::string third = submit({box, "--owner", "bob", "--name", "garden"});
  on_farm({"cancel", second});
  on_farm({"pause", third});
  EXPECT_EQ(numbers({"--owner", "ada"}), (std::vector{second, first}));
  EXPECT_EQ(numbers({"--name", "kitchen"}), (std::vector{second, first}));
  EXPECT_EQ(numbers({"--state", "queued,paused"}), (std::vector{third, first}));
  EXPECT_EQ(numbers({"--state", "queued", "--state", "cancelled", "--owner", "ada", "--name", "day"}),
            (std::vector{first}));
  EXPECT_TRUE(numbers({"--owner", "ad"}).empty());
  const nlohmann::json newest = on_farm({"jobs", "--limit", "2"});
  EXPECT_EQ(newest["jobs"].size(), 2u);
  EXPECT_EQ(newest["total"], 3);
  EXPECT_EQ(numbers({"--all"}).size(), 3u);
  EXPECT_NE(lightmill({"jobs", "--limit", "2", "--server", server()}).err.find("2 of 3 jobs"), std::string::npos);
  on_farm({"jobs", "--state", "asleep"}, 2);
  on_farm({"jobs", "--all", "--limit", "3"}, 2);
}

TEST_F(FarmCliTest, TheListHasAllRunningJobs) {
  start_worker("w1");
  const std::string box = scene("cornell-bench-blocks.json");
  const std::string running = submit({box, "--spp", "1000000"});
  ASSERT_TRUE(eventually([&] { return on_farm({"jobs"})["jobs"][0].value("state", "") == "running"; }));
  const std::string hidden = submit({box}), newest = submit({box});
  for (const std::string& id : {hidden, newest}) {
    on_farm({"pause", id});
  }
  const nlohmann::json listed = on_farm({"jobs", "--limit", "1"});
  ASSERT_EQ(listed["jobs"].size(), 2u) << listed;
  EXPECT_EQ(std::to_string(listed["jobs"][0].value("id", 0)), newest);
  EXPECT_EQ(std::to_string(listed["jobs"][1].value("id", 0)), running);
  EXPECT_EQ(listed["notices"].back(), "older jobs that are queued or paused: 1 (--state queued,paused)");
  EXPECT_EQ(on_farm({"jobs", "--limit", "1", "--state", "paused"})["jobs"].size(), 1u);
}

TEST_F(FarmCliTest, ACancelledJobIsExitCode1ForItsWatcher) {
  const std::string id = submit({scene("cornell-bench-blocks.json")});
  on_farm({"cancel", id});
  const nlohmann::json watched = on_farm({"watch", id}, 1);
  EXPECT_EQ(watched["failure"]["exit_code"], 1);
  EXPECT_EQ(watched["state"], "cancelled");
  EXPECT_EQ(std::to_string(watched.value("id", 0)), id);
}

}  // namespace
}  // namespace lightmill::test
