// `lab` on real farms: complete, interrupted and resumed.
#include <csignal>

#include "common/base/file.h"
#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/support/xml.h"

namespace lightmill::test {
namespace {

/// Helpers of the lab tests, on their own or on the shared farm.
template <class Base>
class LabOn : public Base {
 protected:
  std::string experiment(const std::string& samples) const {
    return this->write("experiment.json",
                       fmt::format(R"({{"scenes": [{{"name": "box", "file": "{}"}}], "methods": ["path", "whitted"],
                             "seeds": 2, "width": 20, "height": 16, "samples": {},
                             "reference": {{"method": "path", "samples": 256, "seed": 77}}}})",
                                   scene("cornell-bench-balls.json"), samples));
  }
  std::vector<nlohmann::json> results(const std::string& folder) const {
    std::vector<nlohmann::json> lines;
    std::ifstream in(this->file(folder) + "/results.jsonl");
    for (std::string line; std::getline(in, line);) {
      lines.push_back(nlohmann::json::parse(line));
      for (const char* timed : {"thread_seconds", "seconds"}) {
        EXPECT_GT(lines.back()[timed].get<double>(), 0);
        lines.back().erase(timed);
      }
    }
    return lines;
  }
};
using LabTest = LabOn<FarmCliTest>;
using SharedLabTest = LabOn<SharedFarmTest>;

TEST_F(LabTest, ComparesEveryPictureWithTheReference) {
  start_worker("w1");
  const nlohmann::json done = on_farm({"lab", experiment("[1, 16]"), "-o", file("out")});
  EXPECT_EQ(done["results"], 8);
  const std::vector<nlohmann::json> lines = results("out");
  ASSERT_EQ(lines.size(), 8u);  // 2 methods × 2 seeds × 2 levels, in this order
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i]["method"], i < 4 ? "path" : "whitted");
    EXPECT_EQ(lines[i]["seed"], 1 + (i / 2) % 2);
    EXPECT_EQ(lines[i]["samples"], i % 2 == 0 ? 1 : 16);
    for (const char* metric : {"rel_mse", "rel_mse_trimmed", "smape", "flip", "energy_ratio"}) {
      EXPECT_GT(lines[i][metric].get<double>(), 0) << lines[i];
    }
  }
  EXPECT_LT(lines[1]["rel_mse"], lines[0]["rel_mse"]);
  EXPECT_LT(lines[1]["flip"], lines[0]["flip"]);
  EXPECT_LT(lines[5]["energy_ratio"], 0.95);  // light that comes by the walls is missing

  // `render` gives the same film of the same picture, and `error` the same numbers.
  const nlohmann::json picture = on_farm({"render", scene("cornell-bench-balls.json"), "--method", "path", "--size",
                                          "20x16", "--spp", "16", "--seed", "2", "-o", file("a.exr")});
  EXPECT_EQ(picture["film_hash"], lines[3]["film_hash"]);
  const auto references = std::filesystem::directory_iterator(file("out") + "/references");
  const std::string reference = begin(references)->path().string();
  const nlohmann::json error = json({"error", file("a.exr"), reference});
  for (const char* metric : {"rel_mse", "rel_mse_trimmed", "smape", "flip", "energy_ratio", "max_abs"}) {
    EXPECT_EQ(error[metric], lines[3][metric]) << metric;
  }

  EXPECT_NE(read_file(done["report"].get<std::string>()).value().find("8 of 8 results"), std::string::npos);
  const std::string csv = read_file(file("out") + "/results.csv").value();
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 9);
  EXPECT_EQ(nlohmann::json::parse(read_file(file("out") + "/results.json").value())["results"].size(), 8u);
  // The farm keeps no films that are not needed any more.
  const nlohmann::json jobs = on_farm({"jobs"})["jobs"];
  EXPECT_EQ(jobs.size(), 1u) << jobs;
}

