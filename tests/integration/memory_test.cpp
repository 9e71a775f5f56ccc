// Workers without enough memory or threads: they report it, and do the work they can. Messages that would take a
// coordinator's memory.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/integration/health.h"
#include "tests/support/farm.h"
#include "tests/support/memory_group.h"
#include "tests/support/paths.h"
#include "tests/support/recovery.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// A scene that takes little memory, but some hundred MiB for photons.
Picture heavy() {
  Picture picture;
  picture.method = "ppm:photons=2000000";
  picture.side = 64;
  picture.samples = 2;
  return picture;
}

Picture light() {
  Picture picture;
  picture.side = 64;
  picture.samples = 16;
  return picture;
}

/// The worker "small" renders only pictures that need little memory. It leaves the heavy one to others, and stays
/// connected.
void expect_only_heavy_work_is_left(Farm& farm) {
  FarmClient client = farm.client();
  const std::uint64_t first = client.submit(light(), "first").id();
  expect_reference_film(farm.client(), first, light());
  const std::uint64_t job = client.submit(heavy(), "heavy").id();
  EXPECT_TRUE(eventually([&] { return says(client.job(job).reason(), "out of memory while samples were rendered"); }))
      << client.job(job).ShortDebugString() << farm.worker_log("small");
  EXPECT_TRUE(says(client.job(job).reason(), "waits for a larger worker: for small ")) << client.job(job).reason();
  EXPECT_TRUE(says(client.job(job).reason(), "Give it more, or run it with fewer --threads"))
      << client.job(job).reason();
  Picture second = light();
  second.seed = 8;
  const std::uint64_t next = client.submit(second, "second").id();
  EXPECT_TRUE(recovers("after a worker's memory ended, its next picture",
                       [&] { return client.job(next).state() == v1::JOB_STATE_DONE; }));
  expect_reference_film(farm.client(), next, second);
  farm.add_worker(2, "large");
  EXPECT_EQ(client.wait_until_ended(job).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(farm.times_met("small"), 1);
  EXPECT_FALSE(farm.missed("small"));
}

TEST(OutOfMemory, AWorkerWhoseDataIsLimitedLeavesHeavyWorkToOthers) {
  Farm farm;
  farm.add_worker(2, "small", {"", {"/usr/bin/prlimit", "--data=" + std::to_string(280 << 20)}, {}});
  expect_only_heavy_work_is_left(farm);
}

TEST(OutOfMemory, AWorkerWhoseAddressSpaceIsLimitedLeavesHeavyWorkToOthers) {
  Farm farm;
  farm.add_worker(2, "small", {"", {"/usr/bin/prlimit", "--as=" + std::to_string(420 << 20)}, {}});
  expect_only_heavy_work_is_left(farm);
}

TEST(OutOfMemory, AWorkerIsNotKilledByItsControlGroup) {
  const MemoryGroup group(160);
  if (!group.made()) {
    GTEST_SKIP() << "cannot create a control group";
  }
  Farm farm;
  farm.add_worker(2, "small", {"", group.starter(), {}});
  expect_only_heavy_work_is_left(farm);
  kill_at_once(farm.worker("small"));
}

TEST(OutOfThreads, AWorkerThatCannotHaveItsThreadsSaysSoAndEnds) {
  // Each thread takes 8 MiB of address space for its stack.
  const CommandResult result =
      run_command({"/usr/bin/prlimit", "--as=" + std::to_string(400 << 20), program("lightmill-worker"), "--server",
                   "127.0.0.1:1", "--threads", "500"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_TRUE(says(result.err, " of the 516 threads that this worker needs can start")) << result.err;
  EXPECT_TRUE(says(result.err, "--threads")) << result.err;
  EXPECT_FALSE(says(result.err, "AVX2")) << result.err;
}

std::uint64_t peak_bytes(const BackgroundProcess& process) {
  std::ifstream file(fmt::format("/proc/{}/status", process.pid()));
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("VmHWM:")) {
      return std::stoull(line.substr(6)) << 10;
    }
  }
  ADD_FAILURE() << "no peak of process " << process.pid();
  return 0;
}

/// The status of a call with this many compressed zeros.
grpc::StatusCode send_compressed(const std::string& address, const std::string& method, std::size_t bytes) {
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  const grpc::Slice zeros(std::string(bytes, '\0'));
  const grpc::ByteBuffer request(&zeros, 1);
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareUnaryCall(&context, method, request, &queue);
  call->StartCall();
  grpc::ByteBuffer reply;
  grpc::Status status;
  call->Finish(&reply, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status.error_code();
}

TEST(OutOfMemory, CompressedMessagesAreNotDecompressed) {
  constexpr std::size_t kBytes = std::size_t{128} << 20;  // 130 kB, compressed
  const TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  Farm farm({"--health", "127.0.0.1:0", "--health-port-file", port_file});
  const std::string health_port = health_address(port_file);
  EXPECT_EQ(health(health_port), "SERVING");
  const std::uint64_t before = peak_bytes(farm.server());
  for (const std::string& address : {farm.address(), health_port}) {
    for (const char* method : {"/grpc.health.v1.Health/Check", "/lightmill.v1.RenderService/GetJob", "/a/b"}) {
      EXPECT_NE(send_compressed(address, method, kBytes), grpc::StatusCode::OK) << address << method;
    }
  }
  EXPECT_LT(peak_bytes(farm.server()), before + kBytes / 4);
  EXPECT_EQ(health(health_port), "SERVING");
}

TEST(OutOfMemory, TheHealthPortTakesOnlySmallMessages) {
  const TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  Farm farm({"--health", "127.0.0.1:0", "--health-port-file", port_file});
  const std::string health_port = health_address(port_file);
  EXPECT_EQ(health(health_port, std::string(1'000'000, 'x')),
            fmt::format("error {}", static_cast<int>(grpc::StatusCode::RESOURCE_EXHAUSTED)));
  EXPECT_EQ(health(health_port, std::string(150, 'x')),
            fmt::format("error {}", static_cast<int>(grpc::StatusCode::NOT_FOUND)));
  EXPECT_EQ(health(health_port), "SERVING");
}

}  // namespace
}  // namespace lightmill::test
