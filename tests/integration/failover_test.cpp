// Coordinators that share a PostgreSQL database: one active, one standby.
#include <gtest/gtest.h>
#include <signal.h>

#include "common/base/file.h"
#include "tests/integration/health.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"
#include "tests/support/postgres_server.h"
#include "tests/support/reserved_port.h"

namespace lightmill::test {
namespace {

const std::uint64_t kPixelSamples = std::uint64_t{128} * 128 * Picture().samples;
/// Anything slower hangs.
constexpr std::chrono::minutes kHang{2};

PostgresServer& server() {
  static PostgresServer one;
  return one;
}

/// Two coordinators on one database, and a worker with both addresses.
class TwoCoordinators {
 public:
  TwoCoordinators() {
    first = start(0);
    EXPECT_TRUE(eventually([&] { return says(0, "listening on"); })) << log(0);
    second = start(1);
    EXPECT_TRUE(eventually([&] { return says(1, "on standby"); })) << log(1);
    worker_ = std::make_unique<BackgroundProcess>(
        std::vector<std::string>{program("lightmill-worker"), "--server", address(0) + "," + address(1), "--threads",
                                 "2", "--name", "w"},
        (folder_.path() / "worker.log").string());
  }

  std::unique_ptr<BackgroundProcess> start(int index) {
    return std::make_unique<BackgroundProcess>(
        std::vector<std::string>{program("lightmill-server"), "--store", url_, "--listen", address(index), "--health",
                                 "127.0.0.1:0", "--health-port-file", port_file(index)},
        log_file(index));
  }
  std::string health_of(int index, const std::string& service = "") const {
    return health(health_address(port_file(index)), service);
  }
  std::string sql(const std::string& statement) const { return run_sql(url_, statement); }
  std::string address(int index) const {
    return fmt::format("127.0.0.1:{}", ports_[static_cast<std::size_t>(index)].number());
  }
  std::string log(int index) const { return read_file(log_file(index)).value(); }
  bool says(int index, const std::string& words) const { return log(index).find(words) != std::string::npos; }

  std::unique_ptr<BackgroundProcess> first, second;

 private:
  std::string port_file(int index) const { return (folder_.path() / fmt::format("health{}", index)).string(); }
  std::string log_file(int index) const { return (folder_.path() / fmt::format("server{}.log", index)).string(); }

