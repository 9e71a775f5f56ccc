// Live messages over real sockets, and jobs that belong to a page.
#include "tests/integration/live_page.h"

namespace lightmill::test {
namespace {

/// The answer to a job that a page submits.
Response submit_for(WebFarm& web, const std::string& page, const std::string& request_id) {
  return web.post("/api/v1/jobs?page=" + page, submit_body(job_of(small_picture(1'000'000), request_id)));
}

void name(Page& page, const std::string& name) {
  v1::ViewRequest request;
  request.set_page(name);
  page.send(request.SerializeAsString());
  EXPECT_FALSE(page.read().greeting().version().empty()) << "then the coordinator knows it";
}

TEST(Web, JobsOfAPageEndWithItsLastConnection) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t kept = client.submit(small_picture(), "kept").id();
  EXPECT_EQ(submit_for(web, "unknown", "early").result_int(), 409u) << "no connection has named this page";
  EXPECT_EQ(client.jobs(), std::vector{kept});
  auto page = std::make_unique<Page>(web), other = std::make_unique<Page>(web);
  name(*page, "a-page");
  name(*other, "b-page");
  EXPECT_EQ(submit_for(web, "a-page", "first").result_int(), 200u);
  EXPECT_EQ(submit_for(web, "b-page", "second").result_int(), 200u);
  const std::vector<std::uint64_t> all = client.jobs();
  ASSERT_EQ(all.size(), 3u);
  page.reset();  // like a killed program: it says nothing
  EXPECT_TRUE(eventually([&] { return client.jobs() == std::vector{all[0], kept}; }));
  other.reset();
  EXPECT_TRUE(eventually([&] { return client.jobs() == std::vector{kept}; }));
}

TEST(Web, JobsOfAPageEndWithTheirCoordinator) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t kept = client.submit(small_picture(), "kept").id();
  Page page(web);
  name(page, "a-page");
  EXPECT_EQ(submit_for(web, "a-page", "first").result_int(), 200u);
  EXPECT_EQ(client.jobs().size(), 2u);
  web.restart();
  FarmClient again = web.farm().client();
  EXPECT_TRUE(eventually([&] { return again.jobs() == std::vector{kept}; }));
}

TEST(Web, APageGetsTilesAsTheyChangeAndCatchesUpAfterADisconnection) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t job = client.submit(small_picture()).id();
  web.farm().add_worker(1, "w");
  std::map<std::pair<int, int>, v1::ViewTile> tiles;
  const auto watch = [&](Page& page) {
    page.ask(job);
    page.follow(job, [&](const v1::ViewUpdate& update) {
      for (const v1::ViewTile& tile : update.tiles()) {
        tiles[{tile.rect().x(), tile.rect().y()}] = tile;
      }
      return tiles.size() == 4 &&
             std::ranges::all_of(tiles, [](const auto& entry) { return entry.second.samples() == 8; });
    });
  };
  Page page(web);
  watch(page);
  client.wait_until_ended(job);
  tiles.clear();
  Page again(web);
  watch(again);
  ASSERT_EQ(tiles.size(), 4u);
  const FilmPlanes film = client.film(job);
  for (const auto& [corner, tile] : tiles) {
    EXPECT_EQ(tile.samples(), 8u);
    EXPECT_EQ(tile.rgbe().size(), 8u * static_cast<std::size_t>(tile.rect().width() * tile.rect().height()));
  }
  EXPECT_EQ(tiles.at({64, 64}).rect().width(), 32);
}

TEST(Web, AnEndedJobIsShownAndExtendedFromTheStore) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  Picture picture = small_picture();
  const std::uint64_t job = client.submit(picture).id();
  web.farm().add_worker(1, "w");
  client.wait_until_ended(job);
  const std::string path = "/api/v1/jobs/" + std::to_string(job);
  const std::string thumbnail = web.get(path + "/thumbnail.png").body(), meters = web.get(path + "/meters").body();
  web.restart();
  EXPECT_EQ(web.get(path + "/thumbnail.png").body(), thumbnail);
  web.restart();
  EXPECT_EQ(web.get(path + "/meters").body(), meters);
  web.restart();
  EXPECT_EQ(web.get(path + "/picture.png").body().substr(1, 3), "PNG");
  web.restart();
  {
    Page page(web);
    page.ask(job);
    std::set<std::pair<int, int>> tiles;
    page.follow(job, [&](const v1::ViewUpdate& update) {
      for (const v1::ViewTile& tile : update.tiles()) {
        tiles.insert({tile.rect().x(), tile.rect().y()});
      }
      return tiles.size() == 4;
    });
  }
  web.restart();
  picture.samples += 5;
  EXPECT_EQ(web.post(path + "/extend", fmt::format("{{\"samples\": \"{}\"}}", picture.samples)).result_int(), 200u);
  expect_reference_film(web.farm().client(), job, picture);
}

TEST(Web, APageThatAcknowledgesNothingGetsTwoMessages) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t job = client.submit(small_picture(100'000)).id();
  web.farm().add_worker(1, "w");
  client.wait_for_samples(job, 96 * 96);
  Page slow(web);
  slow.ask(job, 0);
  slow.read();
  slow.read();
  Page quick(web);
  quick.ask(job);
  std::uint64_t seen = 0;
  quick.follow(job, [&](const v1::ViewUpdate& update) {
    seen = std::max(seen, update.job().samples_done());
    return quick.received == 10;
  });
  slow.ask(job);
  v1::ViewUpdate newest = slow.read();
  while (!newest.has_job()) {
    slow.ask(job);
    newest = slow.read();
  }
  EXPECT_LT(slow.received, 10u) << "nothing was queued";
  EXPECT_GE(newest.job().samples_done(), seen);
  EXPECT_GT(seen, 0u);
}

}  // namespace
}  // namespace lightmill::test
