// Farm over real store files: a coordinator, two workers that render at once, and a client that resends assets.
//
// It starts like a coordinator's process, and its destructor kills it. It leaves the SQLite database with its journal
// and its chain, and the folder of assets. Not thread-safe.
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

/// Job of a client, with the methods that its pilot may choose.
struct StoredJob {
  JobSpec spec;
  std::vector<std::string> methods;  ///< candidates of its pilot; empty: it needs no pilot
};

/// Draws a small job of any kind. It uses some of the assets.
StoredJob draw_job(std::uint64_t number, const std::map<Sha256, std::string>& assets, Random& random);

/// Result of a worker for tile number `i` of the grant; nothing if the farm no longer wants it.
std::optional<WorkerResult> render(const LeaseGrant& grant, std::size_t i, const Coordinator& farm, Time now);
PilotReport pilot_report(const PilotGrant& grant);

class StoredFarm {
 public:
  /// Starts a coordinator on these files. An error if it refuses them. `sendable`: assets that the client has.
  static Result<std::unique_ptr<StoredFarm>> start(const std::filesystem::path& folder, bool accept_loss,
                                                   const std::map<Sha256, std::string>& sendable);
  static std::filesystem::path database_of(const std::filesystem::path& folder) { return folder / "lightmill.sqlite"; }

  /// The loaded state after remove_invalid_rows, with its lists of damage.
  const StoredState& loaded() const { return loaded_; }

  void send_assets();
  JobId submit(const StoredJob& job);
  /// Stores these operations besides the coordinator's.
  void commit(std::vector<StoreOp> ops);
  /// Lets workers render at most this number of results. Time passes for work that waits.
  void work(std::uint64_t most_results);
  /// Reads films from the store, and renders missing nodes again, until all jobs have ended. Returns the reason
  /// if they do not end.
  std::string finish();
  /// The fault in the films of a farm that finished these jobs, or the remaining ones; empty if there is none.
  std::string wrong_films(const std::map<JobId, StoredJob>& jobs) const;
  /// Fetches all assets of the farm's jobs, as workers do.
  void fetch_assets();
  std::uint64_t rendered() const { return rendered_; }  ///< results
  std::uint64_t sent_again() const { return sent_again_; }
  /// Whether damaged nodes were found when films were read.
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
  /// Fetches an asset as a worker does, and checks its hash. A damaged one is deleted, and the client sends it again.
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
