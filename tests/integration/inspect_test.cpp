// Inspection of scene files on the farm: a worker reads them. The result renders like the command line's job.
#include <gtest/gtest.h>

#include <signal.h>

#include <filesystem>
#include <fstream>

#include "common/base/file.h"
#include "common/base/sanitizers.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

/// Files that a client drops onto a farm.
class Dropped {
 public:
  explicit Dropped(FarmClient client) : client_(std::move(client)) {}

  void add(const std::string& path, const std::string& bytes) {
    LoadedScene scene;
    scene.assets[sha256(bytes)] = bytes;
    client_.upload_assets(scene);
    v1::InspectSceneRequest::File* file = request.add_files();
    file->set_path(path);
    file->set_digest(digest_bytes(sha256(bytes)));
  }
  void add_shipped(const std::string& path) { add(path, read_file(source_file("scenes/" + path)).value()); }
  grpc::Status inspect() {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTimeout);
    found.Clear();
    return client_.stub().InspectScene(&context, request, &found);
  }

  v1::InspectSceneRequest request;
  v1::InspectSceneResponse found;

 private:
  FarmClient client_;
};

/// Drops the bench box's files as they are in their folder.
void drop_box(Dropped& dropped) {
  dropped.add_shipped("cornell-bench-blocks.json");
  dropped.add_shipped("assets/CornellBox.obj");
  dropped.add_shipped("assets/CornellBlocks.obj");
  dropped.request.add_scene("cornell-bench-blocks.json");
}

bool knows(FarmClient& client, const std::string& digest) {
  grpc::ClientContext context;
  v1::FindMissingAssetsRequest request;
  request.add_digests(digest);
  v1::FindMissingAssetsResponse response;
  EXPECT_TRUE(client.stub().FindMissingAssets(&context, request, &response).ok());
  return response.missing().empty();
}

TEST(Inspect, GivesTheJobThatTheCommandLineWouldSubmit) {
  Farm farm;
  farm.add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  FarmClient client = farm.client();
  Dropped dropped(farm.client());
  drop_box(dropped);
  const grpc::Status status = dropped.inspect();
  ASSERT_TRUE(status.ok()) << status.error_message();
  const v1::InspectSceneResponse& found = dropped.found;
  EXPECT_EQ(found.packed(), pack_scene(bench_box().scene)) << "byte for byte as read from the folder";
  ASSERT_EQ(found.assets_size(), static_cast<int>(bench_box().assets.size()));
  for (const std::string& digest : found.assets()) {
    EXPECT_TRUE(bench_box().assets.contains(digest_from_bytes(digest).value()));
    EXPECT_TRUE(knows(client, digest)) << "the worker registered it";
  }
  EXPECT_GT(found.facts_size(), 5);
  EXPECT_GT(found.chosen_size(), 0);
  bool path = false;
  for (const auto& verdict : found.methods()) {
    path = path || (verdict.method() == "path" && verdict.admitted());
  }
  EXPECT_TRUE(path);

  // Submits the inspection's result, and nothing that this process has read.
  const Picture picture{.side = 64, .samples = 8};
  v1::SubmitJobRequest submit;
  to_wire(job_of(picture, "inspected"), &submit);
  Scene scene = unpack_scene(found.packed()).value();
  scene.film.width = scene.film.height = picture.side;
  submit.mutable_job()->mutable_settings()->set_scene(pack_scene(scene));
  *submit.mutable_job()->mutable_settings()->mutable_assets() = found.assets();
  grpc::ClientContext context;
  v1::Job job;
  const grpc::Status submitted = client.stub().SubmitJob(&context, submit, &job);
  ASSERT_TRUE(submitted.ok()) << submitted.error_message();
  expect_reference_film(farm.client(), job.id(), picture);
}

