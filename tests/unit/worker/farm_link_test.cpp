#include "worker/rpc/farm_link.h"

#include <gtest/gtest.h>

#include <atomic>
#include <semaphore>
#include <thread>

namespace lightmill {
namespace {

TEST(FarmLinkTest, AStreamHasEndedWholeBeforeTheNextBegins) {
  // Else gRPC's thread would be the last that has the channel, and would have to wait for its own end.
  constexpr std::uint64_t kStreams = 10;
  std::counting_semaphore<> told(0);
  std::atomic<std::uint64_t> returned = 0;
  LinkHandlers handlers;
  handlers.connected = [](std::uint64_t, const std::string&) { ADD_FAILURE() << "nobody listens there"; };
  handlers.message = [](std::uint64_t, const CoordinatorMessage&) {
    ADD_FAILURE() << "nobody is there to say anything";
  };
  handlers.disconnected = [&](std::uint64_t stream, const std::string& address, const Status& status) {
    EXPECT_EQ(address, "127.0.0.1:1");
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << message_of(status);
    told.release();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    returned = stream;
  };
  {
    FarmLink link({{"127.0.0.1:1"}, {}}, handlers);
    for (std::uint64_t stream = 1; stream <= kStreams; ++stream) {
      EXPECT_EQ(link.open(), stream);
      EXPECT_EQ(returned, stream - 1);
      told.acquire();
    }
  }
  EXPECT_EQ(returned, kStreams);
}

}  // namespace
}  // namespace lightmill
