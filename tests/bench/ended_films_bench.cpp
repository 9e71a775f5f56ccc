// A coordinator with many ended jobs: its time to start, its memory, and the time to serve their films.
//
//   ended_films_bench --data DIR [--jobs N] [--side PIXELS] [--films-gib GIB] [--server PROGRAM]
//
// Fills an empty DIR with done jobs that have one node per tile. A second run uses the existing data.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "common/base/check.h"
#include "server/store/data_folder.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"

namespace {

using namespace lightmill;
namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

constexpr std::uint32_t kLevel = 6;  // 64 samples

double seconds_since(SteadyClock::time_point start) {
  return std::chrono::duration<double>(SteadyClock::now() - start).count();
}

void add_job(Store& store, std::uint64_t id, int side) {
  test::Picture picture;
  picture.side = side;
  picture.samples = std::uint64_t{1} << kLevel;
  JobRecord record;
  record.id = JobId{id};
  record.spec = test::job_of(picture, fmt::format("ended {}", id));
  record.state = JobState::done;
  record.reached = GoalLimit::samples;
  record.fingerprint_class = "bench";
  const TileGrid grid(record.spec.settings.crop);
  std::vector<StoreOp> ops{PutJob{record}};
  for (TileId tile{0}; tile.value < grid.tile_count(); ++tile.value) {
    auto node = std::make_shared<Node>();
    node->range = {kLevel, 0};
    node->values.assign(static_cast<std::size_t>(grid.tile_rect(tile).pixel_count()) * 6,
                        static_cast<float>(id + tile.value));
    ops.push_back(PutResult{{record.id, tile, node->range}, hash_of(*node), {"worker", "machine"}});
    ops.push_back(PutNode{record.id, tile, std::move(node)});
  }
  const Status status = store.commit(ops);
  LM_CHECK(status.ok(), "{}", message_of(status));
}

/// A line of /proc/PID/status, in MiB.
double mib_of(pid_t pid, const std::string& name) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string word; status >> word;) {
    if (word == name) {
      double kib = 0;
      status >> kib;
      return kib / 1024;
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Time and memory of a coordinator with many ended jobs."};
  std::string data, server = test::program("lightmill-server");
  std::uint64_t jobs = 200;
  int side = 512;
  std::string films_gib = "8";
  app.add_option("--data", data, "a folder for the coordinator's state")->required();
  app.add_option("--jobs", jobs)->capture_default_str()->check(CLI::Range(1, 10'000));
  app.add_option("--side", side, "width and height of a film in pixels")
      ->capture_default_str()
      ->check(CLI::Range(1, 16'384));
  app.add_option("--films-gib", films_gib, "the coordinator's --films-gib")->capture_default_str();
  app.add_option("--server", server, "another build of the coordinator");
  CLI11_PARSE(app, argc, argv);

  fs::create_directories(data);
  const fs::path file = DataFolder::database_file_of(data);
  if (!fs::exists(file)) {
    const std::unique_ptr<Store> store = open_sqlite_store(file).value();
    LM_CHECK(store->load().ok());
    for (std::uint64_t id = 1; id <= jobs; ++id) {
      add_job(*store, id, side);
    }
  }
  const fs::path port_file = fs::path(data) / "port";
  fs::remove(port_file);
  const auto start = SteadyClock::now();
  test::BackgroundProcess process({server, "--data", data, "--listen", "127.0.0.1:0", "--port-file", port_file.string(),
                                   "--keep-days", "0", "--films-gib", films_gib},
                                  (fs::path(data) / "server.log").string());
  LM_CHECK(test::eventually([&] { return fs::exists(port_file); }), "the coordinator does not start");
  std::printf("started in %.2f s, with %.0f MiB\n", seconds_since(start), mib_of(process.pid(), "VmRSS:"));

  std::string port;
  std::ifstream(port_file) >> port;
  test::FarmClient client("127.0.0.1:" + port);
  double slowest = 0;
  const auto fetch = SteadyClock::now();
  for (std::uint64_t id = 1; id <= jobs; ++id) {
    const auto begun = SteadyClock::now();
    LM_CHECK(client.film(id).mean_a.at(0) > 0);
    slowest = std::max(slowest, seconds_since(begun));
  }
  std::printf("%.1f ms per film, the slowest %.1f ms; then %.0f MiB, peak %.0f MiB\n",
              seconds_since(fetch) / static_cast<double>(jobs) * 1e3, slowest * 1e3, mib_of(process.pid(), "VmRSS:"),
              mib_of(process.pid(), "VmHWM:"));
  return 0;
}
