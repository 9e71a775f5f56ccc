// A farm with authentication and a page, and encrypted requests to it.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>

#include <nlohmann/json.hpp>

#include "tests/integration/secure_farm.h"
#include "tests/integration/web_farm.h"

namespace lightmill::test {

using TlsStream = boost::beast::ssl_stream<boost::beast::tcp_stream>;

inline Headers bearer(const std::string& token) {
  return {{"Authorization", "Bearer " + token}};
}

/// A farm with authentication and a page.
class SecureWeb {
 public:
  explicit SecureWeb(const Environment& environment = {})
      : secure_({"--http", "127.0.0.1:0", "--http-port-file", (folder_.path() / "port").string()},
                {"127.0.0.1", {}, environment}) {
    trusted_.add_certificate_authority(boost::asio::buffer(secure_.authority().certificate));
  }

  SecureFarm& secure() { return secure_; }
  std::shared_ptr<grpc::Channel> channel(const std::string& name, Roles roles) {
    return secure_.channel(secure_.person(name, roles));
  }
  std::string token(const std::string& name, Roles roles, std::int64_t until_unix_s = now_unix_s() + kDay) {
    return token_for(channel("root", {Role::admin}), name, roles, until_unix_s);
  }
  void revoke(const std::string& token) {
    v1::RevokeTokenRequest revoke;
    revoke.set_id(token_id(token).value());
    v1::RevokeTokenResponse response;
    grpc::ClientContext context;
    const auto stub = v1::AccessService::NewStub(channel("root", {Role::admin}));
    EXPECT_TRUE(stub->RevokeToken(&context, revoke, &response).ok());
  }

  int port() const {
    const std::string file = (folder_.path() / "port").string();
    EXPECT_TRUE(eventually([&] { return std::filesystem::exists(file); }));
    return std::stoi(read_file(file).value());
  }
  std::string host() const { return fmt::format("127.0.0.1:{}", port()); }
  boost::asio::ip::tcp::socket socket() {
    boost::asio::ip::tcp::socket made(io_);
    made.connect({boost::asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(port())});
    return made;
  }
  /// Connects only if the coordinator's certificate is valid.
  TlsStream connect(boost::beast::error_code& error) {
    TlsStream stream(socket(), trusted_);
    stream.set_verify_mode(boost::asio::ssl::verify_peer);
    stream.set_verify_callback(boost::asio::ssl::host_name_verification("127.0.0.1"));
    stream.handshake(boost::asio::ssl::stream_base::client, error);
    return stream;
  }
  Response send(boost::beast::http::verb verb, const std::string& target, const Headers& headers = {},
                const std::string& body = "{}") {
    boost::beast::http::request<boost::beast::http::string_body> request(verb, target, 11);
    request.set(boost::beast::http::field::host, host());
    if (verb == boost::beast::http::verb::post) {
      request.set(boost::beast::http::field::content_type, "application/json");
      request.body() = body;
    }
    for (const auto& [name, value] : headers) {
      request.set(name, value);
    }
    request.prepare_payload();
    boost::beast::error_code error;
    TlsStream stream = connect(error);
    EXPECT_FALSE(error) << error.message();
    boost::beast::http::write(stream, request, error);
    boost::beast::flat_buffer buffer;
    Response response;
    boost::beast::http::read(stream, buffer, response, error);
    EXPECT_FALSE(error) << target << ": " << error.message();
    return response;
  }
  Response get(const std::string& target, const Headers& headers = {}) {
    return send(boost::beast::http::verb::get, target, headers);
  }
  Response log_in(const std::string& token) {
    return send(boost::beast::http::verb::post, "/api/v1/login", {}, nlohmann::json{{"token", token}}.dump());
  }
  /// The header of a logged-in browser.
  Headers cookie_of(const std::string& token) {
    const std::string cookie(log_in(token)[boost::beast::http::field::set_cookie]);
    return {{"Cookie", cookie.substr(0, cookie.find(';'))}};
  }

 private:
  TemporaryFolder folder_;
  SecureFarm secure_;
  boost::asio::io_context io_;
  boost::asio::ssl::context trusted_{boost::asio::ssl::context::tls_client};
};

}  // namespace lightmill::test