  TemporaryFolder folder_;
  std::string url_ = server().new_database();
  std::array<ReservedPort, 2> ports_;
  std::unique_ptr<BackgroundProcess> worker_;
};

TEST(SharedDatabase, TwoKillsOfTheCoordinatorKeepTheBits) {
  Farm farm({"--store", server().new_database()});
  farm.add_worker(2, "w1");
  FarmClient client = farm.client();
  Picture picture;
  const std::uint64_t job = client.submit(picture).id();
  for (int i = 0; i < 2; ++i) {
    client.wait_while_it_works(job, picture, kPixelSamples / 4);
    kill_at_once(farm.server());
    farm.start_server();
  }
  expect_reference_film(farm.client(), job, picture);
}

TEST(SharedDatabase, AFarmSurvivesACrashOfItsDatabase) {
  const TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  Farm farm({"--store", server().new_database(), "--health", "127.0.0.1:0", "--health-port-file", port_file});
  farm.add_worker(2, "w1");
  FarmClient client = farm.client();
  Picture picture{.samples = 172};
  const std::uint64_t job = client.submit(picture).id();
  client.wait_while_it_works(job, picture, kPixelSamples / 4);
  server().stop();
  EXPECT_TRUE(eventually([&] { return farm.server_log().find("cannot store progress") != std::string::npos; }));
  const std::string probed = health_address(port_file);
  EXPECT_TRUE(eventually([&] { return health(probed) == "NOT_SERVING"; })) << "it accepts no jobs";
  EXPECT_EQ(health(farm.address()), "NOT_SERVING");
  EXPECT_EQ(health(probed, "live"), "SERVING") << "a restart would not help";
  server().start();
  expect_reference_film(farm.client(), job, picture);
  EXPECT_TRUE(eventually([&] { return health(probed) == "SERVING"; }));
}

TEST(SharedDatabase, AStandbyTakesOverFromAKilledCoordinator) {
  TwoCoordinators both;
  // The longest time until a takeover.
  EXPECT_LE(std::stod(both.sql("SELECT extract(epoch FROM expires - clock_timestamp()) FROM lightmill.lease")), 2.5);
  FarmClient to_first(both.address(0)), to_second(both.address(1));
  EXPECT_EQ(both.health_of(0), "SERVING");
  EXPECT_EQ(both.health_of(1), "NOT_SERVING") << "every caller is redirected to the first";
  EXPECT_EQ(both.health_of(1, "live"), "SERVING");
  const std::uint64_t job = to_first.submit(Picture()).id();
  to_first.wait_for_samples(job, kPixelSamples / 4);
  kill_at_once(*both.first);
  EXPECT_TRUE(eventually([&] { return both.says(1, "listening on"); })) << both.log(1);
  EXPECT_TRUE(eventually([&] { return both.health_of(1) == "SERVING"; }));
  expect_reference_film(FarmClient(both.address(1)), job);
}

TEST(SharedDatabase, AStoppedCoordinatorIsReplacedAndDoesNoHarmWhenItResumes) {
  TwoCoordinators both;
  FarmClient to_first(both.address(0));
  const std::uint64_t job = to_first.submit(Picture()).id();
  to_first.wait_for_samples(job, kPixelSamples / 4);
  both.first->send(SIGSTOP);
  EXPECT_TRUE(eventually([&] { return both.says(1, "listening on"); })) << both.log(1);
  FarmClient to_second(both.address(1));
  to_second.wait_for_samples(job, kPixelSamples / 2);
  both.first->send(SIGCONT);
  EXPECT_EQ(both.first->wait(kHang), 1) << both.log(0);
  EXPECT_TRUE(both.says(0, "taken over")) << both.log(0);
  // After a restart it is the standby, and later takes over again.
  both.first = both.start(0);
  EXPECT_TRUE(eventually([&] { return both.says(0, "on standby"); })) << both.log(0);
  expect_reference_film(FarmClient(both.address(1)), job);
  both.second->send(SIGTERM);
  EXPECT_EQ(both.second->wait(kHang), 0) << both.log(1);
  expect_reference_film(FarmClient(both.address(0)), job);
}

TEST(SharedDatabase, ClientsAndWorkersWithBothAddressesResume) {
  TwoCoordinators both;
  const TemporaryFolder folder;
  Picture shown;
  const std::string picture = (folder.path() / "picture.exr").string(), log = (folder.path() / "log").string();
  BackgroundProcess render({program("lightmill"), "render", source_file("scenes/cornell-bench-blocks.json"), "--size",
                            "128x128", "--spp", std::to_string(shown.samples), "--seed", "7", "--method", "path",
                            "--server", both.address(0) + "," + both.address(1), "-o", picture},
                           log);
  FarmClient to_first(both.address(0));
  const auto submitted = [&] {
    grpc::ClientContext context;
    v1::GetJobRequest request;
    request.set_id(1);
    v1::Job job;
    return to_first.stub().GetJob(&context, request, &job).ok();
  };
  EXPECT_TRUE(eventually(submitted)) << read_file(log).value();
  to_first.wait_while_it_works(1, shown, kPixelSamples / 20);
  both.first->send(SIGSTOP);
  EXPECT_EQ(render.wait(kHang), 0) << read_file(log).value();
  EXPECT_TRUE(std::filesystem::exists(picture));
  expect_reference_film(FarmClient(both.address(1)), 1, shown);
}

TEST(Backup, ARestoredDumpFinishesWithTheSameBits) {
  const Picture picture, small{.side = 64, .samples = 16};
  const std::string url = server().new_database();
  std::string restored_url;
  std::uint64_t job = 0, ended = 0;
  {
    Farm farm({"--store", url});
    farm.add_worker(1, "w1");
    ended = farm.client().submit(small, "ended").id();
    expect_reference_film(farm.client(), ended, small);
    job = farm.client().submit(picture).id();
    farm.client().wait_for_samples(job, kPixelSamples / 4);
    restored_url = server().dumped_and_restored(url);  // while the coordinator works
  }
  CommandResult check;
  EXPECT_TRUE(eventually([&] {  // when the lease in it has expired
    check = run_command({program("lightmill-server"), "check", "--store", restored_url});
    return check.exit_code == 0;
  })) << check.out
      << check.err;
  Farm restored({"--store", restored_url});
  expect_reference_film(restored.client(), ended, small);
  EXPECT_GT(restored.client().job(job).samples_done(), 0u);  // clients may have seen more than is stored
  restored.add_worker(1, "w2");
  expect_reference_film(restored.client(), job, picture);
}

}  // namespace
}  // namespace lightmill::test
