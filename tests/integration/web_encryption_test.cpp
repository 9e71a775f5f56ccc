// Encryption of the page: certificates, and requests without encryption.
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "tests/integration/secure_web.h"
#include "tests/support/movable_clock.h"

namespace lightmill::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

TEST(WebAccess, PlainHttpIsRedirectedToHttpsAndGetsNothingElse) {
  SecureWeb web;
  const std::string token = web.token("ada", {Role::view});
  const auto ask = [&](http::verb verb, const std::string& target) {
    beast::tcp_stream stream(web.socket());
    http::request<http::string_body> request(verb, target, 11);
    request.set(http::field::host, web.host());
    request.set(http::field::authorization, "Bearer " + token);
    request.body() = verb == http::verb::post ? std::string(1000, ' ') : "";
    request.prepare_payload();
    http::write(stream, request);
    beast::flat_buffer buffer;
    Response response;
    http::read(stream, buffer, response);
    if (verb == http::verb::get) {
      beast::error_code error;
      http::response<http::string_body> more;
      http::read(stream, buffer, more, error);
      EXPECT_EQ(error, http::error::end_of_stream) << "it closes the connection";
    }
    return response;
  };
  for (const http::verb verb : {http::verb::get, http::verb::post}) {
    const Response response = ask(verb, "/api/v1/jobs?page_size=2");
    EXPECT_EQ(response.result_int(), 307u);
    EXPECT_EQ(response[http::field::location], "https://" + web.host() + "/api/v1/jobs?page_size=2");
    EXPECT_EQ(response.count("Strict-Transport-Security"), 0u) << "plain HTTP can be forged on its way";
    EXPECT_NE(response.body().find("https://"), std::string::npos);
    EXPECT_EQ(response.body().find("jobs"), std::string::npos);
  }
  EXPECT_EQ(web.get("/api/v1/jobs", bearer(token)).result_int(), 200u) << "other calls continue";
}

TEST(WebAccess, EncryptedAnswersTellBrowsersToStayEncrypted) {
  SecureWeb web;
  for (const char* const path : {"/", "/none", "/api/v1/farm", "/api/v1/jobs"}) {
    EXPECT_EQ(web.get(path)["Strict-Transport-Security"], "max-age=31536000") << path;
  }
}

TEST(WebAccess, ARenewedCertificateComesIntoUseWithoutARestart) {
  SecureWeb web;
  const auto serial = [&]() -> std::string {
    beast::error_code error;
    TlsStream stream = web.connect(error);
    X509* const shown = error ? nullptr : ::SSL_get_peer_certificate(stream.native_handle());
    if (shown == nullptr) {
      return "";
    }
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    ::X509_digest(shown, ::EVP_sha256(), digest.data(), &size);
    ::X509_free(shown);
    return {reinterpret_cast<const char*>(digest.data()), size};
  };
  const std::string before = serial();
  EXPECT_FALSE(before.empty());
  web.secure().renew_server(today());
  EXPECT_TRUE(eventually([&] { return !serial().empty() && serial() != before; }));
  web.secure().write("server.pem", "no certificate");
  EXPECT_TRUE(eventually([&] {
    return web.secure().farm().server_log().find("the new certificate files cannot be used") != std::string::npos;
  }));
  EXPECT_FALSE(serial().empty()) << "earlier readings stay";
}

TEST(WebAccess, FailedHandshakesAreLoggedWithTheirPeersTenAtOnce) {
  SecureWeb web;
  asio::io_context io;
  asio::ssl::context trusting_nobody(asio::ssl::context::tls_client);
  const auto log_lines = [&] {
    return web.secure().farm().times_said("server", "a TLS handshake on the port of --http with 127.0.0.1:");
  };
  EXPECT_EQ(web.get("/api/v1/farm").result_int(), 401u);
  EXPECT_EQ(log_lines(), 0);
  for (int i = 1; i <= 30; ++i) {
    TlsStream stream(web.socket(), trusting_nobody);
    stream.set_verify_mode(asio::ssl::verify_peer);
    beast::error_code error;
    stream.handshake(asio::ssl::stream_base::client, error);
    EXPECT_TRUE(error);
    if (i == 1) {
      EXPECT_TRUE(eventually([&] { return web.secure().farm().times_said("server", "alert unknown ca") == 1; }));
    }
  }
  EXPECT_EQ(web.get("/api/v1/farm").result_int(), 401u) << "by now, it has seen the others";
  EXPECT_GE(log_lines(), 10);
  EXPECT_LT(log_lines(), 20) << "one a minute";
}

TEST(WebAccess, PlainHttpGetsNoAnswer) {
  SecureWeb web;
  tcp::socket plain = web.socket();
  beast::error_code error;
  asio::write(plain, asio::buffer("GET /api/v1/farm HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", 49), error);
  std::string answer;
  asio::read(plain, asio::dynamic_buffer(answer), error);
  EXPECT_EQ(answer.find("HTTP/1.1 200"), std::string::npos) << answer;
  EXPECT_EQ(web.get("/api/v1/farm").result_int(), 401u) << "it still serves others";
}

}  // namespace
}  // namespace lightmill::test