TEST_F(LabTest, AJobsOwnErrorIsDrawnAcrossARestart) {
  start_worker("w1");
  const std::string box = scene("cornell-bench-blocks.json");
  const std::string id = submit({box, "--size", "70x40", "--spp", "100"});
  on_farm({"watch", id});
  const nlohmann::json shown = on_farm({"show", id, "--chart", file("job.svg")});
  const nlohmann::json& history = shown["history"];
  ASSERT_GE(history.size(), 2u) << shown;
  EXPECT_LE(history.size(), 7u);  // 16, 24, 32, 48, 64, 96 and the end
  EXPECT_EQ(history.back()["samples"], 100);
  EXPECT_EQ(history.back()["rel_mse"], shown["error"]["rel_mse"]);
  EXPECT_EQ(history.back()["worker_seconds"], shown["worker_seconds"]);
  EXPECT_LT(history.back()["rel_mse"], history.front()["rel_mse"]);
  const std::vector<XmlTag> tags = xml_tags(read_file(file("job.svg")).value());
  const auto circles = std::ranges::count(tags, "circle", &XmlTag::name);
  EXPECT_EQ(circles, history.size() + 1);  // one more for the legend

  const std::string address = server();
  server_.reset();
  start_server(address);
  EXPECT_EQ(on_farm({"show", id})["history"], history);
}

TEST_F(SharedLabTest, ReportsAreWrittenAgainWithoutAFarm) {
  on_farm({"lab", experiment("[1]"), "-o", file("out")});
  std::filesystem::remove(file("out") + "/report.html");
  EXPECT_EQ(json({"lab", file("experiment.json"), "-o", file("out"), "--server", "127.0.0.1:1"})["results"], 4);
  EXPECT_TRUE(std::filesystem::exists(file("out") + "/report.html"));
}

TEST_F(SharedLabTest, OtherPicturesAppearInTheSameCharts) {
  const std::string box = scene("cornell-bench-blocks.json");
  for (const std::string samples : {"1", "16", "200"}) {
    on_farm({"render", box, "--method", "path", "--size", "20x16", "--spp", samples, "-o", file(samples + ".exr")});
  }
  write("others.jsonl",
        R"({"scene": "box", "method": "Other", "seed": 5, "samples": 16, "seconds": 2, "picture": "16.exr"}
{"scene": "box", "method": "Other", "seed": 5, "samples": 1, "seconds": 0.25, "wall": 0.5, "picture": "1.exr"}
)");
  write("experiment.json", fmt::format(R"({{"scenes": [{{"name": "box", "file": "{}"}}], "width": 20, "height": 16,
                                           "others": "others.jsonl", "reference": "200.exr"}})",
                                       box));
  // Nothing is rendered, so no farm is needed.
  const nlohmann::json done = json({"lab", file("experiment.json"), "-o", file("out"), "--server", "127.0.0.1:1"});
  EXPECT_EQ(done["results"], 2);
  const auto numbers = nlohmann::json::parse(read_file(file("out") + "/results.json").value());
  const nlohmann::json& curve = numbers["scenes"][0]["methods"][0]["curve"];
  ASSERT_EQ(curve.size(), 2u);
  EXPECT_EQ(curve[0]["samples"], 1);
  EXPECT_EQ(curve[0]["thread_seconds"], 0.25);
  EXPECT_EQ(curve[1]["thread_seconds"], 2);
  EXPECT_EQ(curve[1]["rel_mse"], json({"error", file("16.exr"), file("200.exr")})["rel_mse"]);
  EXPECT_NE(read_file(done["report"].get<std::string>()).value().find("Other, 16 samples"), std::string::npos);
}

TEST_F(SharedLabTest, LevelsMayBeErrors) {
  write("experiment.json", fmt::format(R"({{"scenes": ["{}"], "methods": ["path"], "width": 20, "height": 16,
      "errors": [0.5, 1e-9], "max_samples": 32, "reference": {{"method": "path", "samples": 64, "seed": 77}}}})",
                                       scene("cornell-bench-blocks.json")));
  EXPECT_EQ(on_farm({"lab", file("experiment.json"), "-o", file("out")})["results"], 2);
  const std::vector<nlohmann::json> lines = results("out");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_LE(lines[0]["stated"].get<double>() + lines[0]["stated_half_width"].get<double>(), 0.5);
  EXPECT_EQ(lines[1]["samples"], 32);
  const nlohmann::json again = json({"lab", file("experiment.json"), "-o", file("out"), "--server", "127.0.0.1:1"});
  EXPECT_EQ(again["results"], 2);  // a level that did not reach its error is not repeated
}

