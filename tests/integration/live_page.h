// A viewer of the page's live messages.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include <optional>

#include "lightmill/v1/web.pb.h"
#include "tests/integration/web_farm.h"

namespace lightmill::test {

/// A viewer that reads only when the test asks for it.
class Page {
 public:
  explicit Page(WebFarm& farm, const Headers& headers = {}) : socket_(farm.connect()) {
    socket_.set_option(
        boost::beast::websocket::stream_base::decorator([headers](boost::beast::websocket::request_type& request) {
          for (const auto& [name, value] : headers) {
            request.set(name, value);
          }
        }));
    socket_.handshake(farm.host(), "/api/v1/live", error);
    socket_.binary(true);
  }
  void ask(std::uint64_t job, std::optional<std::uint64_t> seen = std::nullopt) {
    v1::ViewRequest request;
    request.set_jobs(true);
    request.set_workers(true);
    request.set_job(job);
    request.set_seen(seen.value_or(received));
    send(request.SerializeAsString());
  }
  void send(const std::string& bytes) { socket_.write(boost::asio::buffer(bytes), error); }
  /// The next message. At the connection's end it is empty, with `error`.
  v1::ViewUpdate read() {
    boost::beast::flat_buffer buffer;
    v1::ViewUpdate update;
    socket_.read(buffer, error);
    if (!error) {
      ++received;
      EXPECT_TRUE(update.ParseFromArray(buffer.data().data(), static_cast<int>(buffer.size())));
    }
    return update;
  }
  /// Reads and acknowledges until `enough` accepts an update.
  template <class Enough>
  void follow(std::uint64_t job, const Enough& enough) {
    for (int i = 0; i < 1000 && !error; ++i) {
      const v1::ViewUpdate update = read();
      ask(job);
      if (enough(update)) {
        return;
      }
    }
    ADD_FAILURE() << "the expected message does not arrive: " << error.message();
  }
  boost::beast::websocket::close_code close_code() const {
    return static_cast<boost::beast::websocket::close_code>(socket_.reason().code);
  }

  boost::beast::error_code error;
  std::uint64_t received = 0;

 private:
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_;
};

}  // namespace lightmill::test
