// Experiments, and the analysis of results on curves with known answers.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "client/lab/analysis.h"
#include "client/lab/experiment.h"
#include "client/lab/page.h"
#include "client/lab/report.h"
#include "common/image/png.h"
#include "tests/support/xml.h"

namespace lightmill::lab {
namespace {

constexpr const char* kSmall = R"({"scenes": ["a.json"], "methods": ["path"], "samples": [1, 4],
  "reference": {"method": "path", "samples": 64, "seed": 9}})";

TEST(Experiment, IsReadFromJson) {
  const Result<Experiment> experiment = parse_experiment(R"({"title": "T",
    "scenes": ["a.json", {"name": "b", "files": ["m.obj", "n.obj"], "camera": "Front", "reference": "b.exr"}],
    "methods": ["path", "whitted"], "seeds": [7, 3], "width": 32, "height": 16, "errors": [0.1, 0.01],
    "max_samples": 128, "reference": {"method": "path", "error": 0.001, "seed": 9}})",
                                                         "dir/sub");
  ASSERT_TRUE(experiment.ok()) << experiment.status();
  EXPECT_EQ(experiment->scenes[0].name, "a");
  EXPECT_EQ(experiment->scenes[0].files, std::vector<std::string>{"dir/sub/a.json"});
  EXPECT_EQ(experiment->scenes[0].reference.error, 0.001);
  EXPECT_EQ(experiment->scenes[1].files, (std::vector<std::string>{"dir/sub/m.obj", "dir/sub/n.obj"}));
  EXPECT_EQ(experiment->scenes[1].camera, "Front");
  EXPECT_EQ(experiment->scenes[1].reference.file, "dir/sub/b.exr");
  EXPECT_EQ(experiment->seeds, (std::vector<std::uint64_t>{7, 3}));
  EXPECT_EQ(experiment->levels(), 2u);
  EXPECT_EQ(experiment->max_samples, 128u);
  EXPECT_EQ(parse_experiment(kSmall, "")->seeds, std::vector<std::uint64_t>{1});
}

TEST(Experiment, PicturesOfOtherRenderersAreRead) {
  const Result<Experiment> experiment =
      parse_experiment(R"({"scenes": ["a.json"], "others": "o.jsonl", "reference": "r.exr"})", "dir");
  ASSERT_TRUE(experiment.ok()) << experiment.status();
  EXPECT_EQ(experiment->others, "dir/o.jsonl");
  EXPECT_TRUE(experiment->methods.empty());
  const std::string line =
      R"({"scene": "a", "method": "Other", "seed": 3, "samples": 16, "seconds": 1.5, "picture": "p.exr"})";
  const auto others = parse_others(line + "\n" + line, "dir");
  ASSERT_TRUE(others.ok()) << others.status();
  ASSERT_EQ(others->size(), 2u);
  EXPECT_EQ((*others)[1].file, "dir/p.exr");
  EXPECT_EQ((*others)[1].seconds, 1.5);
  EXPECT_NE(message_of(parse_others(line + "\n{\"scene\": \"a\"}\n", "").status()).find("line 2: \"method\""),
            std::string::npos);
  EXPECT_FALSE(parse_others("nonsense", "").ok());
  EXPECT_NE(message_of(parse_others("", "").status()).find("no picture"), std::string::npos);
}

TEST(Experiment, TextsThatAreNotJsonHaveAPlace) {
  const std::string error = message_of(parse_experiment("{\n \"scenes\": ", "dir").status());
  EXPECT_TRUE(error.starts_with("not JSON at line 2, column 12: syntax error while parsing value")) << error;
}