TEST_F(LabTest, ResumesAfterAnInterruptionWithTheSameResults) {
  start_worker("w1");
  on_farm({"lab", experiment("[1, 64, 2048]"), "-o", file("whole")});
  {
    BackgroundProcess interrupted(
        {program("lightmill"), "lab", experiment("[1, 64, 2048]"), "-o", file("parts"), "--server", server()},
        file("lab.log"));
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(file("parts") + "/results.jsonl"); }));
    const nlohmann::json second = on_farm({"lab", experiment("[1, 64, 2048]"), "-o", file("parts")}, 2);
    EXPECT_NE(second["failure"]["message"].get<std::string>().find("another lab uses"), std::string::npos);
    interrupted.send(SIGINT);
    EXPECT_EQ(interrupted.wait(), 130);
  }
  const std::size_t before = results("parts").size();
  EXPECT_GE(before, 1u);
  EXPECT_LT(before, 12u);
  EXPECT_TRUE(std::filesystem::exists(file("parts") + "/report.html"));
  EXPECT_TRUE(on_farm({"jobs"})["jobs"].empty());
  on_farm({"lab", experiment("[1, 64, 2048]"), "-o", file("parts")});
  EXPECT_EQ(results("parts"), results("whole"));
}

TEST_F(SharedLabTest, MistakesAreReportedBeforeAnythingIsRendered) {
  const auto error = [&](const std::string& text) {
    write("bad.json", text);
    return on_farm({"lab", file("bad.json"), "-o", file("out")}, 2)["failure"]["message"].get<std::string>();
  };
  EXPECT_NE(error("{").find("bad.json"), std::string::npos);
  const std::string rest = R"("samples": [1], "reference": {"method": "path", "samples": 1, "seed": 5}})";
  EXPECT_NE(error(R"({"scenes": ["none.json"], "methods": ["path"], )" + rest).find("none.json"), std::string::npos);
  EXPECT_NE(error(fmt::format(R"({{"scenes": ["{}"], "methods": ["path", "magic"], {})",
                              scene("cornell-bench-blocks.json"), rest))
                .find("methods[1]"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(file("out") + "/results.jsonl"));
}

TEST_F(SharedLabTest, AReferenceFileWithASeedOfTheExperimentIsRefused) {
  const std::string box = scene("cornell-bench-blocks.json");
  for (const std::string seed : {"3", "7"}) {
    on_farm({"render", box, "--method", "path", "--size", "20x16", "--spp", "64", "--seed", seed, "-o",
             file(seed + ".exr")});
  }
  const auto experiment = [&](const std::string& scene, const std::string& reference) {
    write("experiment.json",
          fmt::format(R"({{"scenes": ["{}"], "methods": ["path"], "width": 20, "height": 16, "seeds": [1, 3],
                           "samples": [1], "reference": "{}"}})",
                      scene, reference));
  };
  experiment(box, "3.exr");
  EXPECT_NE(
      on_farm({"lab", file("experiment.json"), "-o", file("out")}, 2)["failure"]["message"].get<std::string>().find(
          "has seed 3"),
      std::string::npos);
  const auto notices = [&](const std::string& out) {
    const CommandResult done = lightmill({"lab", file("experiment.json"), "-o", file(out), "--server", server()});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done.err;
  };
  experiment(box, "7.exr");
  EXPECT_EQ(notices("out").find("another scene"), std::string::npos);
  experiment(scene("cornell-bench-balls.json"), "7.exr");
  EXPECT_NE(notices("others").find("another scene"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test
