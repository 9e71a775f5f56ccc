// Work and memory that one caller can cause.
#include "tests/unit/server/coordinator_fixture.h"

namespace lightmill::test {
namespace {

class WorkOfCalls : public CoordinatorTest {};

TEST_F(WorkOfCalls, RowsAndDescriptionsShareTheScene) {
  JobSpec large = spec();
  large.settings.scene = std::string(1 << 20, 's');
  large.settings.assets = std::vector<Sha256>(1'000);
  const JobId job = submit(large);
  for (int priority = 1; priority <= 10; ++priority) {
    ASSERT_TRUE(coordinator->set_priority(job, priority, now, effects).ok());
  }
  const SessionId session = connect("w");
  say(session, WorkerReturn{got<LeaseGrant>(session).at(0).lease});
  std::set<const void*> scenes, assets;
  int rows = 0;
  for (const StoreOp& op : writes) {
    if (const auto* const put = std::get_if<PutJob>(&op)) {
      ++rows;
      scenes.insert(put->record.spec.settings.scene->data());
      assets.insert(put->record.spec.settings.assets->data());
    }
  }
  const std::vector<JobDescription> descriptions = got<JobDescription>(session);
  for (const JobDescription& description : descriptions) {
    scenes.insert(description.settings.scene->data());
    assets.insert(description.settings.assets->data());
  }
  EXPECT_GE(rows, 11);
  EXPECT_GE(descriptions.size(), 2u);
  EXPECT_EQ(scenes, std::set<const void*>{large.settings.scene->data()});
  EXPECT_EQ(assets, std::set<const void*>{large.settings.assets->data()});
}

}  // namespace
}  // namespace lightmill::test
