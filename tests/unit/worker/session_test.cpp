#include "worker/session/session.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

class SessionTest : public testing::Test {
 protected:
  SessionTest() { restart({}); }
  void restart(SessionConfig config) {
    config.name = "w";
    config.threads = 2;
    config.fingerprint_class = "class-a";
    config.renderer_version = kRendererVersion;
    session = std::make_unique<Session>(config);
  }

  static JobDescription description(std::uint64_t job = 1, const char* digest = "digest") {
    return {JobId{job}, sha256(digest), {}};
  }
  static LeaseGrant grant(std::uint64_t lease, std::uint32_t tiles, std::uint64_t job = 1, SampleRange range = {0, 0}) {
    LeaseGrant grant{LeaseId{lease}, {JobId{job}, range, {}}};
    for (std::uint32_t i = 0; i < tiles; ++i) {
      grant.unit.tiles.push_back(TileId{i});
    }
    return grant;
  }
  void say(CoordinatorMessage message) { session->message(message, now, actions); }
  void connect() {
    session->start(now, actions);
    come_back();
  }
  void come_back(Hash128 farm = {1, 1}) {
    session->connected(now, actions);
    say(Welcome{1, std::chrono::seconds(2), std::chrono::seconds(10), farm});
  }
  /// Connects, with a job ready and one lease.
  void begin(std::uint32_t tiles) {
    connect();
    say(description());
    session->job_ready(JobId{1}, now, actions);
    say(grant(1, tiles));
  }
  void pass(Duration time) {
    now += time;
    session->tick(now, actions);
  }
  void rendered(const RenderTile& tile, double seconds = 0.01) {
    Node node{tile.key.range, std::vector<float>(24, 1.0f), 0};
    const Hash128 hash = hash_of(node);
    session->tile_rendered({tile.ticket, std::move(node), hash, seconds}, now, actions);
  }
  /// All actions of one kind since the last `actions.clear()`.
  template <class T>
  std::vector<T> asked() const {
    std::vector<T> found;
    for (const SessionAction& action : actions) {
      if (const auto* each = std::get_if<T>(&action)) {
        found.push_back(*each);
      }
    }
    return found;
  }
  template <class T>
  std::vector<T> said() const {
    std::vector<T> found;
    for (const SendMessage& send : asked<SendMessage>()) {
      if (const auto* each = std::get_if<T>(send.message.get())) {
        found.push_back(*each);
      }
    }
    return found;
  }
  static ResultAck ack(const WorkerResult& result) { return {{result.key}}; }

  Time now{std::chrono::seconds(50)};
  std::unique_ptr<Session> session;
  SessionActions actions;
};

TEST_F(SessionTest, TheHelloComesFirst) {
  session->start(now, actions);
  ASSERT_EQ(asked<OpenStream>().size(), 1u);
  session->connected(now, actions);
  ASSERT_EQ(asked<SendMessage>().size(), 1u);
  const WorkerHello hello = said<WorkerHello>().at(0);
  EXPECT_EQ(hello.name, "w");
  EXPECT_EQ(hello.threads, 2u);
  EXPECT_TRUE(hello.held.empty());
}

TEST_F(SessionTest, TilesWaitForTheirSceneAndThreadsAreKeptBusy) {
  connect();
  say(description());
  say(grant(1, 10));
  EXPECT_EQ(asked<PrepareJob>().size(), 1u);
  EXPECT_TRUE(asked<RenderTile>().empty());
  session->job_ready(JobId{1}, now, actions);
  ASSERT_EQ(asked<RenderTile>().size(), 4u);  // 2 × threads
  rendered(asked<RenderTile>()[0]);
  EXPECT_EQ(asked<RenderTile>().size(), 5u);
  ASSERT_EQ(said<WorkerResult>().size(), 1u);
  const WorkerResult result = said<WorkerResult>()[0];
  EXPECT_EQ(result.lease, LeaseId{1});
  EXPECT_EQ(result.key, (NodeKey{JobId{1}, TileId{0}, {0, 0}}));
  EXPECT_EQ(result.render_digest, sha256("digest"));
  EXPECT_EQ(result.hash, hash_of(result.node));
}