TEST(Experiment, MistakesAreNamed) {
  const auto error = [](const std::string& from, const std::string& to) {
    std::string text = kSmall;
    text.replace(text.find(from), from.size(), to);
    const Result<Experiment> experiment = parse_experiment(text, "");
    EXPECT_EQ(experiment.status().code(), StatusCode::kInvalidArgument) << to;
    return message_of(experiment.status());
  };
  EXPECT_NE(
      error("\"samples\": [1, 4]", "\"samples\": [4, 4]").find("samples[1]: 4 must be above samples[0], which is 4"),
      std::string::npos);
  EXPECT_NE(error("[1, 4]", "[1, -4]").find("samples[1]"), std::string::npos);
  EXPECT_NE(error("\"methods\"", "\"method\"").find("unknown field \"method\""), std::string::npos);
  EXPECT_NE(error("[\"path\"]", "[\"path\", \"path\"]").find("path is given twice"), std::string::npos);
  EXPECT_NE(error("\"seed\": 9", "\"seed\": 1").find("seed 1 is also a seed"), std::string::npos);
  for (const char* other : {"[\"auto\"]", "[\"caustic:photons=100\"]", "[\"path:brute-force\"]"}) {
    std::string text = kSmall;
    text.replace(text.find("[\"path\"]"), 8, other);
    EXPECT_TRUE(parse_experiment(text, "").ok()) << other;
    text.replace(text.find("\"seed\": 9"), 9, "\"seed\": 1");
    EXPECT_FALSE(parse_experiment(text, "").ok()) << other << " shares the camera's samples";
  }
  EXPECT_NE(error("\"samples\": [1, 4],", "").find("\"samples\" or \"errors\""), std::string::npos);
  EXPECT_NE(error("\"a.json\"", "{\"name\": \"a\"}").find("scenes[0]"), std::string::npos);
  EXPECT_NE(error("\"samples\": [1, 4]", "\"errors\": [0.1, 0.2]")
                .find("errors[1]: 0.2 must be below errors[0], which is 0.1"),
            std::string::npos);
  EXPECT_NE(error("\"samples\": 64", "\"samples\": 64, \"error\": 1").find("reference: must be"), std::string::npos);
  EXPECT_NE(error("{\"scenes\"", "{\"width\": 3, \"scenes\"").find("width and height"), std::string::npos);
  EXPECT_NE(error("}}", "}").find("not JSON at line "), std::string::npos);
}

/// Results of one method at 1, 2, 4, … samples. Its error is c/samples and its time t·samples. Seeds multiply the error
/// by 1/2, 1 and 2.
std::vector<LabResult> ideal(const std::string& scene, const std::string& method, double c, double t, int levels) {
  std::vector<LabResult> results;
  for (int level = 0; level < levels; ++level) {
    for (int seed = -1; seed <= 1; ++seed) {
      LabResult result;
      result.key = fmt::format("{} {} {} {}", scene, method, level, seed);
      result.scene = scene;
      result.method = method;
      result.seed = static_cast<std::uint64_t>(seed + 1);
      result.level = static_cast<std::size_t>(level);
      result.samples = std::uint64_t{1} << level;
      result.thread_seconds = t * static_cast<double>(result.samples);
      result.error.rel_mse = c / static_cast<double>(result.samples) * std::exp2(seed);
      result.error.rel_mse_trimmed = result.error.rel_mse / 2;
      result.flip = std::sqrt(result.error.rel_mse) / 100;
      results.push_back(result);
    }
  }
  return results;
}

std::vector<LabResult> together(std::vector<LabResult> one, const std::vector<LabResult>& other) {
  one.insert(one.end(), other.begin(), other.end());
  return one;
}

double rel_mse(const LabResult& result) {
  return result.error.rel_mse;
}

TEST(Analysis, CurvesAreMediansAndTimesLieOnThem) {
  const std::vector<CurvePoint> curve = curve_of(ideal("s", "m", 1, 3, 5), "s", "m", rel_mse);
  ASSERT_EQ(curve.size(), 5u);
  EXPECT_DOUBLE_EQ(curve[2].error.median, 0.25);
  EXPECT_DOUBLE_EQ(curve[2].error.least, 0.125);
  EXPECT_DOUBLE_EQ(curve[2].error.most, 0.5);
  EXPECT_EQ(curve[2].seeds, 3u);
  EXPECT_NEAR(slope_of(curve).value(), -1, 1e-12);
  // error · time = 3 on the whole line and beyond its ends.
  EXPECT_NEAR(time_to_error(curve, 0.3)->seconds, 10, 1e-9);
  EXPECT_FALSE(time_to_error(curve, 0.3)->extrapolated);
  EXPECT_NEAR(time_to_error(curve, 10)->seconds, 0.3, 1e-9);
  EXPECT_TRUE(time_to_error(curve, 10)->extrapolated);
  EXPECT_FALSE(time_to_error(curve, 0.05));  // its last is 1/16
  EXPECT_NEAR(time_to_error(curve, 0.05, 2)->seconds, 60, 1e-9);
  EXPECT_FALSE(time_to_error({}, 1));
}

