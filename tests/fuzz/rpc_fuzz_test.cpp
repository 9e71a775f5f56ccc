// Whatever is sent to a coordinator as a request, it answers, says what is wrong with it, and lives on.
#include <gtest/gtest.h>

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/rpc_target.h"

namespace lightmill {
namespace {

constexpr int kRoundsOfMethod = 600;
constexpr std::array<std::string_view, 8> kWords{"\xff\xff\xff\xff\x0f",
                                                 "\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01",
                                                 "\x08\x01",
                                                 "\x0a\x05",
                                                 std::string_view("\0", 1),
                                                 "\x1a",
                                                 "../../etc/passwd",
                                                 std::string_view("\0\0\xc0\x7f", 4)};

TEST(RpcFuzz, DamagedRequestsOfAllMethodsAreAnswered) {
  fuzz::RpcTarget farm;
  ASSERT_GE(farm.methods().size(), 20u);
  FuzzRandom random(30);
  int sent = 0;
  std::map<std::string, int> answered;
  std::vector<fuzz::RpcTarget::Method> methods = farm.methods();
  std::ranges::stable_partition(methods, [](const fuzz::RpcTarget::Method& method) {  // jobs end last
    return !method.path.ends_with("/CancelJob") && !method.path.ends_with("/DeleteJob");
  });
  for (const fuzz::RpcTarget::Method& method : methods) {
    const std::string original = farm.example(method);
    ASSERT_TRUE(fuzz::RpcTarget::is_message(method.request, original)) << method.path;
    for (int round = 0; round < kRoundsOfMethod; ++round) {
      std::vector<std::string> requests;
      for (std::size_t i = 0; i <= random.below(3); ++i) {
        const std::string request = mutate(original, kWords, random);
        if (fuzz::RpcTarget::is_message(method.request, request)) {
          requests.push_back(request);
        }
      }
      if (requests.empty()) {
        continue;
      }
      if (!method.path.ends_with("/Work") && !method.path.ends_with("/UploadAsset")) {
        requests.resize(1);
      } else if (random.below(2) == 0) {
        requests.insert(requests.begin(), original);
      }
      ++sent;
      const grpc::StatusCode code = farm.call(method, requests);
      const bool more_to_say = code == grpc::StatusCode::CANCELLED;
      answered[method.path] += code == grpc::StatusCode::OK || more_to_say ? 1 : 0;
    }
  }
  EXPECT_GT(sent, kRoundsOfMethod * static_cast<int>(farm.methods().size()) / 4);
  EXPECT_GT(answered["/lightmill.v1.RenderService/ListJobs"], 0);
  EXPECT_GT(answered["/lightmill.v1.RenderService/SubmitJob"], 0);
  EXPECT_GT(answered["/lightmill.v1.RenderService/GetFilm"], 0);
  EXPECT_GT(answered["/lightmill.v1.RenderService/DeleteJob"], 0);
  EXPECT_GT(answered["/lightmill.v1.WorkerService/Work"], 0);
  // It is still there, with what it had.
  const auto list = std::ranges::find(farm.methods(), std::string("/lightmill.v1.RenderService/ListJobs"),
                                      &fuzz::RpcTarget::Method::path);
  EXPECT_EQ(farm.call(*list, {""}), grpc::StatusCode::OK);
}

}  // namespace
}  // namespace lightmill
