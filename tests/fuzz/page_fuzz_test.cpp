// Fuzz test: any message of a page becomes a request or an error.
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include "lightmill/v1/web.pb.h"
#include "server/web/live_messages.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/wire_words.h"

namespace lightmill {
namespace {

const int kPageRounds = fuzz_cases(10'000);

TEST(PageFuzz, WhatPagesSayBecomesARequestOrAnError) {
  v1::ViewRequest request;
  request.set_jobs(true);
  request.set_job(7);
  request.set_seen(1'000'000);
  const std::string original = request.SerializeAsString();
  const google::protobuf::LogSilencer quiet;
  FuzzRandom random(9);
  int accepted = 0, refused = 0;
  for (int round = 0; round < kPageRounds; ++round) {
    const Result<ViewRequest> read = parse_view_request(mutate(original, kWireWords, random));
    read.ok() ? ++accepted : ++refused;
    EXPECT_TRUE(read.ok() || !message_of(read.status()).empty()) << round;
  }
  EXPECT_GT(accepted, kPageRounds / 100);
  EXPECT_GT(refused, kPageRounds / 100);
}

}  // namespace
}  // namespace lightmill
