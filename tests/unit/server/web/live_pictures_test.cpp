// Pictures on a live page: layers come in turn, and large ones wait for room.
#include "tests/unit/server/web/live_hub_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(LiveHubTest, TheOpenJobIsFollowedAndAMissingOneIsReported) {
  const JobId job = submit("ada", "one");
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page, false, JobId{42}).ok());
  settle();
  ASSERT_TRUE(ask(page, false, JobId{42}).ok());
  settle();
  std::string failure;
  for (const v1::ViewUpdate& message : page.messages) {
    failure += message.job_failure();
  }
  EXPECT_EQ(failure, "there is no job 42");
  ASSERT_TRUE(ask(page, false, job).ok());
  settle();
  ASSERT_TRUE(ask(page, false, job).ok());
  bool shown = false;
  for (const v1::ViewUpdate& message : page.messages) {
    shown = shown || (message.has_job() && message.job().id() == job.value);
  }
  EXPECT_TRUE(shown);
  hub->remove(page);
}

/// The number of tiles of each layer, from message `first` on.
std::map<std::string, std::size_t> tiles_of(const Page& page, std::size_t first = 0) {
  std::map<std::string, std::size_t> counts;
  for (std::size_t i = first; i < page.messages.size(); ++i) {
    for (const v1::ViewTile& tile : page.messages[i].tiles()) {
      ++counts[tile.layer()];
    }
  }
  return counts;
}

/// The last failure of each layer.
std::map<std::string, std::string> layer_failures(const Page& page) {
  std::map<std::string, std::string> failures;
  for (const v1::ViewUpdate& message : page.messages) {
    for (const v1::LayerFailure& failure : message.layer_failures()) {
      failures[failure.layer()] = failure.why();
    }
  }
  return failures;
}

std::size_t failed_layers(const Page& page) {
  const std::map<std::string, std::string> failures = layer_failures(page);
  return static_cast<std::size_t>(
      std::ranges::count_if(failures, [](const auto& each) { return !each.second.empty(); }));
}

TEST_F(LiveHubTest, LayersOfALargePictureAreSentInTurn) {
  const std::vector<std::string> layers{"light:key", "light:rest"};
  const JobId job = submit("ada", "large", 64 * 20, 64 * 10, layers);
  render(job);
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page, false, job, layers).ok());
  ask_until([&] { return tiles_of(page).size() == 3; }, page, job, layers);
  std::set<std::string> first_of_messages;
  for (const v1::ViewUpdate& message : page.messages) {
    if (message.tiles_size() > 0) {
      first_of_messages.insert(message.tiles(0).layer());
    }
  }
  EXPECT_EQ(first_of_messages, (std::set<std::string>{"", "light:key", "light:rest"}));
  EXPECT_LT(tiles_of(page)[""], 200u) << "the others came before it was whole";
  const std::map<std::string, std::size_t> all{{"", 200}, {"light:key", 200}, {"light:rest", 200}};
  ask_until([&] { return tiles_of(page) == all; }, page, job, layers);
  EXPECT_EQ(tiles_of(page), all);
  hub->remove(page);
}

TEST_F(LiveHubTest, ALayerWithoutRoomIsSentWhenThereIsRoom) {
  // 32,640 of 32,768 tiles: none is rendered, but room is kept for all.
  const JobId large = submit("ada", "large", 64 * 255, 64 * 128);
  const std::vector<std::string> layers{"light:key", "light:rest"};
  const JobId job = submit("ada", "small", 64 * 10, 64 * 8, layers);
  Page first, second;
  hub->add(first, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(first, false, large).ok());
  settle();
  hub->add(second, call_of(anonymous_identity()));
  // There is room for 80 tiles once.
  ASSERT_TRUE(ask(second, false, job).ok());
  ask_until([&] { return failed_layers(second) == 2; }, second, job, layers);
  auto failures = layer_failures(second);
  EXPECT_FALSE(failures.contains("")) << failures[""];
  EXPECT_NE(failures["light:key"].find("80 tiles"), std::string::npos) << failures["light:key"];
  EXPECT_NE(failures["light:rest"].find("80 tiles"), std::string::npos) << failures["light:rest"];
  EXPECT_NE(failures["light:rest"].find("It appears when those pages are closed."), std::string::npos);
  bool has_job = false;
  for (const v1::ViewUpdate& message : second.messages) {
    EXPECT_EQ(message.job_failure(), "");
    has_job = has_job || message.job().id() == job.value;
  }
  EXPECT_TRUE(has_job) << "the job itself is followed";
  hub->remove(first);
  ask_until([&] { return failed_layers(second) == 0; }, second, job, layers);
  failures = layer_failures(second);
  EXPECT_EQ(failures["light:key"], "");
  EXPECT_EQ(failures["light:rest"], "");
  on_farm([&](FarmLoop::TaskContext& context) {
    EXPECT_TRUE(context.farm.cancel(large, context.now, context.unix_ms, context.effects).ok());
  });
  render(job);
  const std::map<std::string, std::size_t> all{{"", 80}, {"light:key", 80}, {"light:rest", 80}};
  ask_until([&] { return tiles_of(second) == all; }, second, job, layers);
  EXPECT_EQ(tiles_of(second), all);
  hub->remove(second);
}