TEST(Inspect, NamesFaultsByTheGivenNames) {
  Farm farm;
  farm.add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  Dropped dropped(farm.client());
  dropped.add("ünïcode dir/box.json", R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1},
"materials": [{"name": "red", "mirror": {}}],
"objects": [{"material": "red", "mesh": {"file": "/etc/hostname"}}]})");
  dropped.request.add_scene("ünïcode dir/box.json");
  grpc::Status status = dropped.inspect();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_NE(status.error_message().find("ünïcode dir/box.json:3"), std::string::npos) << status.error_message();
  EXPECT_NE(status.error_message().find("/etc/hostname: is not among the uploaded files"), std::string::npos)
      << status.error_message();

  Dropped broken(farm.client());
  broken.add("a.obj", "v 0 0 0\nv 1 0\n");
  broken.request.add_scene("a.obj");
  status = broken.inspect();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message().find("a.obj:2:"), 0u) << status.error_message();

  Dropped outside(farm.client());
  outside.add("../a.obj", "v 0 0 0\n");
  outside.request.add_scene("../a.obj");
  EXPECT_EQ(outside.inspect().error_code(), grpc::StatusCode::INVALID_ARGUMENT);

  Dropped nothing(farm.client());
  EXPECT_EQ(nothing.inspect().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST(Inspect, ReportsFilesThatAreNoTextWithoutLosingItsWorker) {
  Farm farm;
  farm.add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  const auto answer = [&](const std::string& name, const std::string& bytes) {
    Dropped dropped(farm.client());
    dropped.add(name, bytes);
    dropped.request.add_scene(name);
    return dropped.inspect();
  };
  // A byte that is not UTF-8, one word of 100 kB, a file of noise, and a name in Latin-1.
  std::string noise;
  for (int i = 0; i < 4096; ++i) {
    noise.push_back(static_cast<char>(i * 37 % 251 + (i % 7 == 0 ? 10 : 0)));
  }
  for (const std::string& bytes : {std::string("v 0 0 0\nf 1 2 \xe9\n"), "v " + std::string(100'000, 'x') + "\n", noise,
                                   std::string("mtllib K\xf6rper.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")}) {
    const grpc::Status status = answer("odd.obj", bytes);
    EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::INVALID_ARGUMENT)
        << status.error_code() << ": " << status.error_message();
    EXPECT_LT(status.error_message().size(), 2'000u);
  }
  EXPECT_EQ(farm.server_log().find("disconnected"), std::string::npos) << farm.server_log();
}

TEST(Inspect, ReportsAMissingWorkerAndReplacesALostOne) {
  Farm farm;
  Dropped dropped(farm.client());
  drop_box(dropped);
  EXPECT_EQ(dropped.inspect().error_code(), grpc::StatusCode::UNAVAILABLE);
  BackgroundProcess& first = farm.add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  ASSERT_EQ(::kill(first.pid(), SIGSTOP), 0);
  grpc::Status status;
  std::thread caller([&] { status = dropped.inspect(); });
  ASSERT_TRUE(
      eventually([&] { return farm.server_log().find("worker w1 reads the scene files") != std::string::npos; }));
  kill_at_once(first);
  farm.add_worker(1, "w2");
  caller.join();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(dropped.found.packed(), pack_scene(bench_box().scene));
}

// A file within the limit of bytes takes 20 times as much memory. The worker may use 1 GB, so its reader has 0.3 GB.
TEST(Inspect, AFileThatNeedsTooMuchMemoryLeavesTheWorkerAlone) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers need more memory than any limit allows";
  }
  Farm farm;
  BackgroundProcess& worker = farm.add_worker(1, "w1", Launch{"", {"/usr/bin/prlimit", "--data=1000000000"}, {}});
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  FarmClient client = farm.client();
  const std::uint64_t job = client.submit(Picture{.samples = 1 << 20}, "long").id();
  client.wait_for_samples(job, 128 * 128);
  std::string values = R"({"asset": {"version": "2.0"}, "extras": [{})";
  while (values.size() < (40u << 20)) {
    values += ",{}";
  }
  Dropped hostile(farm.client());
  hostile.add("a.gltf", values + "]}");
  hostile.request.add_scene("a.gltf");
  const grpc::Status status = hostile.inspect();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_NE(status.error_message().find("reading the scene takes more than "), std::string::npos)
      << status.error_message();
  const std::uint64_t before = client.job(job).samples_done();
  EXPECT_TRUE(eventually([&] { return client.job(job).samples_done() > before; }));
  Dropped dropped(farm.client());
  drop_box(dropped);
  EXPECT_TRUE(dropped.inspect().ok());
  EXPECT_FALSE(farm.missed("w1")) << farm.server_log();
  ASSERT_EQ(::kill(worker.pid(), SIGTERM), 0);
  EXPECT_EQ(worker.wait(kTimeout), 0) << "it drains";
}

/// The process of this worker that reads a scene; 0 if there is none.
pid_t reader_of(pid_t worker) {
  for (const auto& thread : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", worker))) {
    std::ifstream children(thread.path() / "children");
    for (pid_t child = 0; children >> child;) {
      if (read_file(fmt::format("/proc/{}/cmdline", child)).value_or("").find("--scene-reader") != std::string::npos) {
        return child;
      }
    }
  }
  return 0;
}

TEST(Inspect, AWorkerDrainsWhileItsReaderHangs) {
  Farm farm;
  BackgroundProcess& worker = farm.add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  std::string corners;
  while (corners.size() < (20u << 20)) {
    corners += "v 0.125 0.25 0.375 0.5 0.5 0.5\n";
  }
  Dropped slow(farm.client());
  slow.add("a.obj", corners);
  slow.request.add_scene("a.obj");
  grpc::Status status;
  std::thread caller([&] { status = slow.inspect(); });
  pid_t reader = 0;
  EXPECT_TRUE(eventually([&] { return (reader = reader_of(worker.pid())) != 0; }));
  if (reader != 0) {  // 0 would be this test's own group of processes
    EXPECT_EQ(::kill(reader, SIGSTOP), 0);
  }
  EXPECT_EQ(::kill(worker.pid(), SIGTERM), 0);
  EXPECT_EQ(worker.wait(kTimeout), 0) << farm.worker_log("w1");
  EXPECT_NE(::kill(reader, 0), 0) << "the reader is gone";
  farm.add_worker(1, "w2");
  caller.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
}

TEST(Inspect, WorksWhileTheWorkerRenders) {
  Farm farm;
  farm.add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.met("w1"); }));
  FarmClient client = farm.client();
  const std::uint64_t job = client.submit(Picture{.samples = 1 << 20}, "long").id();
  client.wait_for_samples(job, 128 * 128);
  Dropped dropped(farm.client());
  drop_box(dropped);
  const grpc::Status status = dropped.inspect();
  EXPECT_TRUE(status.ok()) << status.error_message();
  const std::uint64_t before = client.job(job).samples_done();
  EXPECT_TRUE(eventually([&] { return client.job(job).samples_done() > before; }));
}

}  // namespace
}  // namespace lightmill::test
