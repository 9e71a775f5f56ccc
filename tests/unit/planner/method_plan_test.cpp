#include "common/planner/method_plan.h"

#include <gtest/gtest.h>

#include "common/methods/spec/method_spec.h"
#include "tests/unit/planner/planner_scenes.h"

namespace lightmill {
namespace {

TEST(Plan, ANamedMethodIsKept) {
  const SceneFacts facts = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  for (const char* method : {"path", "whitted:flat,glass=0.1", "ao:distance=2"}) {
    const MethodPlan plan = plan_method(facts, method);
    EXPECT_EQ(plan.candidates, std::vector<std::string>{method});
    EXPECT_TRUE(plan.reasons.empty());
  }
}

TEST(Plan, AutoPicksPathIfItFindsAllLightAndExplains) {
  const MethodPlan plan = plan_method(read_facts(scene_of({kWhite, emitter()}, {})), "auto");
  EXPECT_EQ(plan.candidates, std::vector<std::string>{"path"});
  ASSERT_EQ(plan.reasons.size(), 1u);
  EXPECT_FALSE(plan.reasons[0].empty());
  EXPECT_EQ(plan_method(read_facts(scene_of({kWhite}, {kSky})), "auto:brute-force").candidates,
            std::vector<std::string>{"path:brute-force"});
}

TEST(Plan, TheReasonIsThatOfTheMethodThatMissesLight) {
  const SceneFacts facts = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  const MethodPlan plan = plan_method(facts, "auto");
  EXPECT_EQ(plan.candidates, std::vector<std::string>{"caustic"});
  EXPECT_EQ(plan.reasons, std::vector<std::string>{"path misses light: " + admit(facts, "path").reason})
      << "without the method that finds it, which is the chosen one";
  EXPECT_EQ(method_notices(facts, "path"),
            std::vector<std::string>{"path: " + admit(facts, "path").reason + ". caustic finds it"});
}

TEST(Plan, AutoPicksAKnownMethodForEveryScene) {
  for (const SceneFacts& facts :
       {read_facts(scene_of({kWhite, kGlass}, {kBulb})), read_facts(scene_of({kWhite, lacquer(0)}, {kBulb})),
        read_facts(scene_of({kMirror}, {kSky})), read_facts(scene_of({kBlack}, {}))}) {
    const MethodPlan plan = plan_method(facts, "auto");
    ASSERT_FALSE(plan.candidates.empty());
    EXPECT_FALSE(plan.reasons.empty());
    for (const std::string& method : plan.candidates) {
      EXPECT_TRUE(parse_method(method).ok()) << method;
      EXPECT_EQ(admit(facts, method).admitted, method_notices(facts, method).empty());
      EXPECT_TRUE(plan.candidates.size() == 1 || admit(facts, method).admitted) << "pilots cannot see missing light";
    }
  }
}

TEST(Notices, NameMethodsThatMissLight) {
  const SceneFacts glass = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  ASSERT_EQ(method_notices(glass, "path:brute-force").size(), 1u);
  EXPECT_TRUE(method_notices(glass, "path")[0].starts_with("path: "));
  EXPECT_EQ(method_notices(glass, "whitted:flat").size(), 1u);
  EXPECT_EQ(method_notices(glass, "raycast").size(), 1u);
  EXPECT_TRUE(method_notices(glass, "preview").empty()) << "shows no light at all";
  EXPECT_TRUE(method_notices(glass, "ao:distance=1").empty());
  EXPECT_TRUE(method_notices(read_facts(scene_of({kWhite, kGlass}, {kSky})), "path").empty());
}

TEST(Notices, WarnOfBlurredReadings) {
  Scene scene = scene_of({kWhite, kGlass}, {kBulb});
  scene.meters.push_back({"patch", PatchMeter{}});
  EXPECT_TRUE(method_notices(read_facts(scene), "ppm").empty());
  scene.meters.push_back({"desk", IrradianceMeter{}});
  const SceneFacts facts = read_facts(scene);
  for (const char* const method : {"ppm:radius=1", "caustic", "vcm"}) {
    ASSERT_EQ(method_notices(facts, method).size(), 1u) << method;
    EXPECT_NE(method_notices(facts, method)[0].find("the point meter 'desk'"), std::string::npos);
  }
  EXPECT_EQ(method_notices(facts, "path").size(), 1u) << "of the light alone that it misses";
}

}  // namespace
}  // namespace lightmill
