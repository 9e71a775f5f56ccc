#include "worker/rpc/coordinator_link.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <semaphore>
#include <thread>

#include "common/base/file.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

TEST(FarmLinkTest, AStreamEndsBeforeTheNextBegins) {
  // Otherwise gRPC's thread would hold the channel last, and would wait for its own end.
  constexpr std::uint64_t kStreams = 10;
  std::counting_semaphore<> disconnected(0);
  std::atomic<std::uint64_t> returned = 0;
  LinkHandlers handlers;
  handlers.connected = [](std::uint64_t, const std::string&) { ADD_FAILURE() << "no server listens there"; };
  handlers.message = [](std::uint64_t, const CoordinatorMessage&) { ADD_FAILURE() << "no server can send a message"; };
  handlers.disconnected = [&](std::uint64_t stream, const std::string& address, const Status& status) {
    EXPECT_EQ(address, "127.0.0.1:1");
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << message_of(status);
    disconnected.release();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    returned = stream;
  };
  {
    CoordinatorLink link({{"127.0.0.1:1"}, {}}, handlers);
    for (std::uint64_t stream = 1; stream <= kStreams; ++stream) {
      EXPECT_EQ(link.open(), stream);
      EXPECT_GE(returned, stream - 1);  // the new one may have returned, too
      disconnected.acquire();
    }
  }
  EXPECT_EQ(returned, kStreams);
}

TEST(FarmLinkTest, TheReasonOfAFailureIsInPlainWords) {
  std::promise<Status> ended;
  LinkHandlers handlers;
  handlers.disconnected = [&](std::uint64_t, const std::string&, const Status& status) { ended.set_value(status); };
  CoordinatorLink link({{"127.0.0.1:1"}, {}}, handlers);
  link.open();
  EXPECT_EQ(link.explain("127.0.0.1:1", ended.get_future().get()),
            "nothing listens there. Start lightmill-server, or give another --server");
}

/// A worker without a token, with an enrolment file.
class EnrollingLinkTest : public ::testing::Test {
 protected:
  EnrollingLinkTest() {
    EXPECT_TRUE(write_secret_file(file_, as_byte_view(make_token()->text), false).ok());
    handlers_.disconnected = [this](std::uint64_t stream, const std::string&, const Status& status) {
      EXPECT_EQ(stream, 1u);
      ended_.set_value(status);
    };
  }
  CoordinatorAddress farm(const std::string& server) { return {{server}, {}, EnrolmentFiles{file_, &state_, "node7"}}; }

  const test::TemporaryFolder folder_;
  const std::string file_ = (folder_.path() / "enrol").string();
  StateFolder state_ = StateFolder::take(folder_.path() / "state").value();
  LinkHandlers handlers_;
  std::promise<Status> ended_;
};

TEST_F(EnrollingLinkTest, AFailedEnrolmentEndsTheStream) {
  CoordinatorLink link(farm("127.0.0.1:1"), handlers_);
  EXPECT_EQ(link.open(), 1u);
  const Status status = ended_.get_future().get();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(message_of(status).find("enrolment with --enrol-file " + file_), std::string::npos) << status;
  EXPECT_FALSE(state_.has_token());
}

TEST_F(EnrollingLinkTest, ATokenIsNotSentUnencrypted) {
  CoordinatorLink link(farm("192.0.2.1:7350"), handlers_);
  link.open();
  const Status status = ended_.get_future().get();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(status).find("--tls-ca"), std::string::npos) << status;
}

TEST_F(EnrollingLinkTest, ALeavingWorkerStopsItsEnrolment) {
  const int silent = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(silent, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(silent, 1), 0);
  ASSERT_EQ(::getsockname(silent, reinterpret_cast<sockaddr*>(&address), &size), 0);
  std::future<Status> ended = ended_.get_future();
  {
    CoordinatorLink link(farm(fmt::format("127.0.0.1:{}", ntohs(address.sin_port))), handlers_);
    link.open();
    ASSERT_GE(::accept(silent, nullptr, nullptr), 0);  // its call is under way
  }
  ASSERT_EQ(ended.wait_for(std::chrono::seconds(0)), std::future_status::ready) << "no handler is called afterwards";
  EXPECT_EQ(ended.get().code(), StatusCode::kCancelled);
  ::close(silent);
}

}  // namespace
}  // namespace lightmill
