// Leases, jobs, tiles and results of a worker's session.
#include "tests/unit/worker/session_fixture.h"

namespace lightmill {
namespace {

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

TEST_F(SessionTest, WorkUnderAnotherNameIsDropped) {
  const auto come_back_as = [&](const char* name) {
    session->connected(now, actions);
    say(Welcome{1, std::chrono::seconds(2), std::chrono::seconds(10), {1, 1}, name});
  };
  session->start(now, actions);
  come_back_as("ada/w1");
  say(description());
  session->job_ready(JobId{1}, now, actions);
  say(grant(1, 3));
  rendered(asked<RenderTile>()[0]);
  session->disconnected(now, actions);
  actions.clear();
  come_back_as("ada/w1");
  EXPECT_EQ(said<WorkerResult>().size(), 1u);
  session->disconnected(now, actions);
  actions.clear();
  come_back_as("bob/w1");
  EXPECT_TRUE(said<WorkerResult>().empty());
  EXPECT_EQ(session->status().results_unacknowledged, 0u);
  EXPECT_EQ(session->status().leases, 0u);
  EXPECT_EQ(asked<StopTile>().size(), 2u);
  // It takes work under its new name.
  say(description());
  session->job_ready(JobId{1}, now, actions);
  say(grant(2, 1));
  EXPECT_EQ(asked<RenderTile>().size(), 1u);
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
  EXPECT_TRUE(said<InspectReport>().empty()) << "that inspection was not requested";
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
  EXPECT_EQ(asked<Exit>().size(), 1u) << "another worker will do this inspection";
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
  ASSERT_EQ(asked<LogNotice>().size(), 1u);
  EXPECT_EQ(asked<LogNotice>()[0].text, describe(tiles[0].key) + " cannot be rendered: out of memory");
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