TEST_F(SessionTest, AJobWhoseLeasesAreCancelledIsForgottenWhileItIsPrepared) {
  connect();
  say(description());
  say(grant(1, 10));
  say(LeaseCancel{{LeaseId{1}}});
  EXPECT_EQ(asked<ForgetJob>().size(), 1u);
  say(description());
  say(grant(2, 10));
  EXPECT_EQ(asked<PrepareJob>().size(), 2u);
  session->job_ready(JobId{1}, now, actions);
  EXPECT_FALSE(asked<RenderTile>().empty());
}

TEST_F(SessionTest, FirstSamplesAreRenderedBeforeEarlierGrants) {
  connect();
  say(description());
  session->job_ready(JobId{1}, now, actions);
  say(grant(1, 10, 1, {3, 1}));
  ASSERT_EQ(asked<RenderTile>().size(), 4u);
  say(grant(2, 2, 1, {0, 0}));
  for (std::size_t i = 0; i < 3; ++i) {
    rendered(asked<RenderTile>()[i]);
  }
  ASSERT_EQ(asked<RenderTile>().size(), 7u);
  EXPECT_EQ(asked<RenderTile>()[4].lease, LeaseId{2});
  EXPECT_EQ(asked<RenderTile>()[5].lease, LeaseId{2});
  EXPECT_EQ(asked<RenderTile>()[6].lease, LeaseId{1});
}

TEST_F(SessionTest, ResultsAreKeptUntilAcknowledgedAndSentAgainInOrder) {
  begin(3);
  const std::vector<RenderTile> tiles = asked<RenderTile>();
  rendered(tiles[2]);
  rendered(tiles[0]);
  rendered(tiles[1]);
  say(ack(said<WorkerResult>()[1]));
  EXPECT_EQ(session->status().results_unacknowledged, 2u);
  session->disconnected(now, actions);
  actions.clear();
  pass(std::chrono::seconds(1));
  EXPECT_EQ(asked<OpenStream>().size(), 1u);
  session->connected(now, actions);
  EXPECT_TRUE(said<WorkerResult>().empty()) << "it does not know yet whose farm that is";
  say(Welcome{2, std::chrono::seconds(2), std::chrono::seconds(10), {1, 1}});
  const WorkerHello hello = said<WorkerHello>().at(0);
  ASSERT_EQ(hello.held.size(), 1u);
  EXPECT_EQ(hello.held[0].lease, LeaseId{1});
  EXPECT_EQ(hello.held[0].epoch, 1u);
  EXPECT_EQ(hello.held[0].render_digest, sha256("digest"));
  EXPECT_EQ(hello.held[0].unit.tiles, (std::vector<TileId>{TileId{1}, TileId{2}}));
  const std::vector<WorkerResult> again = said<WorkerResult>();
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].key.tile, TileId{2});
  EXPECT_EQ(again[1].key.tile, TileId{1});
  say(ack(again[0]));
  say(ack(again[1]));
  EXPECT_EQ(session->status().results_unacknowledged, 0u);
  EXPECT_EQ(session->status().unacknowledged_bytes, 0u);
  EXPECT_EQ(session->status().leases, 0u);
  EXPECT_EQ(asked<ForgetJob>().size(), 1u);
}

TEST_F(SessionTest, RenderingContinuesWhileTheStreamIsDown) {
  begin(6);
  session->disconnected(now, actions);
  rendered(asked<RenderTile>()[0]);
  EXPECT_EQ(asked<RenderTile>().size(), 5u);
  EXPECT_TRUE(said<WorkerResult>().empty());
  come_back();
  EXPECT_EQ(said<WorkerResult>().size(), 1u);
}

