// A farm over real store files: a coordinator, two workers that render at once, and a client that sends assets again.
//
// Starts as a coordinator's process does, and is killed by being destroyed. The files are what StoredFarm leaves: the
// SQLite database with its journal and its chain, and the folder of assets. Not thread-safe.
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/domain/coordinator.h"
#include "server/store/asset_store.h"
#include "server/store/store.h"
#include "tests/simulation/random.h"

namespace lightmill::simulation {

/// What a client submits, and what must come of it.
struct StoredJob {
  JobSpec spec;
  std::vector<std::string> methods;  ///< of which a pilot picks one; empty: none is needed
};

/// One of small jobs of all kinds; names some of the assets.
StoredJob draw_job(std::uint64_t number, const std::map<Sha256, std::string>& assets, Random& random);

/// What a worker sends for tile number `i` of the grant; nothing if the farm does not want it any more.
std::optional<WorkerResult> render(const LeaseGrant& grant, std::size_t i, const Coordinator& farm, Time now);
PilotReport pilot_report(const PilotGrant& grant);

class StoredFarm {
 public:
  /// As a coordinator starts on these files; the error of one that refuses them. `sendable`: assets that the client
  /// has.
  static Result<std::unique_ptr<StoredFarm>> start(const std::filesystem::path& folder, bool accept_loss,
                                                   const std::map<Sha256, std::string>& sendable);
  static std::filesystem::path database_of(const std::filesystem::path& folder) { return folder / "lightmill.sqlite"; }

  /// What the store gave back, with what is damaged, but without what was taken out.
  const StoredState& loaded() const { return loaded_; }

  void send_assets();
  JobId submit(const StoredJob& job);
  /// Stores these beside what the coordinator does.
  void commit(std::vector<StoreOp> ops);
  /// Workers render, so many results at most. What waits for other workers or for time comes too.
  void work(std::uint64_t most_results);
  /// Films come from the store. Those that lack nodes are rendered again, until all jobs have ended.
  /// Returns what is wrong if that does not come.
  std::string finish();
  /// What is wrong with the films of a farm that has finished these jobs, or those that are left; empty if nothing.
  std::string wrong_films(const std::map<JobId, StoredJob>& jobs) const;
  /// All that the farm's jobs name, as workers would that were to render them.
  void fetch_assets();
  std::uint64_t rendered() const { return rendered_; }  ///< results
  std::uint64_t sent_again() const { return sent_again_; }
  /// Nodes that were damaged when films were read.
  bool found_damage_later() const { return found_damage_later_; }

 private:
  struct Given {
    SessionId to;
    CoordinatorMessage message;
  };
  StoredFarm() = default;

  void settle(Effects& effects);
  void read_film(JobId job, Effects& effects);
  void pass(Duration time);
  void answer(const Given& given);
  /// As a worker gets it, which believes nothing. What is damaged is forgotten, and sent again by the client.
  void fetch(const Sha256& digest);
  void say(SessionId from, WorkerMessage message);

  std::map<Sha256, std::string> sendable_;
  StoredState loaded_;
  std::unique_ptr<Store> store_;
  std::unique_ptr<AssetStore> assets_;
  std::unique_ptr<Coordinator> coordinator_;
  Time now_{std::chrono::seconds(100)};
  std::deque<Given> given_;
  std::uint64_t left_ = 0, rendered_ = 0, sent_again_ = 0;
  bool found_damage_later_ = false;
};

}  // namespace lightmill::simulation
