// Fuzz test of requests: the coordinator answers any bytes, names the error, and keeps running.
#include <gtest/gtest.h>

#include <thread>

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/rpc_target.h"

namespace lightmill {
namespace {

constexpr int kUsualRequests = 150;  // for each method
constexpr int kThreads = 16;         // if more are asked for: most of the time is waiting for streams
constexpr std::array<std::string_view, 8> kWords{"\xff\xff\xff\xff\x0f",
                                                 "\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01",
                                                 "\x08\x01",
                                                 "\x0a\x05",
                                                 std::string_view("\0", 1),
                                                 "\x1a",
                                                 "../../etc/passwd",
                                                 std::string_view("\0\0\xc0\x7f", 4)};

using Answers = std::map<std::string, int>;

/// Damaged requests from the example of a method that still parse: one, or several.
std::vector<std::string> damaged_requests(const fuzz::RpcTarget::Method& method, const std::string& original,
                                          FuzzRandom& random) {
  std::vector<std::string> requests;
  while (requests.empty()) {
    for (std::size_t i = 0; i <= random.below(3); ++i) {
      const std::string request = mutate(original, kWords, random);
      if (fuzz::RpcTarget::is_message(method.request, request)) {
        requests.push_back(request);
      }
    }
  }
  if (!method.path.ends_with("/Work") && !method.path.ends_with("/UploadAsset")) {
    requests.resize(1);
  } else if (random.below(2) == 0) {
    requests.insert(requests.begin(), original);
  }
  return requests;
}

/// Sends so many damaged requests to each method. Returns how often each was answered.
Answers send_damaged(fuzz::RpcTarget& farm, int of_each, std::uint64_t seed) {
  FuzzRandom random(seed);
  Answers answered;
  std::vector<fuzz::RpcTarget::Method> methods = farm.methods();
  std::ranges::stable_partition(methods, [](const fuzz::RpcTarget::Method& method) {  // jobs end last
    return !method.path.ends_with("/CancelJob") && !method.path.ends_with("/DeleteJob");
  });
  for (const fuzz::RpcTarget::Method& method : methods) {
    const std::string original = farm.example(method);
    EXPECT_TRUE(fuzz::RpcTarget::is_message(method.request, original)) << method.path;
    for (int i = 0; i < of_each; ++i) {
      const grpc::StatusCode code = farm.call(method, damaged_requests(method, original, random)).error_code();
      const bool more_to_say = code == grpc::StatusCode::CANCELLED;
      answered[method.path] += code == grpc::StatusCode::OK || more_to_say ? 1 : 0;
    }
  }
  return answered;
}

TEST(RpcFuzz, BytesThatAreNoMessageAreTheCallersMistake) {
  fuzz::RpcTarget farm;
  for (const fuzz::RpcTarget::Method& method : farm.methods()) {
    const bool streams = method.path.ends_with("/Work") || method.path.ends_with("/UploadAsset") ||
                         method.path.ends_with("/DownloadAsset") || method.path.ends_with("/WatchJob") ||
                         method.path.ends_with("/GetFilm") || method.path.ends_with("/StreamIsActive");
    if (!streams) {  // gRPC parses the requests of unary methods
      EXPECT_EQ(farm.call(method, {"\x0a\x05"}).error_code(), grpc::StatusCode::INVALID_ARGUMENT) << method.path;
    }
  }
}

TEST(RpcFuzz, DamagedRequestsOfAllMethodsAreAnswered) {
  fuzz::RpcTarget farm;
  const int methods = static_cast<int>(farm.methods().size());
  ASSERT_GE(methods, 20);
  const int usual = kUsualRequests * methods, cases = fuzz_cases(usual), threads = cases > usual ? kThreads : 1;
  const int of_each = (cases + methods * threads - 1) / (methods * threads);
  std::vector<Answers> answers(static_cast<std::size_t>(threads));
  {
    std::vector<std::jthread> senders;
    for (std::size_t i = 0; i < answers.size(); ++i) {
      senders.emplace_back([&, i] { answers[i] = send_damaged(farm, of_each, 30 + i); });
    }
  }
  Answers answered;
  for (const Answers& some : answers) {
    for (const auto& [method, times] : some) {
      answered[method] += times;
    }
  }
  fmt::print("{} damaged requests sent\n", of_each * methods * threads);
  EXPECT_GT(answered["/lightmill.v1.RenderService/ListJobs"], 0);
  EXPECT_GT(answered["/lightmill.v1.RenderService/SubmitJob"], 0);
  EXPECT_GT(answered["/lightmill.v1.RenderService/GetFilm"], 0);
  EXPECT_GT(answered["/lightmill.v1.RenderService/DeleteJob"], 0);
  EXPECT_GT(answered["/lightmill.v1.WorkerService/Work"], 0);
  // The coordinator still runs, with its jobs.
  const auto list = std::ranges::find(farm.methods(), std::string("/lightmill.v1.RenderService/ListJobs"),
                                      &fuzz::RpcTarget::Method::path);
  const grpc::Status listed = farm.call(*list, {""});
  EXPECT_TRUE(listed.ok()) << listed.error_message();
}

}  // namespace
}  // namespace lightmill