TEST_F(SessionTest, EachResultCarriesTheTagOfItsGrant) {
  connect();
  say(description());
  session->job_ready(JobId{1}, now, actions);
  LeaseGrant granted = grant(1, 3);
  granted.tags = {sha256("0"), sha256("1"), sha256("2")};
  say(granted);
  rendered(asked<RenderTile>().at(1));
  EXPECT_EQ(said<WorkerResult>().at(0).tag, sha256("1"));
  session->disconnected(now, actions);
  actions.clear();
  session->connected(now, actions);
  const HeldLease held = said<WorkerHello>().at(0).held.at(0);
  EXPECT_EQ(held.unit.tiles.size(), 3u);
  EXPECT_EQ(held.tags, granted.tags);
}

TEST_F(SessionTest, NoResultIsSentToAnotherFarm) {
  begin(3);
  const std::vector<RenderTile> old = asked<RenderTile>();
  rendered(old[0]);
  session->disconnected(now, actions);
  actions.clear();
  come_back({2, 2});
  EXPECT_TRUE(said<WorkerResult>().empty());
  EXPECT_EQ(asked<StopTile>().size(), 2u);
  EXPECT_EQ(asked<ForgetJob>().size(), 1u);
  EXPECT_EQ(asked<LogNotice>().size(), 1u);
  EXPECT_EQ(session->status().leases, 0u);
  EXPECT_EQ(session->status().results_unacknowledged, 0u);
  EXPECT_EQ(session->status().unacknowledged_bytes, 0u);
  rendered(old[1]);
  say(description());
  say(grant(1, 1));
  session->job_ready(JobId{1}, now, actions);
  rendered(asked<RenderTile>().at(0));
  EXPECT_EQ(said<WorkerResult>().size(), 1u) << "the new farm's";
}

TEST_F(SessionTest, UnacknowledgedBytesAreBounded) {
  SessionConfig config;
  config.unacknowledged_bytes = 2 * 24 * sizeof(float);
  restart(config);
  begin(20);
  std::size_t done = 0;
  while (done < asked<RenderTile>().size()) {
    rendered(asked<RenderTile>()[done++]);
  }
  EXPECT_EQ(done, 5u);  // 4 out at first, and one more when the first result came. Then the bound was reached
  say(ack(said<WorkerResult>()[0]));
  say(ack(said<WorkerResult>()[1]));
  EXPECT_EQ(asked<RenderTile>().size(), 5u);
  say(ack(said<WorkerResult>()[2]));
  say(ack(said<WorkerResult>()[3]));
  EXPECT_GT(asked<RenderTile>().size(), 5u);
}

TEST_F(SessionTest, ACancelledLeaseStopsRendering) {
  begin(10);
  const std::vector<RenderTile> out = asked<RenderTile>();
  say(LeaseCancel{{LeaseId{1}}});
  std::vector<std::uint64_t> stopped;
  for (const StopTile& stop : asked<StopTile>()) {
    stopped.push_back(stop.ticket);
  }
  EXPECT_EQ(stopped, (std::vector<std::uint64_t>{out[0].ticket, out[1].ticket, out[2].ticket, out[3].ticket}));
  actions.clear();
  rendered(out[0]);  // done before its thread noticed
  for (std::size_t i = 1; i < out.size(); ++i) {
    session->tile_rendered({.ticket = out[i].ticket, .node = {}, .hash = {}, .seconds = 1}, now, actions);
  }
  EXPECT_TRUE(asked<RenderTile>().empty());
  EXPECT_TRUE(said<WorkerResult>().empty());
  EXPECT_EQ(session->status().leases, 0u);
}

