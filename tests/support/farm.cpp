#include "tests/support/farm.h"

#include <gtest/gtest.h>

#include <signal.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "common/base/file.h"
#include "common/methods/method.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

/// Calls until the coordinator answers with anything but UNAVAILABLE.
template <class Call>
void call_until_served(const Call& call) {
  const auto until = std::chrono::steady_clock::now() + kTimeout;
  for (;;) {
    const grpc::Status status = call();
    if (status.ok()) {
      return;
    }
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE || std::chrono::steady_clock::now() > until) {
      ADD_FAILURE() << "code " << status.error_code() << ": " << status.error_message();
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

bool has_ended(const v1::Job& job) {
  return job.state() == v1::JOB_STATE_DONE || job.state() == v1::JOB_STATE_FAILED ||
         job.state() == v1::JOB_STATE_CANCELLED;
}

/// The largest dyadic ranges that make up [0, samples).
std::vector<SampleRange> ranges_of(std::uint64_t samples) {
  std::vector<SampleRange> ranges;
  std::uint64_t first = 0;
  for (int level = 30; level >= 0; --level) {
    if ((samples >> level) & 1) {
      ranges.push_back({static_cast<std::uint32_t>(level), static_cast<std::uint32_t>(first >> level)});
      first += std::uint64_t{1} << level;
    }
  }
  return ranges;
}

}  // namespace

const LoadedScene& shipped_scene(const std::string& name) {
  static std::map<std::string, LoadedScene> scenes;
  const auto found = scenes.find(name);
  if (found != scenes.end()) {
    return found->second;
  }
  const std::filesystem::path path = source_file("scenes/" + name + ".json");
  return scenes.emplace(name, load_scene(std::vector{path}).value()).first->second;
}

namespace {

/// The shipped scene in the picture's size.
Scene scene_of(const Picture& picture) {
  Scene scene = shipped_scene(picture.scene).scene;
  scene.film.width = picture.side;
  scene.film.height = picture.height > 0 ? picture.height : picture.side;
  return scene;
}

}  // namespace

JobSpec job_of(const Picture& picture, const std::string& request_id) {
  JobSpec spec;
  spec.request_id = request_id;
  spec.name = picture.scene;
  spec.owner = "test";
  spec.goal.samples = picture.samples;
  spec.goal.error = picture.error;
  const Scene scene = scene_of(picture);
  RenderSettings& settings = spec.settings;
  settings.scene = pack_scene(scene);
  std::vector<Sha256> digests;
  for (const auto& [digest, bytes] : shipped_scene(picture.scene).assets) {
    digests.push_back(digest);
  }
  settings.assets = std::move(digests);
  settings.width = scene.film.width;
  settings.height = scene.film.height;
  settings.crop = {0, 0, scene.film.width, scene.film.height};
  settings.seed = picture.seed;
  settings.method = picture.method;
  settings.renderer_version = kRendererVersion;
  return spec;
}

namespace {

Hash128 render_reference(const Picture& picture) {
  const LoadedScene& loaded = shipped_scene(picture.scene);
  const Scene scene = scene_of(picture);
  const auto compiled =
      CompiledScene::compile(scene, [&](const Sha256& digest) { return loaded.assets.at(digest); }).value();
  const auto method = make_method(compiled, {picture.method, picture.seed, 0}).value();
  const TileGrid grid({0, 0, scene.film.width, scene.film.height});
  std::vector<std::vector<std::shared_ptr<const Node>>> nodes(grid.tile_count());
  std::atomic<std::uint32_t> next = 0;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 2; ++i) {
      threads.emplace_back([&] {
        const auto workspace = method->make_workspace();
        for (std::uint32_t tile = next++; tile < grid.tile_count(); tile = next++) {
          for (const SampleRange& range : ranges_of(picture.samples)) {
            nodes[tile].push_back(
                std::make_shared<const Node>(method->render(grid.tile_rect(TileId{tile}), range, *workspace)));
          }
        }
      });
    }
  }
  Film film(grid, kBeautyChannels);
  FilmPlanes planes(grid.crop());
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    const TileId tile{i};
    for (const auto& node : nodes[i]) {
      film.restore(tile, node);
    }
    const Film::HalfCounts counts = film.half_counts(tile);
    planes.set_tile(grid.tile_rect(tile), sums_of(film, tile), counts.a, counts.b);
  }
  return film_hash(planes);
}

}  // namespace

Hash128 reference_hash(const Picture& picture) {
  static std::map<Picture, Hash128> known;
  const auto found = known.find(picture);
  return found != known.end() ? found->second : known.emplace(picture, render_reference(picture)).first->second;
}

