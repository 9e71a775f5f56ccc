#include "server/web/web_stream.h"

#include <gtest/gtest.h>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include <array>
#include <string>

namespace lightmill {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr auto kSoon = std::chrono::milliseconds(1);

/// Both ends of a connection to this machine. Ours is the stream; the other end is blocking.
class WebStreamTest : public testing::Test {
 protected:
  WebStreamTest() {
    tcp::acceptor acceptor(*io_, {asio::ip::make_address("127.0.0.1"), 0});
    peer_.connect(acceptor.local_endpoint());
    stream_ = std::make_shared<WebStream>(acceptor.accept());
  }

  std::optional<asio::io_context> io_{1};
  asio::io_context peers_;
  tcp::socket peer_{peers_};
  std::shared_ptr<WebStream> stream_;
};

TEST_F(WebStreamTest, WritesAllBuffersInTheirOrder) {
  std::string sent;
  std::vector<asio::const_buffer> buffers;
  for (std::size_t i = 0; i < 300; ++i) {  // more than one call of the kernel takes
    sent += static_cast<char>('a' + i % 26);
  }
  for (const char& c : sent) {
    buffers.emplace_back(&c, 1);
  }
  std::size_t written = 0;
  asio::async_write(*stream_, buffers, [&](error_code error, std::size_t bytes) {
    EXPECT_FALSE(error) << error.message();
    written = bytes;
  });
  io_->run();
  EXPECT_EQ(written, sent.size());
  std::string received(sent.size(), ' ');
  asio::read(peer_, asio::buffer(received));
  EXPECT_EQ(received, sent);
}

TEST_F(WebStreamTest, ReadsIntoTheFirstBufferWithRoom) {
  asio::write(peer_, asio::buffer("abcd", 4));
  std::string first(2, ' '), second(2, ' ');
  std::size_t got = 0;
  stream_->async_read_some(
      std::array<asio::mutable_buffer, 3>{asio::mutable_buffer(), asio::buffer(first), asio::buffer(second)},
      [&](error_code error, std::size_t bytes) {
        EXPECT_FALSE(error) << error.message();
        got = bytes;
      });
  io_->run();
  EXPECT_EQ(got, 2u);
  EXPECT_EQ(first, "ab");
  EXPECT_EQ(second, "  ");
}

TEST_F(WebStreamTest, HandlersAreCalledOnlyByTheContext) {
  asio::write(peer_, asio::buffer("a", 1));
  char byte = 0;
  bool called = false;
  stream_->async_read_some(asio::buffer(&byte, 1), [&](error_code, std::size_t) { called = true; });
  EXPECT_FALSE(called);
  io_->run();
  EXPECT_TRUE(called);
}

TEST_F(WebStreamTest, AReadEndsAtItsDeadline) {
  char byte = 0;
  error_code result;
  stream_->tcp().expires_after(kSoon);
  stream_->async_read_some(asio::buffer(&byte, 1), [&](error_code error, std::size_t) { result = error; });
  io_->run();
  EXPECT_EQ(result, boost::beast::error::timeout);
}

TEST_F(WebStreamTest, ADeadlineSetBeforeTheHandshakeEndsIt) {
  error_code result;
  stream_->tcp().expires_after(kSoon);
  stream_->async_handshake(std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server), {},
                           [&](error_code error, std::size_t) { result = error; });
  EXPECT_TRUE(stream_->encrypted());
  io_->run();
  EXPECT_EQ(result, boost::beast::error::timeout);
}

TEST_F(WebStreamTest, AHandlerThatHoldsTheStreamEndsWithTheContext) {
  char byte = 0;
  bool called = false;
  const std::weak_ptr<WebStream> stream = stream_;
  stream_->async_read_some(asio::buffer(&byte, 1),
                           [&called, kept = std::move(stream_)](error_code, std::size_t) { called = true; });
  io_->poll();
  EXPECT_FALSE(stream.expired());
  io_.reset();
  EXPECT_TRUE(stream.expired());
  EXPECT_FALSE(called);
}

}  // namespace
}  // namespace lightmill
