// Requests over HTTP that the coordinator refuses, bounds or lets wait.
#include <sys/resource.h>

#include <atomic>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <random>
#include <thread>

#include "tests/integration/live_page.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;

TEST(Web, OtherPagesAndOtherNamesAreRefused) {
  WebFarm web;
  EXPECT_EQ(web.get("/", {{"Host", "evil.example"}}).result_int(), 403u);
  EXPECT_EQ(web.get("/api/v1/jobs", {{"Host", "evil.example"}}).result_int(), 403u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/cancel", "{}", {{"Origin", "http://evil.example"}}).result_int(), 403u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/cancel", "{}", {{"Sec-Fetch-Site", "cross-site"}}).result_int(), 403u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/cancel", "", {{"Content-Type", "text/plain"}}).result_int(), 400u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/cancel", "{}", {{"Origin", "http://" + web.host()}}).result_int(), 404u)
      << "the page's own may; there is no such job";
  EXPECT_EQ(Page(web, {{"Origin", "http://evil.example"}}).error, websocket::error::upgrade_declined);
  EXPECT_FALSE(Page(web, {{"Origin", "http://" + web.host()}}).error);
}

TEST(Web, RequestsAreBounded) {
  WebFarm web;
  EXPECT_EQ(web.get("/", {{"X-Long", std::string(20'000, 'x')}}).result_int(), 431u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/extend", std::string(20'000, ' ')).result_int(), 413u);
  Page page(web);
  page.send(std::string(5'000, 'x'));
  page.read();
  EXPECT_TRUE(page.error) << "the coordinator closes it";
  Page babbler(web);
  babbler.send("\xff\xff\xff");
  babbler.read();
  EXPECT_EQ(babbler.close_code(), websocket::close_code::policy_error);
  EXPECT_EQ(web.get("/").result_int(), 200u);
}

/// Everything that comes back until the connection ends.
std::string answers_to(WebFarm& web, const std::string& bytes) {
  tcp::socket socket = web.connect();
  beast::error_code error;
  asio::write(socket, asio::buffer(bytes), error);
  socket.shutdown(tcp::socket::shutdown_send, error);  // no more input to wait for
  std::string answers;
  asio::read(socket, asio::dynamic_buffer(answers), error);
  return answers;
}

TEST(Web, AmbiguousRequestsAreRefused) {
  WebFarm web;
  const std::string post = "POST /api/v1/jobs/1/cancel HTTP/1.1\r\nContent-Type: application/json\r\n";
  const std::string host = "Host: 127.0.0.1\r\n", chunked = "Transfer-Encoding: chunked\r\n";
  const std::string chunks = "2\r\n{}\r\n0\r\n\r\n", next = "GET /next HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
  for (const std::string& head : {
           "GET / HTTP/1.1\r\n" + host + host,
           "GET / HTTP/1.1\r\n" + host + "Host: evil.example\r\n",
           std::string("GET / HTTP/1.1\r\n"),
           "GET / HTTP/1.1\r\n" + std::string("Host : 127.0.0.1\r\n"),
           "GET / HTTP/1.1\r\n" + std::string("Host: 127.0.0.1:80:90\r\n"),
           "GET / HTTP/1.1\r\n" + std::string("Host:\r\n"),
           post + host + "Content-Length: 2\r\nContent-Length: 40\r\n",
           post + host + "Content-Length: 2\r\nContent-Length: 2\r\n",
           post + host + "Content-Length: 2, 40\r\n",
           post + host + "Content-Length: +2\r\n",
           post + host + "Content-Length: 2\r\n" + chunked,
           post + host + chunked + "Content-Length: 2\r\n",
           post + host + chunked + chunked,
           post + host + "Transfer-Encoding: gzip, chunked\r\n",
           post + host + "Transfer-Encoding: chunked, identity\r\n",
           post + host + "Transfer-Encoding: xchunked\r\n",
           "POST /api/v1/jobs/1/cancel HTTP/1.0\r\nContent-Type: application/json\r\n" + host + chunked,
       }) {
    const std::string answers = answers_to(web, head + "\r\n" + chunks + next);
    EXPECT_EQ(answers.find("HTTP/1."), 0u) << head;
    EXPECT_EQ(answers.substr(8, 5), " 400 ") << head << answers;
    EXPECT_EQ(answers.find("\nHTTP/1."), std::string::npos) << "the rest gets no answer: " << head << answers;
  }
  const std::string once = answers_to(
      web, post + host + chunked + "\r\n" + chunks + "GET / HTTP/1.1\r\n" + host + "Connection: close\r\n\r\n");
  EXPECT_EQ(once.find("HTTP/1.1 404"), 0u) << "chunks alone are fine, and there is no such job";
  EXPECT_NE(once.find("HTTP/1.1 200"), std::string::npos) << once;
}

TEST(Web, GarbageDoesNoHarm) {
  WebFarm web;
  std::mt19937 random(11);
  const std::string request =
      "POST /api/v1/jobs/1/extend HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: "
      "application/json\r\nContent-Length: 15\r\nUpgrade: websocket\r\n\r\n{\"samples\": \"2\"}";
  for (int round = 0; round < 300; ++round) {
    std::string bytes = request;
    for (int i = 0; i < 1 + round % 7; ++i) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    tcp::socket socket = web.connect();
    beast::error_code ignored;
    asio::write(socket, asio::buffer(bytes), ignored);
    socket.close(ignored);
  }
  EXPECT_EQ(web.get("/").result_int(), 200u);
}

TEST(Web, ConnectionsWaitWhenFileDescriptorsRunOut) {
  WebFarm web({"--log-level", "debug"});
  const pid_t server = web.farm().server().pid();
  rlim_t next = 0;  // the first unused descriptor number
  while (std::filesystem::exists(std::filesystem::symlink_status(fmt::format("/proc/{}/fd/{}", server, next)))) {
    ++next;
  }
  rlimit before{};
  ASSERT_EQ(::prlimit(server, RLIMIT_NOFILE, nullptr, &before), 0);
  const rlimit none{next, before.rlim_max};
  ASSERT_EQ(::prlimit(server, RLIMIT_NOFILE, &none, nullptr), 0);
  std::vector<tcp::socket> silent;  // they take the free descriptor numbers below
  for (int i = 0; i < 20; ++i) {
    silent.push_back(web.connect());
  }
  const auto tries = [&] {
    return web.farm().times_said("server",
                                 fmt::format("port {} cannot accept a connection: Too many open files", web.port()));
  };
  EXPECT_TRUE(eventually([&] { return tries() > 0; }));
  std::atomic<bool> answered = false;
  std::jthread caller([&] {
    EXPECT_EQ(web.get("/").result_int(), 200u);
    answered = true;
  });
  EXPECT_TRUE(eventually([&] { return tries() >= 5; }));
  EXPECT_FALSE(answered);
  ASSERT_EQ(::prlimit(server, RLIMIT_NOFILE, &before, nullptr), 0);
  caller.join();
}

TEST(Web, WithoutACertificateOnlyThisMachineIsServed) {
  const auto start = [](std::vector<std::string> options) {
    const TemporaryFolder folder;
    options.insert(options.begin(), program("lightmill-server"));
    options.insert(options.end(), {"--data", (folder.path() / "data").string(), "--listen", "127.0.0.1:0"});
    return run_command(options);
  };
  const CommandResult outside = start({"--http", "0.0.0.0:0"});
  EXPECT_EQ(outside.exit_code, 2);
  EXPECT_NE(outside.err.find("--tls-cert"), std::string::npos) << outside.err;
  EXPECT_NE(outside.err.find("ssh -L"), std::string::npos) << outside.err;
  EXPECT_EQ(start({"--http", "0.0.0.0:0", "--authenticate"}).exit_code, 2) << "others could read the tokens";
  EXPECT_EQ(start({"--http", "nonsense"}).exit_code, 2);
  EXPECT_EQ(start({"--http-port-file", "x"}).exit_code, 2);
  EXPECT_EQ(start({"--http-name", "x"}).exit_code, 2);
  WebFarm web;
  const CommandResult taken = start({"--http", web.host()});
  EXPECT_EQ(taken.exit_code, 1);
  EXPECT_NE(taken.err.find("cannot listen on " + web.host()), std::string::npos) << taken.err;
}

}  // namespace
}  // namespace lightmill::test