// ---- the client ----

FarmClient::FarmClient(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 20'000);  // how long an attempt to connect may take
  stub_ = v1::RenderService::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
}

void FarmClient::upload_assets(const LoadedScene& scene) {
  for (const auto& [digest, bytes] : scene.assets) {
    call_until_served([&, &asset_digest = digest, &asset = bytes] {
      grpc::ClientContext context;
      v1::UploadAssetResponse response;
      const auto writer = stub_->UploadAsset(&context, &response);
      v1::UploadAssetRequest request;
      request.set_digest(digest_bytes(asset_digest));
      for (std::size_t at = 0; at < asset.size(); at += 100'000) {
        request.set_chunk(asset.substr(at, 100'000));
        if (!writer->Write(request)) {
          break;
        }
        request.clear_digest();
      }
      writer->WritesDone();
      return writer->Finish();
    });
  }
}

v1::Job FarmClient::submit(const Picture& picture, const std::string& request_id) {
  upload_assets(shipped_scene(picture.scene));
  v1::SubmitJobRequest request;
  to_wire(job_of(picture, request_id), &request);
  v1::Job job;
  call_until_served([&] {
    grpc::ClientContext context;
    return stub_->SubmitJob(&context, request, &job);
  });
  return job;
}

v1::Job FarmClient::job(std::uint64_t id) {
  v1::GetJobRequest request;
  request.set_id(id);
  v1::Job job;
  call_until_served([&] {
    grpc::ClientContext context;
    return stub_->GetJob(&context, request, &job);
  });
  return job;
}

v1::Job FarmClient::extend(std::uint64_t id, std::uint64_t samples) {
  v1::ExtendJobRequest request;
  request.set_id(id);
  request.set_samples(samples);
  v1::Job job;
  call_until_served([&] {
    grpc::ClientContext context;
    return stub_->ExtendJob(&context, request, &job);
  });
  return job;
}

std::vector<std::uint64_t> FarmClient::jobs() {
  v1::ListJobsResponse response;
  call_until_served([&] {
    grpc::ClientContext context;
    return stub_->ListJobs(&context, {}, &response);
  });
  std::vector<std::uint64_t> ids;
  for (const v1::Job& job : response.jobs()) {
    ids.push_back(job.id());
  }
  return ids;
}

std::vector<v1::Worker> FarmClient::workers() {
  v1::ListWorkersResponse response;
  call_until_served([&] {
    grpc::ClientContext context;
    return stub_->ListWorkers(&context, {}, &response);
  });
  return {response.workers().begin(), response.workers().end()};
}

v1::Job FarmClient::wait_until_ended(std::uint64_t id, std::chrono::seconds limit) {
  const auto until = std::chrono::steady_clock::now() + limit;
  for (;;) {
    const v1::Job now = job(id);
    if (has_ended(now)) {
      return now;
    }
    if (::testing::Test::HasFatalFailure() || std::chrono::steady_clock::now() > until) {
      ADD_FAILURE() << "job " << id << " has not ended: " << now.ShortDebugString();
      return now;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
}

v1::Job FarmClient::wait_for_samples(std::uint64_t id, std::uint64_t pixel_samples) {
  const auto until = std::chrono::steady_clock::now() + kTimeout;
  for (;;) {
    const v1::Job now = job(id);
    if (has_ended(now) || now.samples_done() >= pixel_samples) {
      return now;
    }
    if (std::chrono::steady_clock::now() > until) {
      ADD_FAILURE() << "job " << id << " makes no progress: " << now.ShortDebugString();
      return now;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

void FarmClient::wait_while_it_works(std::uint64_t id, Picture& picture, std::uint64_t pixel_samples) {
  for (;;) {
    const v1::Job begun = job(id);
    const v1::Job now = wait_for_samples(id, begun.samples_done() + pixel_samples);
    if (!has_ended(now) || now.state() != v1::JOB_STATE_DONE || ::testing::Test::HasFailure()) {
      EXPECT_EQ(now.state(), v1::JOB_STATE_RUNNING) << now.ShortDebugString();
      return;
    }
    picture.samples *= 2;
    extend(id, picture.samples);
  }
}

FilmPlanes FarmClient::film(std::uint64_t id) {
  FilmPlanes planes;
  call_until_served([&] {
    grpc::ClientContext context;
    v1::GetFilmRequest request;
    request.set_id(id);
    const auto reader = stub_->GetFilm(&context, request);
    v1::GetFilmResponse response;
    while (reader->Read(&response)) {
      if (response.has_header()) {
        planes = FilmPlanes(from_wire(response.header().job().crop()).value());
        continue;
      }
      const v1::FilmTile& tile = response.tile();
      planes.set_tile(from_wire(tile.rect()).value(), floats_from_bytes(tile.sums()).value(), tile.samples_a(),
                      tile.samples() - tile.samples_a());
    }
    return reader->Finish();
  });
  return planes;
}

// ---- the processes ----

void kill_at_once(BackgroundProcess& process) {
  process.send(SIGKILL);
  EXPECT_EQ(process.wait(), 128 + SIGKILL);
}

Farm::Farm(std::vector<std::string> server_options, Launch launch)
    : server_options_(std::move(server_options)), launch_(std::move(launch)), port_(launch_.address) {
  start_server();
}

void Farm::start_server() {
  const std::filesystem::path port_file = folder_.path() / "port";
  std::filesystem::remove(port_file);
  std::vector<std::string> arguments = launch_.before;
  arguments.insert(arguments.end(),
                   {program("lightmill-server"), "--listen", address(), "--port-file", port_file.string()});
  if (std::find(server_options_.begin(), server_options_.end(), "--store") == server_options_.end()) {
    arguments.insert(arguments.end(), {"--data", data().string()});
  }
  arguments.insert(arguments.end(), server_options_.begin(), server_options_.end());
  server_ =
      std::make_unique<BackgroundProcess>(arguments, (folder_.path() / "server.log").string(), launch_.environment);
  const auto until = std::chrono::steady_clock::now() + kTimeout;
  while (!std::filesystem::exists(port_file)) {
    if (server_->wait(std::chrono::milliseconds(0)) || std::chrono::steady_clock::now() > until) {
      ADD_FAILURE() << "the coordinator does not start:\n" << server_log();
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

std::unique_ptr<BackgroundProcess> Farm::start_worker(int threads, const std::string& name, const Launch& launch) {
  std::vector<std::string> arguments = launch.before;
  arguments.insert(arguments.end(),
                   {program("lightmill-worker"), "--server", launch.address.empty() ? address() : launch.address,
                    "--threads", std::to_string(threads), "--name", name, "--log-level", "debug"});
  return std::make_unique<BackgroundProcess>(arguments, (folder_.path() / (name + ".log")).string(),
                                             launch.environment);
}

BackgroundProcess& Farm::add_worker(int threads, const std::string& name, Launch launch) {
  std::unique_ptr<BackgroundProcess> process = start_worker(threads, name, launch);
  workers_.push_back({name, threads, std::move(launch), std::move(process)});
  return *workers_.back().process;
}

BackgroundProcess& Farm::worker(const std::string& name) {
  for (Worker& worker : workers_) {
    if (worker.name == name) {
      return *worker.process;
    }
  }
  throw std::out_of_range("no worker " + name);
}

void Farm::replace_worker(const std::string& name) {
  kill_at_once(worker(name));
  start_worker_again(name);
}

void Farm::start_worker_again(const std::string& name) {
  for (Worker& worker : workers_) {
    if (worker.name == name) {
      worker.process = start_worker(worker.threads, name, worker.launch);
    }
  }
}

std::string Farm::log(const std::string& name) const {
  return read_file(folder_.path() / (name + ".log")).value();
}

int Farm::times_said(const std::string& name, const std::string& words) const {
  const std::string said = log(name);
  int times = 0;
  for (std::size_t at = said.find(words); at != std::string::npos; at = said.find(words, at + 1)) {
    ++times;
  }
  return times;
}

// ---- expectations ----

void expect_reference_film(FarmClient client, std::uint64_t job, const Picture& picture) {
  const v1::Job ended = client.wait_until_ended(job);
  ASSERT_EQ(ended.state(), v1::JOB_STATE_DONE) << ended.ShortDebugString();
  EXPECT_EQ(ended.min_tile_samples(), picture.samples);
  EXPECT_EQ(ended.max_tile_samples(), picture.samples);
  EXPECT_EQ(film_hash(client.film(job)).hex(), reference_hash(picture).hex());
}

void kill_workers(Farm& farm, std::uint64_t job, Picture& picture, std::uint64_t pixel_samples, int kills) {
  std::uint64_t random = 20260731;
  std::map<std::string, int> killed;
  for (; kills > 0; --kills) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    const std::string worker = fmt::format("w{}", 1 + (random >> 33) % 3);
    EXPECT_TRUE(eventually([&] { return farm.times_met(worker) > killed[worker]; })) << farm.worker_log(worker);
    farm.client().wait_while_it_works(job, picture, pixel_samples);
    farm.replace_worker(worker);
    ++killed[worker];
  }
}

}  // namespace lightmill::test
