#include <fmt/ranges.h>

#include <map>

#include "tests/unit/server/web/live_hub_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(LiveHubTest, APageGetsTheGreetingFirstAndNothingBeforeItsRequest) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  submit("ada", "one");
  settle();
  EXPECT_TRUE(page.messages.empty());
  ASSERT_TRUE(ask(page).ok());
  ASSERT_EQ(page.messages.size(), 1u);
  EXPECT_EQ(page.messages[0].greeting().version(), "1.0");
  EXPECT_EQ(page.messages[0].greeting().notices(0), "be kind");
  EXPECT_EQ(page.messages[0].greeting().max_side(), 65536u);
  EXPECT_EQ(page.messages[0].greeting().max_name_bytes(), 200u);
  settle();
  ASSERT_EQ(page.messages.size(), 2u);
  EXPECT_TRUE(page.messages[1].jobs().whole());
  ASSERT_EQ(page.messages[1].jobs().jobs_size(), 1);
  EXPECT_EQ(page.messages[1].jobs().jobs(0).name(), "one");
  hub->remove(page);
}

TEST_F(LiveHubTest, TheGreetingHasTheLayersAndLimitsOfEachMethod) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page).ok());
  std::map<std::string, std::string> facts;
  for (const v1::MethodFacts& each : page.messages[0].greeting().methods()) {
    facts[each.name()] = fmt::format("{} / {}{}{}", fmt::join(each.layers(), " "), each.light_groups() ? "groups " : "",
                                     each.meters() ? "meters " : "", each.max_bounces());
  }
  const std::string surfaces = "albedo normal features depth id";
  EXPECT_EQ(facts.size(), 10u);
  EXPECT_EQ(facts["caustic"], "beauty direct indirect caustic bias " + surfaces + " / groups meters 1000000");
  EXPECT_EQ(facts["auto"], "beauty direct indirect bias " + surfaces + " / groups meters 1000000");
  EXPECT_EQ(facts["ppm"], "beauty bias " + surfaces + " / meters 1000000");
  EXPECT_EQ(facts["whitted"], "beauty " + surfaces + " / 128");
  hub->remove(page);
}

TEST_F(LiveHubTest, OnlyChangesAreSent) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  const JobId first = submit("ada", "one");
  ASSERT_TRUE(ask(page).ok());
  settle();
  submit("ada", "two");
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_FALSE(page.messages.empty());
  const v1::JobChanges& added = page.messages.back().jobs();
  EXPECT_FALSE(added.whole());
  ASSERT_EQ(added.jobs_size(), 1);
  EXPECT_EQ(added.jobs(0).name(), "two");
  on_farm([&](FarmLoop::TaskContext& context) {
    EXPECT_TRUE(context.farm.cancel(first, context.now, context.unix_ms, context.effects).ok());
    EXPECT_TRUE(context.farm.remove(first, context.now, context.effects).ok());
  });
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_EQ(page.messages.back().jobs().removed_size(), 1);
  EXPECT_EQ(page.messages.back().jobs().removed(0), first.value);
  hub->remove(page);
}

TEST_F(LiveHubTest, HiddenPagesGetNothingAndCatchUp) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_TRUE(ask(page, true).ok());
  const std::size_t before = page.messages.size();
  submit("ada", "one");
  submit("ada", "two");
  clock.pass(std::chrono::seconds(60));
  settle();
  EXPECT_EQ(page.messages.size(), before) << "not even a sign of life";
  ASSERT_TRUE(ask(page).ok());
  settle();
  std::set<std::string> names;
  for (std::size_t i = before; i < page.messages.size(); ++i) {
    for (const v1::Job& job : page.messages[i].jobs().jobs()) {
      names.insert(job.name());
    }
  }
  EXPECT_EQ(names, (std::set<std::string>{"one", "two"}));
  hub->remove(page);
}