TEST(Analysis, MediansOfEvenNumbersAreGeometric) {
  EXPECT_DOUBLE_EQ(spread_of({8, 1, 2, 100}).median, 4);
  EXPECT_DOUBLE_EQ(spread_of({3}).median, 3);
  EXPECT_DOUBLE_EQ(spread_of({0, 0}).median, 0);
}

TEST(Analysis, SpeedUpsAreRatiosOfErrorTimesTime) {
  const auto fast = curve_of(ideal("s", "f", 1, 1, 6), "s", "f", rel_mse);
  const auto slow = curve_of(ideal("s", "s", 5, 2, 6), "s", "s", rel_mse);
  const std::optional<SpeedUp> gain = speed_up(fast, slow);
  ASSERT_TRUE(gain);
  EXPECT_NEAR(gain->factor, 10, 1e-9);
  EXPECT_NEAR(gain->at_error, 5.0 / 32, 1e-12);
  EXPECT_FALSE(gain->extrapolated);
  EXPECT_NEAR(speed_up(slow, fast)->factor, 0.1, 1e-9);
  const auto far_better = curve_of(ideal("s", "b", 1e-4, 1, 6), "s", "b", rel_mse);
  EXPECT_TRUE(speed_up(far_better, slow)->extrapolated);
  EXPECT_NEAR(speed_up(far_better, slow)->factor, 1e5, 1e-4);
}

TEST(Analysis, RegretIsTheTimeOverTheBestTime) {
  auto results = together(ideal("s", "auto", 1, 1.2, 6), ideal("s", "path", 1, 1, 6));
  results = together(results, ideal("s", "vcm", 1, 3, 6));
  // A fast but wrong method is not a choice: its error stays at 0.5.
  auto wrong = ideal("s", "whitted", 1, 1e-3, 6);
  for (LabResult& result : wrong) {
    result.error.rel_mse = 0.5;
  }
  results = together(results, wrong);
  const std::optional<Regret> regret = regret_of(results, "s", "auto", {"auto", "path", "vcm", "whitted"}, rel_mse);
  ASSERT_TRUE(regret);
  EXPECT_EQ(regret->best, "path");
  EXPECT_NEAR(regret->factor, 1.2, 1e-9);
}

TEST(Analysis, SummariesAreGeometric) {
  const Summary summary = summarise({2, 8});
  EXPECT_NEAR(summary.mean, 4, 1e-12);
  EXPECT_EQ(summary.least, 2);
  EXPECT_EQ(summary.most, 8);
}

TEST(LabResults, SurviveARoundTripInTheRequestedOrder) {
  ResultSet results;
  for (LabResult& result : ideal("a \"b\", c", "m", 1, 1, 2)) {
    result.error.energy_ratio = std::numeric_limits<double>::infinity();
    results[result.key] = result;
  }
  std::vector<std::string> order;
  for (const auto& [key, result] : results) {
    order.insert(order.begin(), key);
  }
  const std::string text = write_lines(results, {order[0], order[3]});
  const Result<ResultSet> back = read_lines(text);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(write_lines(*back, {order[0], order[3]}), text);
  EXPECT_EQ(nlohmann::json::parse(text.substr(0, text.find('\n')))["key"], order[0]);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 6);
  EXPECT_NE(message_of(read_lines(text + "{\n").status()).find("line 7"), std::string::npos);
  const Result<ResultSet> torn = read_lines(std::string_view(text).substr(0, text.size() - 20));
  ASSERT_TRUE(torn.ok()) << torn.status();
  EXPECT_EQ(torn->size(), 5u) << "the last line was cut off";
  const std::string csv = to_csv({results.begin()->second});
  EXPECT_NE(csv.find("\n\"a \"\"b\"\", c\",m,"), std::string::npos) << csv;
}