TEST_F(LiveHubTest, APageThatMayNotSeeTheJobTakesNoRoomAndNoWork) {
  const std::vector<std::string> layers{"light:key", "light:rest"};
  const JobId his = submit("bob", "large", 64 * 255, 64 * 128);  // nearly all of the room
  const JobId hers = submit("ada", "small", 64 * 10, 64 * 8, layers);
  Page page;
  hub->add(page, call_of({"ada", {Role::submit}, Proof::certificate, 0, ""}));
  const auto refused = [&] {
    return std::ranges::any_of(page.messages, [](const v1::ViewUpdate& message) {
      return message.job_failure().find("belongs to another user") != std::string::npos;
    });
  };
  ask_until(refused, page, his, {});
  ASSERT_TRUE(refused());
  // It is told so once, and may watch another job.
  Page second;
  hub->add(second, call_of({"ada", {Role::submit}, Proof::certificate, 0, ""}));
  render(hers);
  const std::map<std::string, std::size_t> all{{"", 80}, {"light:key", 80}, {"light:rest", 80}};
  ask_until([&] { return tiles_of(second) == all; }, second, hers, layers);
  EXPECT_EQ(tiles_of(second), all);
  EXPECT_EQ(failed_layers(second), 0u);
  EXPECT_EQ(std::ranges::count_if(page.messages, [](const auto& message) { return !message.job_failure().empty(); }),
            1);
  ask_until([&] { return tiles_of(page)[""] == 80; }, page, hers, {});
  EXPECT_EQ(tiles_of(page)[""], 80u);
  hub->remove(page);
  hub->remove(second);
}

TEST_F(LiveHubTest, ATooLargePictureIsNotShownButItsJobIs) {
  const JobId job = submit("ada", "huge", 64 * 256, 64 * 129);
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(ask(page, false, job).ok());
    settle();
  }
  EXPECT_NE(layer_failures(page)[""].find("33024 tiles"), std::string::npos) << layer_failures(page)[""];
  EXPECT_EQ(layer_failures(page)[""].find("It appears when"), std::string::npos) << layer_failures(page)[""];
  EXPECT_EQ(page.messages.front().job_failure(), "");
  bool has_job = false;
  for (const v1::ViewUpdate& message : page.messages) {
    has_job = has_job || message.job().id() == job.value;
  }
  EXPECT_TRUE(has_job);
  hub->remove(page);
}

/// The first red value of each tile of this layer, as half floats.
std::set<unsigned> first_reds(const Page& page, const std::string& layer) {
  std::set<unsigned> reds;
  for (const v1::ViewUpdate& message : page.messages) {
    for (const v1::ViewTile& tile : message.tiles()) {
      if (tile.layer() == layer) {
        reds.insert(static_cast<unsigned char>(tile.rgbe()[0]) | static_cast<unsigned char>(tile.rgbe()[1]) << 8);
      }
    }
  }
  return reds;
}

TEST_F(LiveHubTest, ADenoisedPictureFollowsTheFilm) {
  const std::vector<std::string> layers{"denoised"};
  const JobId job = submit("ada", "small", 64 * 4, 64 * 3, {"features"});
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ASSERT_TRUE(ask(page, false, job, layers).ok());
  settle();
  render(job);
  const std::map<std::string, std::size_t> all{{"", 12}, {"denoised", 12}};
  ask_until([&] { return tiles_of(page) == all; }, page, job, layers);
  EXPECT_EQ(tiles_of(page), all);
  constexpr unsigned kOne = 0x3c00;
  EXPECT_EQ(first_reds(page, "denoised"), std::set<unsigned>{kOne});
  // The job has ended, so that a page that opens later gets it from the film alone.
  Page late;
  hub->add(late, call_of(anonymous_identity()));
  ask_until([&] { return tiles_of(late) == all; }, late, job, layers);
  EXPECT_EQ(tiles_of(late), all);
  hub->remove(page);
  hub->remove(late);
}

TEST_F(LiveHubTest, FilmsWithoutFeaturesAndLargeOnesAreNotDenoised) {
  const std::vector<std::string> layers{"denoised"};
  const JobId plain = submit("ada", "plain", 64, 64);
  const JobId large = submit("ada", "large", 64 * 33, 64 * 16, {"features"});
  render(plain);
  Page page;
  hub->add(page, call_of(anonymous_identity()));
  ask_until([&] { return tiles_of(page)[""] == 1; }, page, plain, layers);
  settle();
  EXPECT_EQ(tiles_of(page), (std::map<std::string, std::size_t>{{"", 1}}));
  ask_until([&] { return failed_layers(page) == 1; }, page, large, layers);
  EXPECT_EQ(layer_failures(page)["denoised"],
            fmt::format("it has 2162688 pixels, and the page denoises 2097152 at most. "
                        "`lightmill fetch {} --denoise` denoises it",
                        large.value));
  hub->remove(page);
}

TEST_F(LiveHubTest, APageThatLeavesDuringDenoisingIsForgotten) {
  const JobId job = submit("ada", "small", 64 * 8, 64 * 8, {"features"});
  render(job);
  {
    Page page;
    hub->add(page, call_of(anonymous_identity()));
    ASSERT_TRUE(ask(page, false, job, {"denoised"}).ok());
    settle();
    hub->remove(page);
  }
  hub.reset();
  run_posted();
}

}  // namespace
}  // namespace lightmill::test
