// A short run of the failure atlas: every case by every method that the planner admits, at few samples. None may be
// wrong.
//
// For false alarms see atlas_map.h. The seeds are fixed, so a run that passes stays so.
#include <gtest/gtest.h>

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/light_over_mirror.h"
#include "tests/atlas/map/atlas_page.h"
#include "tests/atlas/map/measured_rows.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

/// Difference to the map in log2 of the samples of each seed.
constexpr int kShort = -2;

class AtlasMap : public ::testing::TestWithParam<AtlasGroup> {};

TEST_P(AtlasMap, NoMethodIsWrongWithoutAVeto) {
  AtlasSettings settings;
  settings.methods = atlas_methods();
  std::erase_if(settings.methods, [](const std::string& method) {
    return method == "ppm";  // noise and blur hide errors in a short run
  });
  settings.more_levels = kShort;
  for (const AtlasCase& each : GetParam().cases()) {
    if (!each.quick) {
      continue;
    }
    AtlasSettings its = settings;
    std::erase(its.methods, each.long_by);
    const AtlasRow row = measure(each, its);
    for (const AtlasCell& cell : row.cells) {
      EXPECT_NE(cell.outcome, Outcome::wrong) << cell.method << ", " << each.name << ": " << cell.reason;
      EXPECT_NE(cell.outcome, Outcome::stopped) << cell.method << ", " << each.name;
    }
  }
}

TEST(AtlasReport, DistinguishesRightWrongSlowVetoedAndRefused) {
  AtlasCase what = LightOverMirror{.subject = "s", .name = "a \"lamp\" <over> a mirror", .radius = 0.3}.made();
  const double exact = *what.exact;
  const AtlasSettings settings{.methods = {"path", "whitted"}, .seeds = 8, .measure_vetoed = true};
  const auto outcomes = [&] {
    std::vector<Outcome> all;
    for (const AtlasCell& cell : measure(what, settings).cells) {
      all.push_back(cell.outcome);
    }
    return all;
  };
  EXPECT_EQ(outcomes(), (std::vector{Outcome::right, Outcome::vetoed}));
  what.seconds_to_percent = 0;
  EXPECT_EQ(outcomes(), (std::vector{Outcome::slow, Outcome::vetoed}));
  what.exact = 1.03 * exact;
  EXPECT_EQ(outcomes(), (std::vector{Outcome::wrong, Outcome::vetoed}));
  what.tolerance = 0.05;
  EXPECT_EQ(outcomes(), (std::vector{Outcome::slow, Outcome::vetoed}));
  what.exact.reset();
  EXPECT_EQ(outcomes(), (std::vector{Outcome::alone, Outcome::vetoed}));
  what.refusal = "no such message";
  EXPECT_EQ(outcomes(), (std::vector{Outcome::wrong, Outcome::wrong})) << "it is accepted";
  what.document = document(R"("eye": [1, 2, 3], "look_at": [1, 2, 3])", 40, 8, "", "");
  what.refusal = "camera.look_at: must differ";
  EXPECT_EQ(outcomes(), (std::vector{Outcome::vetoed, Outcome::vetoed}));
}

TEST(AtlasReport, ThePageCountsOutcomesAndEscapesNames) {
  AtlasCase what = LightOverMirror{.subject = "s", .name = "a \"lamp\" <over> a mirror", .radius = 0.3}.made();
  *what.exact *= 1.1;
  const AtlasSettings settings{.methods = {"path"}, .seeds = 4, .measure_vetoed = true};
  const std::vector<AtlasRow> rows{measure(what, settings)};
  EXPECT_EQ(count_outcomes(rows, "path").wrong, 1);
  const std::string html = atlas_html(rows, settings);
  for (const char* const part :
       {"Wrong without a veto: 1", "&lt;over&gt;", "data:image/png;base64,", "class='cell wrong'"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
  EXPECT_NE(atlas_csv(rows).find("\"s\",\"a \"\"lamp\"\" <over> a mirror\",path,wrong,"), std::string::npos);
  EXPECT_NE(atlas_json(rows, settings).find("\"outcome\": \"wrong\""), std::string::npos);
}

TEST(AtlasReport, ResumesWithTheMeasuredRows) {
  const TemporaryFolder folder;
  const MeasuredRows measured(folder.path());
  AtlasCase what = LightOverMirror{.subject = "s", .name = "a lamp over a mirror", .radius = 0.3}.made();
  what.files["picture.png"] = "\x89PNG";
  AtlasSettings settings{.methods = {"path", "whitted"}, .seeds = 4, .measure_vetoed = true};
  EXPECT_FALSE(measured.find(what, settings));
  const std::vector<AtlasRow> rows{measure(what, settings)};
  ASSERT_TRUE(measured.keep(rows[0], settings).ok());
  const auto found = measured.find(what, settings);
  ASSERT_TRUE(found);
  const std::vector<AtlasRow> again{*found};
  EXPECT_EQ(atlas_json(again, settings), atlas_json(rows, settings));
  EXPECT_EQ(atlas_html(again, settings), atlas_html(rows, settings)) << "with the pictures";
  settings.seeds = 5;
  EXPECT_FALSE(measured.find(what, settings));
  settings.seeds = 4;
  *what.exact *= 2;
  EXPECT_FALSE(measured.find(what, settings));
}

TEST(AtlasReport, NumbersAreFiniteWhenAllSeedsAreDark) {
  const AtlasCase what =
      LightOverMirror{.subject = "s", .name = "a lamp that none meets", .radius = 1e-5, .textured = true}.made();
  const AtlasSettings settings{.methods = {"path"}, .seeds = 4, .measure_vetoed = true};
  const std::vector<AtlasRow> rows{measure(what, settings)};
  EXPECT_EQ(rows[0].cells[0].mean, 0);
  EXPECT_EQ(rows[0].cells[0].z, -kMaxZ);
  EXPECT_EQ(atlas_json(rows, settings).find("null"), std::string::npos) << atlas_json(rows, settings);
}

INSTANTIATE_TEST_SUITE_P(Of, AtlasMap, ::testing::ValuesIn(atlas_groups().begin(), atlas_groups().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace lightmill::test
