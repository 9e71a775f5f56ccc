// A farm of real processes on a free loopback port, and a client for it.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <compare>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/farm/job.h"
#include "common/scene_io/load.h"
#include "lightmill/v1/render_service.grpc.pb.h"
#include "tests/support/film_planes.h"
#include "tests/support/process.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// A small picture to render: the bench box with blocks, or another shipped scene.
struct Picture {
  int side = 128;              ///< pixels
  int height = 0;              ///< 0: a square
  std::uint64_t samples = 84;  ///< 64 + 16 + 4: the film ends as several nodes a tile; 0: no limit
  double error = 0;            ///< 0: no limit
  std::uint64_t seed = 7;
  std::string method = "path";
  std::string scene = "cornell-bench-blocks";

  friend auto operator<=>(const Picture&, const Picture&) = default;
};

const LoadedScene& shipped_scene(const std::string& name);
inline const LoadedScene& bench_box() {
  return shipped_scene(Picture().scene);
}
/// The job that a client submits.
JobSpec job_of(const Picture& picture, const std::string& request_id);
/// The film hash that the renderer alone gives in this process. Renders each picture once. Not thread-safe.
Hash128 reference_hash(const Picture& picture);

/// A client that repeats its calls while the coordinator is away.
class FarmClient {
 public:
  explicit FarmClient(const std::string& address);
  v1::RenderService::Stub& stub() { return *stub_; }

  void upload_assets(const LoadedScene& scene = bench_box());
  v1::Job submit(const Picture& picture, const std::string& request_id = "test");
  v1::Job job(std::uint64_t id);
  v1::Job extend(std::uint64_t id, std::uint64_t samples);
  /// Numbers of all jobs, the newest first.
  std::vector<std::uint64_t> jobs();
  std::vector<v1::Worker> workers();
  /// Returns the job when it has ended. Fails the test after `limit`.
  v1::Job wait_until_ended(std::uint64_t id, std::chrono::seconds limit = kTimeout);
  /// Waits until the running job has merged `pixel_samples` more. A job that ends earlier gets more samples, and
  /// `picture` gets the new number.
  void wait_while_it_works(std::uint64_t id, Picture& picture, std::uint64_t pixel_samples);
  /// Waits until `pixel_samples` are merged, or the job has ended.
  v1::Job wait_for_samples(std::uint64_t id, std::uint64_t pixel_samples);
  FilmPlanes film(std::uint64_t id);

 private:
  std::unique_ptr<v1::RenderService::Stub> stub_;
};

/// Kills a running process, and waits for its end.
void kill_at_once(BackgroundProcess& process);

/// The start of a program of a farm.
struct Launch {
  std::string address;              ///< a coordinator's listening host; a worker's --server
  std::vector<std::string> before;  ///< a program that starts it, with arguments
  Environment environment;
};

class Farm {
 public:
  /// Starts the coordinator and waits until it listens. Its state is in data() unless the options have a --store.
  explicit Farm(std::vector<std::string> server_options = {}, Launch launch = {"127.0.0.1", {}, {}});
  Farm(const Farm&) = delete;
  Farm& operator=(const Farm&) = delete;

  std::string address() const { return launch_.address + ":" + std::to_string(port_.number()); }
  BackgroundProcess& server() { return *server_; }
  /// Starts a new coordinator on the same port and data. The old one must have ended.
  void start_server();
  FarmClient client() { return FarmClient(address()); }
  std::filesystem::path data() const { return folder_.path() / "data"; }
  std::filesystem::path folder() const { return folder_.path(); }

  /// By default the worker connects directly to the coordinator.
  BackgroundProcess& add_worker(int threads, const std::string& name, Launch launch = {});
  BackgroundProcess& worker(const std::string& name);
  /// Kills the worker, which must be running, and starts another one of the same name.
  void replace_worker(const std::string& name);
  /// Starts a worker that has ended.
  void start_worker_again(const std::string& name);
  std::string worker_log(const std::string& name) const { return log(name); }
  std::string server_log() const { return log("server"); }
  /// The number of times that the log says that a worker connected, or that its connection ended.
  int times_met(const std::string& worker) const { return times_said("server", worker + " connected"); }
  int times_missed(const std::string& worker) const { return times_said("server", worker + " disconnected"); }
  bool met(const std::string& worker) const { return times_met(worker) > 0; }
  bool missed(const std::string& worker) const { return times_missed(worker) > 0; }
  /// Contents of NAME.log in folder().
  std::string log(const std::string& name) const;
  /// The number of times that `words` are in log(name).
  int times_said(const std::string& name, const std::string& words) const;

 private:
  struct Worker {
    std::string name;
    int threads;
    Launch launch;
    std::unique_ptr<BackgroundProcess> process;
  };
  std::unique_ptr<BackgroundProcess> start_worker(int threads, const std::string& name, const Launch& launch);

  TemporaryFolder folder_;
  std::vector<std::string> server_options_;
  Launch launch_;
  const ReservedPort port_;
  std::unique_ptr<BackgroundProcess> server_;
  std::vector<Worker> workers_;
};

/// Fails the test unless the job ends with all its samples and the bits of reference_hash().
void expect_reference_film(FarmClient client, std::uint64_t job, const Picture& picture = {});

/// Replaces a random one of the workers w1, w2, w3, `kills` times. Before each time the job merges `pixel_samples`
/// more. `picture` is as in FarmClient::wait_while_it_works.
void kill_workers(Farm& farm, std::uint64_t job, Picture& picture, std::uint64_t pixel_samples, int kills);

}  // namespace lightmill::test