ReportInput example_input() {
  ReportInput input;
  input.experiment = parse_experiment(kSmall, "").value();
  input.experiment.title = "<one> & all";
  input.experiment.methods = {"path", "auto"};
  input.results = together(ideal("a", "path", 1, 1, 4), ideal("a", "auto", 1, 1.1, 4));
  input.wanted = input.results.size();
  const std::string png = difference_png({1, 1, {2, 2, 2}}, {1, 1, {1, 1, 1}}).value();
  input.scenes = {{"a", 0.03, "path, seed 9", {{"reference", png, ""}, {"path", png, png}}}};
  return input;
}

TEST(Report, IsSelfContainedAndShowsTheNumbers) {
  const ReportInput input = example_input();
  const std::string html = report_html(input);
  EXPECT_NE(html.find("<h1>&lt;one&gt; &amp; all</h1>"), std::string::npos);
  EXPECT_NE(html.find("24 of 24 results"), std::string::npos);
  EXPECT_NE(html.find("0.909×"), std::string::npos);  // auto takes 1.1 times as long
  EXPECT_NE(html.find("1.10×"), std::string::npos);   // and so is its regret
  EXPECT_EQ(html.find("src='http"), std::string::npos);
  EXPECT_EQ(html.find("<link"), std::string::npos);
  EXPECT_NE(html.find("less than ten times the reference's own error"), std::string::npos);
  std::size_t charts = 0;
  for (std::size_t at = html.find("<svg"); at != std::string::npos; at = html.find("<svg", at + 1)) {
    EXPECT_FALSE(test::xml_tags(html.substr(at, html.find("</svg>", at) + 6 - at)).empty());
    ++charts;
  }
  EXPECT_EQ(charts, 3u);
  const std::vector<ReportChart> files = report_charts(input);
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[1].name, "1-trimmed.svg");
  EXPECT_FALSE(test::xml_tags(files[1].svg).empty());
  EXPECT_NE(files[1].svg.find(input.scenes[0].name + ": relMSE without"), std::string::npos);
  const auto numbers = nlohmann::json::parse(report_json(input));
  EXPECT_EQ(numbers["results"].size(), 24u);
  EXPECT_NEAR(numbers["scenes"][0]["regret"]["factor"].get<double>(), 1.1, 1e-9);
  EXPECT_NEAR(numbers["scenes"][0]["methods"][0]["slope"].get<double>(), -1, 1e-9);
}

TEST(Report, AnUnfinishedExperimentHasAPage) {
  ReportInput input = example_input();
  input.results.clear();
  input.scenes[0].pictures.clear();
  EXPECT_NE(report_html(input).find("0 of 24 results"), std::string::npos);
  input.results = ideal("a", "path", 1, 1, 1);
  EXPECT_NE(report_html(input).find("run it again to resume"), std::string::npos);
  EXPECT_FALSE(nlohmann::json::parse(report_json(input), nullptr, false).is_discarded());
}

TEST(Report, PicturesAreBase64) {
  EXPECT_EQ(png_data_uri("Man"), "data:image/png;base64,TWFu");  // RFC 4648
  EXPECT_EQ(png_data_uri("Ma"), "data:image/png;base64,TWE=");
  EXPECT_EQ(png_data_uri("M"), "data:image/png;base64,TQ==");
  EXPECT_EQ(png_data_uri("\xff\xfe"), "data:image/png;base64,//4=");
}

TEST(Report, DifferencesAreRedWhereBrighter) {
  const RgbImage reference{3, 1, {1, 1, 1, 1, 1, 1, 1, 1, 1}};
  const RgbImage picture{3, 1, {2, 1, 0.5f, 2, 1, 0.5f, 2, 1, 0.5f}};
  const std::string png = difference_png(picture, reference).value();
  const RgbImage shown = decode_png(as_byte_view(png)).value();
  EXPECT_EQ(shown.values[0], 1);  // red of the first
  EXPECT_EQ(shown.values[6], 0);
  EXPECT_EQ(shown.values[1] + shown.values[4] + shown.values[7], 0);  // equal is black
  EXPECT_EQ(shown.values[2], 0);
  EXPECT_EQ(shown.values[8], 1);  // blue of the last
}

}  // namespace
}  // namespace lightmill::lab
