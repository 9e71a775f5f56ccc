// Write speed of the stores: commits of nodes of a 64×64 tile (96 KiB), each with its result and the job's progress.
// Half of the nodes of the previous commit are deleted, as when siblings join.
//
//   store_bench --data DIR | --store postgres://… [--nodes N] [--commits N]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "common/base/check.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/bench/measure.h"

namespace {

using namespace lightmill;
using SteadyClock = std::chrono::steady_clock;

std::shared_ptr<const Node> node_of(std::uint32_t index) {
  auto node = std::make_shared<Node>();
  node->range = {0, index};
  std::uint32_t bits = index + 1;
  for (int i = 0; i < 64 * 64 * 6; ++i) {
    bits = bits * 1664525u + 1013904223u;
    node->values.push_back(static_cast<float>(bits >> 8) * 0x1p-24f);
  }
  return node;
}

Result<std::unique_ptr<Store>> open(const std::string& data, const std::string& url) {
  if (url.empty()) {
    return open_sqlite_store(std::filesystem::path(data) / "bench.sqlite");
  }
  PostgresOptions options;
  options.url = url;
  options.wait = [](std::chrono::milliseconds) { return false; };
  options.on_deposed = [](const Status& why) { LM_CHECK(false, "{}", message_of(why)); };
  LM_ASSIGN_OR_RETURN(PostgresStores stores, open_postgres(options));
  return std::move(stores.store);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Write speed of the stores."};
  std::string data, url;
  std::uint32_t nodes = 100, commits = 30;
  auto* where = app.add_option_group("where")->require_option(1);
  where->add_option("--data", data, "an empty folder")->check(CLI::ExistingDirectory);
  where->add_option("--store", url, "an empty database: postgres://USER@HOST/DATABASE");
  app.add_option("--nodes", nodes, "of a commit")->capture_default_str()->check(CLI::Range(1, 1024));
  app.add_option("--commits", commits)->capture_default_str()->check(CLI::Range(1, 100'000));
  CLI11_PARSE(app, argc, argv);

  const auto opened = open(data, url);
  if (!opened.ok()) {
    fmt::print(stderr, "store_bench: {}\n", message_of(opened.status()));
    return 2;
  }
  const std::unique_ptr<Store>& store = *opened;
  LM_CHECK(store->load().ok());
  JobRecord record;
  record.id = JobId{1};
  record.spec.request_id = "bench";
  RenderSettings& settings = record.spec.settings;  // a film with one tile per node
  settings.width = static_cast<int>(64 * nodes);
  settings.height = 64;
  settings.crop = {0, 0, settings.width, settings.height};
  LM_CHECK(store->commit(std::vector<StoreOp>{PutJob{record}}).ok());
  std::vector<double> seconds;
  double cpu = 0;
  for (std::uint32_t round = 0; round < commits; ++round) {
    std::vector<StoreOp> ops{PutProgress{record.id, 1, 1, {}}};
    for (std::uint32_t i = 0; i < nodes; ++i) {
      const TileId tile{i};
      const auto node = node_of(round * nodes + i);
      if (round > 0 && i % 2 == 0) {
        ops.push_back(DropNode{{record.id, tile, {0, (round - 1) * nodes + i}}});
      }
      ops.push_back(PutNode{record.id, tile, node});
      ops.push_back(PutResult{{record.id, tile, node->range}, {round, i}, {"worker", "machine"}});
    }
    const auto start = SteadyClock::now();
    const double cpu_before = thread_cpu_seconds();
    const Status status = store->commit(ops);
    LM_CHECK(status.ok(), "{}", message_of(status));
    cpu += thread_cpu_seconds() - cpu_before;
    seconds.push_back(std::chrono::duration<double>(SteadyClock::now() - start).count());
  }
  const double usual = median(seconds);
  std::printf(
      "%u nodes per commit: median %.1f ms (%.0f nodes/s), slowest %.1f ms; %.3f ms of CPU time (%.0f commits/s)\n",
      nodes, usual * 1e3, nodes / usual, *std::ranges::max_element(seconds) * 1e3, cpu / commits * 1e3, commits / cpu);
  const auto start = SteadyClock::now();
  const double cpu_before = thread_cpu_seconds();
  const Result<StoredState> state = store->load();
  LM_CHECK(state.ok(), "{}", message_of(state.status()));
  std::printf("%zu nodes loaded in %.0f ms, %.0f ms of CPU time\n", state->jobs.at(0).nodes.size(),
              std::chrono::duration<double>(SteadyClock::now() - start).count() * 1e3,
              (thread_cpu_seconds() - cpu_before) * 1e3);
  return 0;
}