TEST_F(SessionTest, AStoppedTileIsRenderedAgainWhenLeasedAgain) {
  begin(1);
  const RenderTile first = asked<RenderTile>().at(0);
  say(LeaseCancel{{LeaseId{1}}});
  actions.clear();
  say(description());
  say(grant(2, 1));
  session->job_ready(JobId{1}, now, actions);
  ASSERT_EQ(asked<RenderTile>().size(), 1u);
  session->tile_rendered({.ticket = first.ticket, .node = {}, .hash = {}, .seconds = 1}, now, actions);
  EXPECT_TRUE(said<WorkerResult>().empty());
  rendered(asked<RenderTile>()[0]);
  EXPECT_EQ(said<WorkerResult>().size(), 1u);
}

TEST_F(SessionTest, ARunningTileThatIsLeasedAgainIsRenderedOnce) {
  begin(2);
  say(grant(2, 2));  // the first lease was taken for lost; its cancellation comes later
  say(LeaseCancel{{LeaseId{1}}});
  EXPECT_TRUE(asked<StopTile>().empty());
  const std::vector<RenderTile> out = asked<RenderTile>();
  ASSERT_EQ(out.size(), 2u);
  rendered(out[0]);
  rendered(out[1]);
  ASSERT_EQ(said<WorkerResult>().size(), 2u);
  EXPECT_EQ(said<WorkerResult>()[0].lease, LeaseId{2});
}

TEST_F(SessionTest, AnInspectionIsReadAndReportedOnce) {
  connect();
  EXPECT_TRUE(said<WorkerHello>().at(0).inspects);
  const InspectGrant grant{InspectionId{3}, std::make_shared<const InspectionRequest>()};
  say(grant);
  say(grant);  // a repeated message
  ASSERT_EQ(asked<RunInspection>().size(), 1u);
  session->inspection_done({InspectionId{2}, std::make_shared<const Inspection>()}, actions);
  EXPECT_TRUE(said<InspectReport>().empty()) << "not what was asked for";
  session->inspection_done({InspectionId{3}, std::make_shared<const Inspection>()}, actions);
  session->inspection_done({InspectionId{3}, std::make_shared<const Inspection>()}, actions);
  ASSERT_EQ(said<InspectReport>().size(), 1u);
  EXPECT_EQ(said<InspectReport>()[0].inspection, InspectionId{3});
}

TEST_F(SessionTest, AnInspectionIsDroppedWithItsStreamAndByADrain) {
  connect();
  say(InspectGrant{InspectionId{3}, std::make_shared<const InspectionRequest>()});
  session->disconnected(now, actions);
  EXPECT_EQ(asked<DropInspection>().size(), 1u);
  session->inspection_done({InspectionId{3}, std::make_shared<const Inspection>()}, actions);
  EXPECT_TRUE(said<InspectReport>().empty());
  pass(std::chrono::seconds(1));
  session->connected(now, actions);
  say(Welcome{1, std::chrono::seconds(2), std::chrono::seconds(10)});
  say(InspectGrant{InspectionId{4}, std::make_shared<const InspectionRequest>()});
  EXPECT_EQ(asked<RunInspection>().size(), 2u);
  say(DrainRequest{});
  EXPECT_EQ(asked<DropInspection>().size(), 2u);
  EXPECT_EQ(asked<Exit>().size(), 1u) << "it does not wait for what another worker will read";
}

TEST_F(SessionTest, APilotIsRunReportedAndForgotten) {
  connect();
  say(PilotGrant{LeaseId{5}, JobId{1}, {}, {"path", "ao"}});
  say(PilotGrant{LeaseId{5}, JobId{1}, {}, {"path", "ao"}});  // a repeated message
  ASSERT_EQ(asked<RunPilot>().size(), 1u);
  EXPECT_EQ(asked<RunPilot>()[0].grant->methods.size(), 2u);
  EXPECT_EQ(session->status().leases, 1u);
  pass(std::chrono::seconds(2));
  EXPECT_EQ(said<WorkerHeartbeat>().back().leases, std::vector<LeaseId>{LeaseId{5}});
  session->pilot_done({LeaseId{5}, 1, {"cheaper"}, 0.5}, now, actions);
  session->pilot_done({LeaseId{5}, 1, {"cheaper"}, 0.5}, now, actions);
  ASSERT_EQ(said<PilotReport>().size(), 1u);
  EXPECT_EQ(said<PilotReport>()[0].choice, 1u);
  EXPECT_EQ(session->status().leases, 0u);
}

