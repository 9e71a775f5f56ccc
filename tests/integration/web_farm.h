// A farm with its page, and requests to it over real sockets.
#pragma once

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include <fstream>
#include <map>

#include "common/base/file.h"
#include "common/wire/farm_messages.h"
#include "tests/support/farm.h"

namespace lightmill::test {

using Response = boost::beast::http::response<boost::beast::http::string_body>;
using Headers = std::map<std::string, std::string>;

template <class Message>
std::string json_of(const Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string text;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(message, &text, options).ok());
  return text;
}

/// The body for /api/v1/jobs.
inline std::string submit_body(const JobSpec& spec) {
  v1::SubmitJobRequest request;
  to_wire(spec, &request);
  return json_of(request);
}

inline Picture small_picture(std::uint64_t samples = 8) {
  Picture picture;
  picture.side = 96;
  picture.samples = samples;
  return picture;
}

/// A farm with a page and a document.
class WebFarm {
 public:
  explicit WebFarm(const std::vector<std::string>& more_options = {}, const Launch& launch = {"127.0.0.1", {}, {}}) {
    std::filesystem::create_directories(pages_.path() / "assets");
    std::ofstream(pages_.path() / "index.html") << "<p>the page</p>";
    std::ofstream(pages_.path() / "docs.html") << "<p>the documents</p>";
    std::ofstream(pages_.path() / "assets" / "a.js") << "let a;";
    std::ofstream(pages_.path() / "assets" / "a.js.gz") << "packed";
    std::vector<std::string> options{"--http",    "127.0.0.1:0", "--http-port-file",
                                     port_file(), "--pages",     pages_.path().string()};
    options.insert(options.end(), more_options.begin(), more_options.end());
    farm_ = std::make_unique<Farm>(options, launch);
    read_port();
  }
  /// Starts another coordinator on the stored state. The page gets another port.
  void restart() {
    kill_at_once(farm_->server());
    std::filesystem::remove(port_file());
    farm_->start_server();
    read_port();
  }
  Farm& farm() { return *farm_; }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  int port() const { return port_; }

  boost::asio::ip::tcp::socket connect(const std::string& from = "127.0.0.1") {
    boost::asio::ip::tcp::socket socket(io_, {boost::asio::ip::make_address(from), 0});
    socket.connect({boost::asio::ip::make_address("127.0.0.1"), port_});
    return socket;
  }
  Response send(boost::beast::http::verb verb, const std::string& target, const std::string& body = "",
                const Headers& headers = {}) {
    boost::beast::http::request<boost::beast::http::string_body> request(verb, target, 11);
    request.set(boost::beast::http::field::host, host());
    for (const auto& [name, value] : headers) {
      request.set(name, value);
    }
    request.body() = body;
    request.prepare_payload();
    boost::asio::ip::tcp::socket socket = connect();
    boost::beast::error_code ignored;  // a refused caller may find the connection closed while it still sends
    boost::beast::http::write(socket, request, ignored);
    boost::beast::flat_buffer buffer;
    boost::beast::http::response_parser<boost::beast::http::string_body> parser;
    parser.body_limit(64 << 20);
    parser.skip(verb == boost::beast::http::verb::head);
    boost::beast::error_code error;
    boost::beast::http::read(socket, buffer, parser, error);
    EXPECT_FALSE(error) << target << ": " << error.message();
    return parser.release();
  }
  Response get(const std::string& target, const Headers& headers = {}) {
    return send(boost::beast::http::verb::get, target, "", headers);
  }
  Response post(const std::string& target, const std::string& body = "{}", Headers headers = {}) {
    headers.try_emplace("Content-Type", "application/json");
    return send(boost::beast::http::verb::post, target, body, headers);
  }
  boost::asio::io_context& io() { return io_; }

 private:
  std::string port_file() const { return (pages_.path() / "port").string(); }
  void read_port() {
    EXPECT_TRUE(eventually([&] { return std::filesystem::exists(port_file()); }));
    port_ = static_cast<std::uint16_t>(std::stoi(read_file(port_file()).value()));
  }

  TemporaryFolder pages_;
  std::unique_ptr<Farm> farm_;
  std::uint16_t port_ = 0;
  boost::asio::io_context io_;
};

}  // namespace lightmill::test