TEST_F(LiveHubTest, AStalledPageGetsTwoMessagesAndThenOnlyTheNewest) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page).ok());
  const JobId job = submit("ada", "one");
  settle();
  ASSERT_EQ(page.messages.size(), 2u);
  const auto set_paused = [&](bool paused) {
    on_farm([&](FarmLoop::TaskContext& context) {
      const Status status = paused ? context.farm.pause(job, context.now, context.effects)
                                   : context.farm.resume(job, context.now, context.effects);
      EXPECT_TRUE(status.ok()) << status;
    });
    settle();
  };
  set_paused(true);
  set_paused(false);
  set_paused(true);
  EXPECT_EQ(page.messages.size(), 2u);
  ASSERT_TRUE(ask(page).ok());
  ASSERT_EQ(page.messages.size(), 3u);
  ASSERT_EQ(page.messages[2].jobs().jobs_size(), 1);
  EXPECT_EQ(page.messages[2].jobs().jobs(0).state(), v1::JOB_STATE_PAUSED);
  hub->remove(page);
}

TEST_F(LiveHubTest, AWritingSocketGetsNoMessage) {
  Page page;
  page.reads_slowly = true;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page).ok());
  submit("ada", "one");
  settle();
  EXPECT_EQ(page.messages.size(), 1u);
  page.writing = false;
  hub->written(page);
  EXPECT_EQ(page.messages.size(), 2u);
  hub->remove(page);
}

TEST_F(LiveHubTest, AQuietFarmSendsAMessageEveryFiveSeconds) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page).ok());
  settle();
  ASSERT_TRUE(ask(page).ok());
  const std::size_t before = page.messages.size();
  clock.pass(std::chrono::seconds(5));
  hub->tick();
  ASSERT_EQ(page.messages.size(), before + 1);
  EXPECT_EQ(page.messages.back().ByteSizeLong(), 0u);
  hub->remove(page);
}

TEST_F(LiveHubTest, JobsOfOthersAreNeitherListedNorShown) {
  const JobId others = submit("bob", "his");
  submit("ada", "hers");
  Page page;
  hub->add(page, call_of({"ada", {Role::submit}, Proof::certificate, 0, ""}));
  ASSERT_TRUE(ask(page, false, others).ok());
  std::set<std::string> names;
  std::string failure;
  for (int i = 0; i < 3; ++i) {
    settle();
    ASSERT_TRUE(ask(page, false, others).ok());
  }
  for (const v1::ViewUpdate& message : page.messages) {
    EXPECT_FALSE(message.has_job());
    failure += message.job_failure();
    for (const v1::Job& job : message.jobs().jobs()) {
      names.insert(job.name());
    }
  }
  EXPECT_EQ(names, std::set<std::string>{"hers"});
  EXPECT_NE(failure.find("belongs to another user"), std::string::npos) << failure;
  hub->remove(page);
}

TEST_F(LiveHubTest, ARevokedCallerIsDisconnectedOnceAndGetsNothingMore) {
  for (const bool hidden : {false, true}) {
    Page page;
    bool known = true;
    hub->add(page, call_of(anonymous_identity()),
             [&] { return known ? ok_status() : make_error(StatusCode::kUnauthenticated, "the token was revoked"); });
    ASSERT_TRUE(ask(page, hidden).ok());
    settle();
    EXPECT_TRUE(page.closed.empty());
    const std::size_t before = page.messages.size();
    known = false;
    submit("ada", hidden ? "two" : "one");
    settle();
    settle();
    ASSERT_EQ(page.closed.size(), 1u);
    EXPECT_EQ(message_of(page.closed[0]), "the token was revoked");
    EXPECT_EQ(page.messages.size(), before);
    hub->remove(page);
  }
}

TEST_F(LiveHubTest, InvalidRequestsAreRefused) {
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  EXPECT_EQ(hub->ask(page, "\xff\xff\xff").code(), StatusCode::kInvalidArgument);
  v1::ViewRequest request;
  request.set_seen(1);
  EXPECT_EQ(hub->ask(page, request.SerializeAsString()).code(), StatusCode::kInvalidArgument) << "more than were sent";
  request.set_seen(0);
  for (int i = 0; i <= kMaxViewLayers; ++i) {
    request.add_layers(fmt::format("light:{}", i));
  }
  EXPECT_EQ(hub->ask(page, request.SerializeAsString()).code(), StatusCode::kInvalidArgument) << "too many layers";
  EXPECT_TRUE(page.messages.empty());
  hub->remove(page);
}

}  // namespace
}  // namespace lightmill::test
