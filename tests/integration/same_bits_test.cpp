// A farm of real processes gives the same film through any failure.
#include <gtest/gtest.h>

#include <regex>

#include "tests/support/farm.h"

namespace lightmill::test {
namespace {

const Picture kPicture;
const std::uint64_t kPixelSamples = std::uint64_t{128} * 128 * kPicture.samples;

/// Work of all workers according to their logs, by tile: first sample → end.
struct Rendered {
  std::map<int, std::map<std::uint64_t, std::uint64_t>> by_tile;
  std::uint64_t again = 0;  ///< samples per pixel that a thread got more than once
};
Rendered rendered_by(const Farm& farm, const std::vector<std::string>& workers) {
  Rendered rendered;
  std::map<int, std::set<std::uint64_t>> seen;
  const std::regex line(R"(samples \[(\d+), (\d+)\), tile (\d+) is to be rendered)");
  for (const std::string& worker : workers) {
    const std::string log = farm.worker_log(worker);
    for (auto at = std::sregex_iterator(log.begin(), log.end(), line); at != std::sregex_iterator(); ++at) {
      const int tile = std::stoi((*at)[3]);
      for (std::uint64_t sample = std::stoull((*at)[1]); sample < std::stoull((*at)[2]); ++sample) {
        rendered.again += seen[tile].insert(sample).second ? 0 : 1;
      }
      rendered.by_tile[tile][std::stoull((*at)[1])] = std::stoull((*at)[2]);
    }
  }
  EXPECT_EQ(rendered.by_tile.size(), 4u) << "the logs do not name all rendered tiles";
  return rendered;
}

TEST(SameBits, OneWorkerGivesTheReferenceFilm) {
  Farm farm;
  farm.add_worker(1, "w1");
  expect_reference_film(farm.client(), farm.client().submit(kPicture).id());
}

TEST(SameBits, ThreeWorkersGiveTheReferenceFilm) {
  Farm farm;
  for (const char* name : {"w1", "w2", "w3"}) {
    farm.add_worker(2, name);
  }
  expect_reference_film(farm.client(), farm.client().submit(kPicture).id());
}

TEST(SameBits, EveryOtherMethodKeepsItsBitsOnFarmsOfBothSizes) {
  Farm one, four;
  one.add_worker(1, "w1");
  four.add_worker(2, "w1");
  four.add_worker(2, "w2");
  for (const char* method : {"raycast", "whitted", "ao", "preview"}) {
    SCOPED_TRACE(method);
    const Picture picture{.side = 96, .samples = 21, .method = method, .scene = "cornell-bench-balls"};
    const std::uint64_t on_one = one.client().submit(picture, method).id();
    const std::uint64_t on_four = four.client().submit(picture, method).id();
    expect_reference_film(one.client(), on_one, picture);
    expect_reference_film(four.client(), on_four, picture);
  }
}

TEST(SameBits, TheLengthOfUnitsDoesNotChangeTheBits) {
  // 1 MiB/s of results: at least half a second per range.
  const std::array<std::vector<std::string>, 3> options{
      {{"--unit-seconds", "0.05"}, {"--unit-seconds", "60"}, {"--results-rate", "1"}}};
  std::vector<std::uint64_t> results;
  for (const std::vector<std::string>& of_farm : options) {
    Farm farm(of_farm);
    farm.add_worker(2, "w1");
    farm.add_worker(2, "w2");
    const Picture picture{.samples = 172};
    const std::uint64_t job = farm.client().submit(picture).id();
    expect_reference_film(farm.client(), job, picture);
    results.push_back(farm.client().job(job).counters().results_merged());
  }
  // The lengths differed. By how much depends on the machine's speed.
  EXPECT_LT(results[1], results[0]);
  EXPECT_LT(results[2], results[0]);
}

TEST(SameBits, FourKilledWorkersKeepTheBits) {
  Farm farm({"--unit-seconds", "0.3"});
  for (const char* name : {"w1", "w2", "w3"}) {
    farm.add_worker(2, name);
  }
  Picture picture = kPicture;
  const std::uint64_t job = farm.client().submit(picture).id();
  kill_workers(farm, job, picture, kPixelSamples / 4, 4);
  expect_reference_film(farm.client(), job, picture);
}

TEST(SameBits, TwoKillsOfTheCoordinatorKeepTheBits) {
  Farm farm({"--return-seconds", "10"});
  farm.add_worker(2, "w1");
  farm.add_worker(2, "w2");
  Picture picture = kPicture;
  const std::uint64_t job = farm.client().submit(picture).id();
  for (int i = 0; i < 2; ++i) {
    farm.client().wait_while_it_works(job, picture, kPixelSamples / 4);
    const std::array met{farm.times_met("w1"), farm.times_met("w2")};
    kill_at_once(farm.server());
    farm.start_server();
    EXPECT_TRUE(eventually([&] { return farm.times_met("w1") > met[0] && farm.times_met("w2") > met[1]; }));
  }
  expect_reference_film(farm.client(), job, picture);
  // The workers kept their results, so nothing was rendered again except copies near the end.
  const v1::Job ended = farm.client().job(job);
  EXPECT_EQ(ended.counters().leases_lost(), 0u);
  const Rendered rendered = rendered_by(farm, {"w1", "w2"});
  if (ended.counters().copies_leased() == 0) {
    EXPECT_EQ(rendered.again, 0u);
  }
}

TEST(SameBits, AnExtendedJobHasTheSameBits) {
  Farm farm;
  farm.add_worker(2, "w1");
  FarmClient client = farm.client();
  Picture picture = kPicture;
  picture.samples = 50;
  const std::uint64_t job = client.submit(picture).id();
  expect_reference_film(farm.client(), job, picture);
  client.extend(job, kPicture.samples);
  expect_reference_film(farm.client(), job);
  EXPECT_EQ(rendered_by(farm, {"w1"}).again, 0u) << "the first fifty are not rendered again";
}

/// Renders a picture with an error goal on a farm of this size. Returns its number of samples.
std::uint64_t samples_to_an_error(int workers, int threads) {
  Farm farm;
  for (int i = 1; i <= workers; ++i) {
    farm.add_worker(threads, fmt::format("w{}", i));
  }
  Picture picture = kPicture;
  picture.samples = 0;
  picture.error = 0.001;
  const std::uint64_t job = farm.client().submit(picture).id();
  const v1::Job ended = farm.client().wait_until_ended(job);
  EXPECT_EQ(ended.reached(), v1::GOAL_LIMIT_ERROR) << ended.ShortDebugString();
  EXPECT_LE(ended.error().rel_mse() + ended.error().half_width(), 0.001);
  picture.samples = ended.min_tile_samples();
  expect_reference_film(farm.client(), job, picture);
  return picture.samples;
}

TEST(SameBits, AnErrorIsReachedWithTheSameSamplesOnAnyFarm) {
  const std::uint64_t alone = samples_to_an_error(1, 1);
  EXPECT_GT(alone, 16u) << "it takes several readings";
  EXPECT_EQ(samples_to_an_error(3, 2), alone);
}

TEST(WorkerDeath, RepeatsOnlyUnacknowledgedUnits) {
  Farm farm;
  farm.add_worker(2, "dies");
  farm.add_worker(2, "lives");
  FarmClient client = farm.client();
  Picture picture = kPicture;
  const std::uint64_t job = client.submit(picture).id();
  client.wait_while_it_works(job, picture, kPixelSamples / 3);
  kill_at_once(farm.worker("dies"));
  expect_reference_film(farm.client(), job, picture);
  const v1::Job ended = client.job(job);
  // A result rendered again after it was merged would arrive as a duplicate.
  EXPECT_LE(ended.counters().results_duplicate(), ended.counters().copies_leased());
  EXPECT_LE(ended.counters().leases_lost(), 4u)
      << "two leases, or one a thread and another ahead where units are small";
}

TEST(Drain, AWorkerFinishesItsUnitsAndLeaves) {
  Farm farm;
  farm.add_worker(2, "leaves");
  farm.add_worker(2, "stays");
  FarmClient client = farm.client();
  const std::uint64_t job = client.submit(kPicture).id();
  client.wait_for_samples(job, kPixelSamples / 4);
  farm.worker("leaves").send(SIGTERM);
  EXPECT_EQ(farm.worker("leaves").wait(), 0);
  expect_reference_film(farm.client(), job);
  EXPECT_EQ(client.job(job).counters().leases_lost(), 0u);
  EXPECT_LE(client.job(job).counters().results_duplicate(), client.job(job).counters().copies_leased());
}

TEST(Stop, ACoordinatorStopsCleanlyAndResumesLater) {
  Farm farm;
  farm.add_worker(2, "w1");
  FarmClient client = farm.client();
  const std::uint64_t job = client.submit(kPicture).id();
  client.wait_for_samples(job, kPixelSamples / 4);
  farm.server().send(SIGTERM);
  EXPECT_EQ(farm.server().wait(), 0) << farm.server_log();
  farm.start_server();
  expect_reference_film(farm.client(), job);
}

}  // namespace
}  // namespace lightmill::test
