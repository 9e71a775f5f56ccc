// The connection, heartbeats, drain and end of a worker's session.
#include "tests/unit/worker/session_fixture.h"

namespace lightmill {
namespace {

TEST_F(SessionTest, HeartbeatsListUnfinishedLeases) {
  begin(1);
  say(grant(2, 3, 1, {0, 1}));
  rendered(asked<RenderTile>()[0]);
  actions.clear();
  EXPECT_EQ(session->next_deadline(), now + std::chrono::seconds(2));
  pass(std::chrono::seconds(2));
  ASSERT_EQ(said<WorkerHeartbeat>().size(), 1u);
  EXPECT_EQ(said<WorkerHeartbeat>()[0].leases, std::vector<LeaseId>{LeaseId{2}});
}

TEST_F(SessionTest, HeartbeatsReportTheTimeOfRunningTiles) {
  begin(3);
  const std::vector<RenderTile> tiles = asked<RenderTile>();
  session->at_work(tiles[0].ticket, 2.5);
  session->at_work(tiles[1].ticket, 0.5);
  session->at_work(tiles[2].ticket, 3);
  session->at_work(999, 3);
  rendered(tiles[2]);
  pass(std::chrono::seconds(2));
  const std::vector<TileAtWork> expected{{LeaseId{1}, TileId{0}, 2.5}};
  EXPECT_EQ(said<WorkerHeartbeat>().back().at_work, expected);
}

TEST_F(SessionTest, HeartbeatsReportTheTimeOfARunningPilot) {
  connect();
  say(PilotGrant{LeaseId{7}, JobId{1}, {}, {"path", "ao"}});
  session->pilot_at_work(LeaseId{7}, 2.5);
  session->pilot_at_work(LeaseId{999}, 3);
  pass(std::chrono::seconds(2));
  const std::vector<TileAtWork> expected{{LeaseId{7}, TileId{0}, 2.5}};
  EXPECT_EQ(said<WorkerHeartbeat>().back().at_work, expected);
}

TEST_F(SessionTest, HeartbeatsReportTheWaitOfResults) {
  const auto last_wait = [&] { return said<WorkerHeartbeat>().back().longest_wait; };
  begin(4);
  pass(std::chrono::seconds(2));
  EXPECT_EQ(last_wait(), std::nullopt);
  rendered(asked<RenderTile>()[0]);
  now += std::chrono::milliseconds(700);
  say(ack(said<WorkerResult>()[0]));
  rendered(asked<RenderTile>()[1]);
  now += std::chrono::milliseconds(100);
  say(ack(said<WorkerResult>()[1]));
  pass(std::chrono::milliseconds(1200));
  EXPECT_EQ(last_wait(), std::chrono::milliseconds(700)) << "the longest of those that were acknowledged";
  rendered(asked<RenderTile>()[2]);
  pass(std::chrono::seconds(2));
  EXPECT_EQ(last_wait(), std::chrono::seconds(2)) << "and of those that are not";
  pass(std::chrono::seconds(2));
  EXPECT_EQ(last_wait(), std::chrono::seconds(4));
  rendered(asked<RenderTile>()[3]);
  now += std::chrono::seconds(60);
  say(ack(said<WorkerResult>()[3]));
  session->disconnected(now, actions);
  pass(std::chrono::seconds(60));
  session->connected(now, actions);
  pass(std::chrono::seconds(2));
  EXPECT_EQ(last_wait(), std::chrono::seconds(2))
      << "it was sent again, and earlier waits belong to another connection";
}

TEST_F(SessionTest, ReconnectsWithBackoff) {
  session->start(now, actions);
  Duration wait{};
  for (int i = 0; i < 8; ++i) {
    session->disconnected(now, actions);
    const Time next = *session->next_deadline();
    EXPECT_GE(next - now, wait);
    wait = next - now;
    now = next;
    session->tick(now, actions);
  }
  EXPECT_EQ(wait, std::chrono::seconds(1));
  session->connected(now, actions);
  say(Welcome{});
  session->disconnected(now, actions);
  EXPECT_EQ(*session->next_deadline() - now, std::chrono::milliseconds(50));
}

TEST_F(SessionTest, ARefusedWorkerBacksOffUntilItIsAdmitted) {
  session->start(now, actions);
  double waited_s = 0;
  for (const double expected_s : {1, 2, 4, 8, 16, 32, 60, 60}) {
    session->disconnected(now, actions, true);
    EXPECT_EQ(*session->next_deadline() - now, from_seconds(expected_s));
    waited_s += expected_s;
    now = *session->next_deadline();
    session->tick(now, actions);
  }
  EXPECT_EQ(asked<OpenStream>().size(), 9u) << "in " << waited_s << " s";
  session->connected(now, actions);
  say(Welcome{});
  session->disconnected(now, actions);
  EXPECT_EQ(*session->next_deadline() - now, std::chrono::milliseconds(50));
  now = *session->next_deadline();
  session->tick(now, actions);
  session->disconnected(now, actions, true);
  EXPECT_EQ(*session->next_deadline() - now, std::chrono::seconds(1)) << "another refusal restarts the backoff";
}

TEST_F(SessionTest, ADrainReturnsUnstartedTilesAndFinishesTheRest) {
  begin(10);
  say(grant(2, 5, 1, {0, 1}));
  const std::vector<RenderTile> out = asked<RenderTile>();
  actions.clear();
  session->drain(now, actions);
  EXPECT_EQ(said<WorkerDraining>().size(), 1u);
  ASSERT_EQ(said<WorkerReturn>().size(), 1u);  // nothing of the second lease has begun
  EXPECT_EQ(said<WorkerReturn>()[0].lease, LeaseId{2});
  for (const RenderTile& tile : out) {
    rendered(tile);
  }
  ASSERT_EQ(said<WorkerReturn>().size(), 2u);
  EXPECT_EQ(said<WorkerReturn>()[1].lease, LeaseId{1});
  EXPECT_EQ(said<WorkerResult>().size(), 4u);
  say(grant(3, 2));
  EXPECT_EQ(said<WorkerReturn>().size(), 3u);
  EXPECT_TRUE(asked<Exit>().empty());
  for (const WorkerResult& result : said<WorkerResult>()) {
    say(ack(result));
  }
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_FALSE(asked<Exit>()[0].failed);
  EXPECT_EQ(asked<CloseStream>().size(), 1u);
}

TEST_F(SessionTest, ADrainRequestFinishesAllHeldTiles) {
  begin(6);
  say(DrainRequest{});
  EXPECT_TRUE(said<WorkerReturn>().empty());
  for (std::size_t i = 0; i < 6; ++i) {
    rendered(asked<RenderTile>().at(i));
  }
  for (const WorkerResult& result : said<WorkerResult>()) {
    say(ack(result));
  }
  EXPECT_EQ(asked<Exit>().size(), 1u);
}

TEST_F(SessionTest, ADrainWithoutACoordinatorWaitsBrieflyAndDropsResults) {
  begin(1);
  rendered(asked<RenderTile>()[0]);
  session->disconnected(now, actions);
  session->drain(now, actions);
  pass(std::chrono::milliseconds(4'900));
  session->disconnected(now, actions);  // another failed attempt does not delay the end
  EXPECT_TRUE(asked<Exit>().empty());
  EXPECT_LE(*session->next_deadline() - now, std::chrono::milliseconds(100));
  pass(std::chrono::milliseconds(100));
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_FALSE(asked<Exit>()[0].failed);
  EXPECT_NE(asked<Exit>()[0].reason.find("Dropped tiles, which other workers will render again: 1"), std::string::npos)
      << asked<Exit>()[0].reason;
}

TEST_F(SessionTest, ADrainWithoutACoordinatorOrResultsLeavesAtOnce) {
  connect();
  say(description());
  say(grant(1, 3));  // leased, its scene not there yet
  session->disconnected(now, actions);
  session->drain(now, actions);
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_FALSE(asked<Exit>()[0].failed);
}

TEST_F(SessionTest, ADrainDeliversWhenTheCoordinatorReturns) {
  begin(1);
  session->drain(now, actions);
  session->disconnected(now, actions);
  rendered(asked<RenderTile>()[0]);
  pass(std::chrono::seconds(4));
  come_back();
  pass(std::chrono::seconds(4));
  EXPECT_TRUE(asked<Exit>().empty());
  say(ack(said<WorkerResult>().at(0)));
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_EQ(asked<Exit>()[0].reason, "drained");
}

TEST_F(SessionTest, ARequestedDrainIsLogged) {
  begin(1);
  say(DrainRequest{});
  ASSERT_EQ(asked<LogNotice>().size(), 1u);
  EXPECT_EQ(asked<LogNotice>()[0].text,
            "the coordinator drains this worker: this worker finishes running tiles, gives back the rest and leaves");
}

TEST_F(SessionTest, ADrainDropsUnacknowledgedResults) {
  begin(1);
  rendered(asked<RenderTile>()[0]);
  session->drain(now, actions);
  pass(std::chrono::seconds(29));
  EXPECT_TRUE(asked<Exit>().empty());
  pass(std::chrono::seconds(1));
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_FALSE(asked<Exit>()[0].failed);
}

TEST_F(SessionTest, ADrainWaitsAsLongAsItsTilesTake) {
  begin(10);
  rendered(asked<RenderTile>()[0], 50.0);
  session->drain(now, actions);
  pass(std::chrono::seconds(129));
  EXPECT_TRUE(asked<Exit>().empty()) << "each thread may have two tiles of 50 s";
  pass(std::chrono::seconds(1));
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_NE(asked<Exit>()[0].reason.find("take too long"), std::string::npos) << asked<Exit>()[0].reason;
}

TEST_F(SessionTest, LeavesWhenDismissed) {
  begin(3);
  say(Dismissal{"another worker came with the name w"});
  ASSERT_EQ(asked<Exit>().size(), 1u);
  EXPECT_EQ(asked<Exit>()[0].reason, "another worker came with the name w");
  EXPECT_TRUE(asked<Exit>()[0].failed);
  EXPECT_FALSE(session->next_deadline());
}

}  // namespace
}  // namespace lightmill