TEST_F(SessionTest, APilotEndsWithItsStream) {
  connect();
  say(PilotGrant{LeaseId{5}, JobId{1}, {}, {"path", "ao"}});
  session->disconnected(now, actions);
  ASSERT_EQ(asked<DropPilot>().size(), 1u);
  EXPECT_EQ(asked<DropPilot>()[0].lease, LeaseId{5});
  session->pilot_done({LeaseId{5}, 1, {}, 0}, now, actions);
  session->connected(now, actions);
  EXPECT_TRUE(said<WorkerHello>().back().held.empty());
  EXPECT_TRUE(said<PilotReport>().empty());
}

TEST_F(SessionTest, APilotWithUnavailableAssetsIsRetried) {
  connect();
  say(PilotGrant{LeaseId{5}, JobId{1}, {}, {"path", "ao"}});
  session->pilot_unavailable(LeaseId{5}, now, actions);
  EXPECT_LE(*session->next_deadline(), now + std::chrono::seconds(1));
  pass(std::chrono::seconds(1));
  EXPECT_EQ(asked<RunPilot>().size(), 2u);
  session->pilot_failed(LeaseId{5}, {"damaged"}, now, actions);
  ASSERT_EQ(said<WorkerRefusal>().size(), 1u);
  EXPECT_EQ(said<WorkerRefusal>()[0].job, JobId{1});
  EXPECT_EQ(session->status().leases, 0u);
}

TEST_F(SessionTest, ACancelledPilotIsNotReported) {
  connect();
  say(PilotGrant{LeaseId{5}, JobId{1}, {}, {"path", "ao"}});
  say(LeaseCancel{{LeaseId{4}, LeaseId{5}, LeaseId{5}}});
  ASSERT_EQ(asked<DropPilot>().size(), 1u);
  EXPECT_EQ(asked<DropPilot>()[0].lease, LeaseId{5});
  session->pilot_done({LeaseId{5}, 1, {}, 0}, now, actions);
  EXPECT_TRUE(said<PilotReport>().empty());
}

TEST_F(SessionTest, ADrainGivesPilotsBackOrFinishesThem) {
  connect();
  say(PilotGrant{LeaseId{5}, JobId{1}, {}, {"path", "ao"}});
  say(DrainRequest{});
  EXPECT_TRUE(asked<Exit>().empty());
  say(PilotGrant{LeaseId{6}, JobId{2}, {}, {"path", "ao"}});
  ASSERT_EQ(said<WorkerReturn>().size(), 1u);
  EXPECT_EQ(said<WorkerReturn>()[0].lease, LeaseId{6});
  session->drain(now, actions);
  ASSERT_EQ(said<WorkerReturn>().size(), 2u);
  EXPECT_EQ(said<WorkerReturn>()[1].lease, LeaseId{5});
  EXPECT_EQ(asked<DropPilot>().size(), 1u);
  EXPECT_EQ(asked<Exit>().size(), 1u);
}

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
      << "it was sent again, and what waited before is of another connection";
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
  EXPECT_EQ(*session->next_deadline() - now, std::chrono::seconds(1)) << "another refusal begins anew";
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
  EXPECT_NE(asked<Exit>()[0].reason.find("1 tiles are dropped"), std::string::npos) << asked<Exit>()[0].reason;
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
  EXPECT_EQ(asked<LogNotice>()[0].text, "drain: finish what you have begun, and leave");
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

