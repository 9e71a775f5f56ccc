// Fuzz test: any message of a page becomes a request or an error.
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include "lightmill/v1/web.pb.h"
#include "server/web/live_messages.h"
#include "tests/fuzz/fuzz_loop.h"
#include "tests/fuzz/wire_words.h"

namespace lightmill {
namespace {

TEST(PageFuzz, AnyMessageOfAPageBecomesARequestOrAnError) {
  v1::ViewRequest request;
  request.set_jobs(true);
  request.set_job(7);
  request.set_seen(1'000'000);
  const google::protobuf::LogSilencer quiet;
  expect_both_outcomes({request.SerializeAsString()}, 9, fuzz_cases(10'000),
                       [](const std::string& original, FuzzRandom& random) {
                         const auto read = parse_view_request(mutate(original, kWireWords, random));
                         EXPECT_TRUE(read.ok() || !message_of(read.status()).empty());
                         return read.ok();
                       });
}

}  // namespace
}  // namespace lightmill