TEST_F(SessionTest, UnavailableAssetsAreRequestedAgain) {
  connect();
  say(description());
  say(grant(1, 1));
  session->job_unavailable(JobId{1}, now, actions);
  actions.clear();
  pass(std::chrono::seconds(1));
  EXPECT_EQ(asked<PrepareJob>().size(), 1u);
  session->job_ready(JobId{1}, now, actions);
  EXPECT_EQ(asked<RenderTile>().size(), 1u);
}

TEST_F(SessionTest, ASceneThatDoesNotCompileIsRefused) {
  connect();
  say(description());
  say(grant(1, 3));
  session->job_failed(JobId{1}, {"mesh 'floor' is empty"}, now, actions);
  ASSERT_EQ(said<WorkerRefusal>().size(), 1u);
  EXPECT_EQ(said<WorkerRefusal>()[0].reason, "mesh 'floor' is empty");
  EXPECT_EQ(session->status().leases, 0u);
}

TEST_F(SessionTest, ATileOutOfMemoryLeavesItsJobToOthers) {
  begin(10);
  say(description(2, "another job"));
  session->job_ready(JobId{2}, now, actions);
  say(grant(2, 10, 2));
  const std::vector<RenderTile> tiles = asked<RenderTile>();
  ASSERT_EQ(tiles.size(), 4u);  // 2 × threads, all of job 1
  actions.clear();
  RenderedTile failed{tiles[0].ticket, {}, {}, 0.01, "out of memory"};
  session->tile_rendered(failed, now, actions);
  ASSERT_EQ(said<WorkerRefusal>().size(), 1u);
  EXPECT_EQ(said<WorkerRefusal>()[0].job, JobId{1});
  EXPECT_EQ(said<WorkerRefusal>()[0].reason, "out of memory");
  EXPECT_TRUE(said<WorkerRefusal>()[0].own_limits);
  EXPECT_EQ(asked<ForgetJob>().size(), 1u);
  EXPECT_EQ(asked<StopTile>().size(), 3u) << "others of the job, too";
  // Another thread finds the same, which is reported once. Job 2 continues.
  for (std::size_t i = 1; i < tiles.size(); ++i) {
    failed.ticket = tiles[i].ticket;
    session->tile_rendered(failed, now, actions);
  }
  EXPECT_EQ(said<WorkerRefusal>().size(), 1u);
  EXPECT_EQ(session->status().leases, 1u);
  ASSERT_EQ(asked<RenderTile>().size(), 4u);
  EXPECT_EQ(asked<RenderTile>()[0].key.job, JobId{2});
  EXPECT_TRUE(said<WorkerResult>().empty());
  rendered(asked<RenderTile>()[0]);
  EXPECT_EQ(said<WorkerResult>().size(), 1u);
}

TEST_F(SessionTest, ALeaseOfAnUnknownJobIsGivenBack) {
  connect();
  say(grant(1, 3, 9));
  ASSERT_EQ(said<WorkerReturn>().size(), 1u);
}

TEST_F(SessionTest, TheSameJobNumberOfAnotherFarmIsAnotherJob) {
  begin(3);
  const std::vector<RenderTile> old = asked<RenderTile>();
  rendered(old[0]);
  session->disconnected(now, actions);
  come_back();
  actions.clear();
  say(description(1, "other digest"));
  say(grant(1, 3));
  session->job_ready(JobId{1}, now, actions);
  EXPECT_EQ(session->status().results_unacknowledged, 0u);
  rendered(old[1]);
  rendered(old[2]);
  EXPECT_TRUE(said<WorkerResult>().empty());
  const std::vector<RenderTile> fresh = asked<RenderTile>();
  ASSERT_EQ(fresh.size(), 3u);
  rendered(fresh[0]);
  ASSERT_EQ(said<WorkerResult>().size(), 1u);
  EXPECT_EQ(said<WorkerResult>()[0].render_digest, sha256("other digest"));
}

}  // namespace
}  // namespace lightmill
