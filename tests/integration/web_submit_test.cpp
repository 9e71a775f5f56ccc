// Jobs and assets over HTTP, on real connections: what is accepted, what is refused, and what remains of unfinished
// uploads.
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include <nlohmann/json.hpp>
#include <thread>

#include "tests/integration/web_farm.h"
#include "tests/support/small_disk.h"
#include "tests/support/tcp_sockets.h"

namespace lightmill::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace fs = std::filesystem;
namespace http = beast::http;
using asio::ip::tcp;
using google::protobuf::util::JsonStringToMessage;
using nlohmann::json;

const Headers kBytes{{"Content-Type", "application/octet-stream"}};

std::string asset_path(std::string_view bytes) {
  return "/api/v1/assets/" + sha256(bytes).hex();
}

bool says(const Response& response, const std::string& part) {
  return response.body().find(part) != std::string::npos;
}

int files_in(const fs::path& folder) {
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}
/// Number of uploads in progress.
int incoming(WebFarm& web) {
  return files_in(web.farm().data() / "assets" / "incoming");
}

/// A connection with a request that the test sends piece by piece.
class RawRequest {
 public:
  RawRequest(WebFarm& web, const std::string& path, const std::string& type, const std::string& headers,
             const std::string& from = "127.0.0.1")
      : socket_(web.connect(from)) {
    send(fmt::format("POST {} HTTP/1.1\r\nHost: {}\r\nContent-Type: {}\r\n{}\r\n", path, web.host(), type, headers));
  }
  /// An asset of this many bytes.
  RawRequest(WebFarm& web, const std::string& path, std::size_t length)
      : RawRequest(web, path, "application/octet-stream", fmt::format("Content-Length: {}\r\n", length)) {}

  void send(std::string_view bytes) { asio::write(socket_, asio::buffer(bytes.data(), bytes.size()), error); }
  /// Reads one header: an interim answer or the final one.
  std::string read_head() {
    asio::read_until(socket_, asio::dynamic_buffer(got_), "\r\n\r\n", error);
    const std::size_t end = got_.find("\r\n\r\n");
    const std::string head = got_.substr(0, end);
    got_.erase(0, end == std::string::npos ? got_.size() : end + 4);
    return head;
  }
  Response read() {
    beast::flat_buffer buffer;
    Response response;
    http::read(socket_, buffer, response, error);
    return response;
  }
  /// Whether the coordinator has read everything that was sent.
  bool is_read() const {
    const unsigned port = socket_.local_endpoint().port();
    return std::ranges::any_of(tcp_sockets(), [port](const TcpSocket& socket) {
      return socket.remote_port == port && socket.unread_bytes == 0;
    });
  }
  void close() { socket_.close(error); }
  bool closed_by_server() {
    beast::error_code now;
    char byte = 0;
    socket_.non_blocking(true);
    socket_.read_some(asio::buffer(&byte, 1), now);
    return now && now != asio::error::would_block;
  }

  beast::error_code error;

 private:
  tcp::socket socket_;
  std::string got_;
};

Picture submitted_picture() {
  Picture picture;
  picture.side = 64;
  picture.samples = 16;
  return picture;
}

TEST(WebSubmit, AJobWithItsAssetsGivesTheSameBits) {
  WebFarm web;
  const JobSpec spec = job_of(submitted_picture(), "over http");
  v1::FindMissingAssetsRequest digests;
  for (const Sha256& digest : *spec.settings.assets) {
    digests.add_digests(std::string(digest.bytes.begin(), digest.bytes.end()));
  }
  ASSERT_GT(digests.digests_size(), 0);
  const auto missing = [&] {
    v1::FindMissingAssetsResponse response;
    const Response answer = web.post("/api/v1/assets/missing", json_of(digests));
    EXPECT_TRUE(JsonStringToMessage(answer.body(), &response).ok()) << answer.body();
    return response.missing_size();
  };
  EXPECT_EQ(missing(), digests.digests_size());
  const Response early = web.post("/api/v1/jobs", submit_body(spec));
  EXPECT_EQ(early.result_int(), 409u);
  EXPECT_TRUE(says(early, "is missing: upload it first")) << early.body();
  for (const auto& [digest, bytes] : bench_box().assets) {
    const Response stored = web.send(http::verb::post, "/api/v1/assets/" + digest.hex(), bytes, kBytes);
    EXPECT_EQ(stored.result_int(), 200u) << stored.body();
    EXPECT_EQ(stored.body(), "{}\n");
  }
  EXPECT_EQ(missing(), 0);

  const Response submitted = web.post("/api/v1/jobs", submit_body(spec));
  ASSERT_EQ(submitted.result_int(), 200u) << submitted.body();
  const std::string id = json::parse(submitted.body())["id"];
  EXPECT_EQ(json::parse(web.post("/api/v1/jobs", submit_body(spec)).body())["id"], id) << "the same request again";
  EXPECT_EQ(json::parse(web.get("/api/v1/jobs").body())["jobs"].size(), 1u);
  v1::JobSpec kept, sent;
  to_wire(spec, &sent);
  ASSERT_TRUE(JsonStringToMessage(web.get("/api/v1/jobs/" + id + "/spec").body(), &kept).ok());
  EXPECT_EQ(kept.SerializeAsString(), sent.SerializeAsString());

  EXPECT_EQ(web.post("/api/v1/jobs/" + id + "/delete").result_int(), 409u) << "it has not ended";
  JobSpec again = spec;
  again.request_id += " again";
  const std::string other = json::parse(web.post("/api/v1/jobs", submit_body(again)).body())["id"];
  EXPECT_EQ(web.post("/api/v1/jobs/" + other + "/delete", R"({"cancel": true})").body(), "{}\n");
  EXPECT_EQ(web.get("/api/v1/jobs/" + other).result_int(), 404u);
  web.farm().add_worker(1, "w");
  expect_reference_film(web.farm().client(), std::stoull(id), submitted_picture());
  EXPECT_EQ(web.post("/api/v1/jobs/" + id + "/delete").body(), "{}\n");
  for (const char* what : {"", "/spec"}) {
    EXPECT_EQ(web.get("/api/v1/jobs/" + id + what).result_int(), 404u);
  }
  EXPECT_EQ(web.post("/api/v1/jobs/" + id + "/delete").result_int(), 404u);
}

TEST(WebSubmit, AnInvalidJobIsRefusedWithItsField) {
  WebFarm web;
  EXPECT_TRUE(says(web.post("/api/v1/jobs", "{}"), "request_id"));
  EXPECT_EQ(web.post("/api/v1/jobs", "{\"request_id\": ").result_int(), 400u);
  EXPECT_EQ(web.post("/api/v1/jobs", R"({"request_id": "1", "what": 2})").result_int(), 400u);
  JobSpec spec = job_of(submitted_picture(), "no width");
  spec.settings.assets = {};
  spec.settings.width = 0;
  EXPECT_TRUE(says(web.post("/api/v1/jobs", submit_body(spec)), "width"));
  EXPECT_EQ(web.post("/api/v1/assets/missing", R"({"digests": ["AAAA"]})").result_int(), 400u);
  EXPECT_EQ(web.get("/api/v1/jobs/1/spec").result_int(), 404u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/spec").result_int(), 405u);
  EXPECT_EQ(web.get("/api/v1/jobs/1/delete").result_int(), 405u);
  EXPECT_EQ(web.get("/api/v1/assets/missing").result_int(), 405u);
}

TEST(WebSubmit, LargeScenesAreStoredAndReturnedWhole) {
  WebFarm web;
  JobSpec spec = job_of(submitted_picture(), "large");
  spec.settings.assets = {};
  spec.settings.scene = std::string(std::size_t{16} << 20, '\xff');
  const Response refused = web.post("/api/v1/jobs", submit_body(spec));
  EXPECT_EQ(refused.result_int(), 400u);
  EXPECT_TRUE(says(refused, "a packed scene of 16777216 bytes is damaged"));
  spec.settings.renderer_version = "another";  // may read it
  const Response submitted = web.post("/api/v1/jobs", submit_body(spec));
  ASSERT_EQ(submitted.result_int(), 200u) << submitted.body().substr(0, 500);
  const std::string id = json::parse(submitted.body())["id"];
  v1::JobSpec kept;
  ASSERT_TRUE(JsonStringToMessage(web.get("/api/v1/jobs/" + id + "/spec").body(), &kept).ok());
  EXPECT_TRUE(kept.settings().scene() == *spec.settings.scene);
  spec.settings.scene = *spec.settings.scene + '\xff';
  EXPECT_EQ(web.post("/api/v1/jobs", submit_body(spec)).result_int(), 400u) << "more than gRPC takes";
  EXPECT_EQ(web.post("/api/v1/jobs", std::string((std::size_t{24} << 20) + 1, ' ')).result_int(), 413u);
  EXPECT_EQ(web.post("/api/v1/assets/missing", std::string((std::size_t{1} << 20) + 1, ' ')).result_int(), 413u);
  EXPECT_EQ(web.post("/api/v1/jobs/1/extend", std::string(20'000, ' ')).result_int(), 413u) << "others stay small";
}

TEST(WebSubmit, LargeBodiesOfOneCallerAndOfAllHaveALimit) {
  WebFarm web;
  const std::string length = fmt::format("Content-Length: {}\r\n", std::size_t{24} << 20);
  std::vector<std::unique_ptr<RawRequest>> waiting;
  const auto hold = [&](const std::string& caller, int requests) {
    for (int i = 0; i < requests; ++i) {
      waiting.push_back(std::make_unique<RawRequest>(web, "/api/v1/jobs", "application/json", length, caller));
      waiting.back()->send(std::string(std::size_t{23} << 20, ' '));
    }
  };
  const std::string large = "{" + std::string(std::size_t{20} << 20, ' ') + "}";
  const auto answer = [&](const std::string& body, const std::string& caller = "127.0.0.1") {
    RawRequest request(web, "/api/v1/jobs", "application/json", fmt::format("Content-Length: {}\r\n", body.size()),
                       caller);
    request.send(body);
    return request.read().result_int();
  };
  // A busy machine may drop held requests before all are there. Then the test holds one more.
  const auto is_full = [&](const std::string& caller, const std::function<std::string()>& other) {
    return eventually([&] {
      const bool full = answer(large, caller) == 503;
      if (!full) {
        hold(other(), 1);
      }
      return full;
    });
  };
  hold("127.0.0.1", 6);  // of 128 MiB
  EXPECT_TRUE(is_full("127.0.0.1", [] { return "127.0.0.1"; }));
  EXPECT_EQ(answer("{}"), 400u) << "small ones are accepted";
  EXPECT_EQ(answer(large, "127.0.0.2"), 400u) << "it is accepted, but it is no job";
  hold("127.0.0.2", 6);
  hold("127.0.0.3", 1);  // of 256 MiB together
  int others = 3;
  EXPECT_TRUE(is_full("127.0.0.3", [&] { return fmt::format("127.0.0.{}", ++others); }));
  RawRequest slow(web, "/api/v1/jobs/1/cancel", "application/json", "Content-Length: 2\r\n");
  slow.send("{");
  EXPECT_TRUE(eventually([&] { return slow.is_read(); }));
  slow.send("}");
  EXPECT_EQ(slow.read().result_int(), 404u) << "also where they come in pieces";
  waiting.clear();
  EXPECT_TRUE(eventually([&] { return answer(large) == 400 && answer(large, "127.0.0.3") == 400; }));
}

TEST(WebSubmit, AnAssetThatDoesNotMatchItsNameIsRefused) {
  WebFarm web;
  const auto send = [&](const std::string& path, const std::string& bytes, const std::string& type) {
    return web.send(http::verb::post, path, bytes, {{"Content-Type", type}});
  };
  const Response wrong = send(asset_path("one"), "two", "application/octet-stream");
  EXPECT_EQ(wrong.result_int(), 400u);
  EXPECT_TRUE(says(wrong, sha256("two").hex())) << wrong.body();
  EXPECT_EQ(send("/api/v1/assets/one", "one", "application/octet-stream").result_int(), 400u);
  EXPECT_EQ(send("/api/v1/assets/", "one", "application/octet-stream").result_int(), 400u);
  EXPECT_EQ(send(asset_path("one"), "one", "application/json").result_int(), 400u);
  EXPECT_EQ(send(asset_path("one"), "one", "text/plain").result_int(), 400u);
  EXPECT_EQ(files_in(web.farm().data() / "assets"), 1) << "nothing but the folder of uploads";
  EXPECT_EQ(incoming(web), 0);
  EXPECT_EQ(send(asset_path(""), "", "application/octet-stream").result_int(), 200u);
  EXPECT_EQ(send(asset_path("one"), "one", "application/octet-stream").result_int(), 200u);
  EXPECT_EQ(send(asset_path("one"), "one", "application/octet-stream").result_int(), 200u) << "again";
  RawRequest chunked(web, asset_path("in two parts"), "application/octet-stream", "Transfer-Encoding: chunked\r\n");
  chunked.send("7\r\nin two \r\n5\r\nparts\r\n0\r\n\r\n");
  EXPECT_EQ(chunked.read().result_int(), 200u);
  RawRequest polite(web, asset_path("asks"), "application/octet-stream",
                    "Content-Length: 4\r\nExpect: 100-continue\r\n");
  EXPECT_TRUE(polite.read_head().starts_with("HTTP/1.1 100 Continue"));
  polite.send("asks");
  EXPECT_EQ(polite.read().result_int(), 200u);
}

TEST(WebSubmit, OtherPagesCannotSend) {
  WebFarm web;
  const std::string evil = "http://evil.example";
  for (const auto& [name, value] : {std::pair{"Origin", evil}, std::pair{"Sec-Fetch-Site", std::string("cross-site")},
                                    std::pair{"Host", std::string("evil.example")}}) {
    for (const char* path : {"/api/v1/jobs", "/api/v1/assets/missing", "/api/v1/jobs/1/delete"}) {
      EXPECT_EQ(web.post(path, "{}", {{name, value}}).result_int(), 403u) << path << " with " << name;
    }
    Headers headers = kBytes;
    headers[name] = value;
    EXPECT_EQ(web.send(http::verb::post, asset_path("one"), "one", headers).result_int(), 403u) << name;
  }
  for (const char* path : {"/api/v1/jobs", "/api/v1/assets/missing"}) {
    EXPECT_EQ(web.post(path, "{}", {{"Content-Type", "text/plain"}}).result_int(), 400u);
  }
}

TEST(WebSubmit, ATooLargeAssetOfKnownLengthIsRefusedBeforeItsBytes) {
  WebFarm web({"--max-asset-gib", "0.001"});
  const std::string large(std::size_t{3} << 20, 'x');
  RawRequest announced(web, asset_path(large), large.size());
  const Response refused = announced.read();
  EXPECT_EQ(refused.result_int(), 503u);
  EXPECT_TRUE(says(refused, "is larger than the limit of ")) << refused.body();
  const Response sent = web.send(http::verb::post, asset_path(large), large, kBytes);
  EXPECT_EQ(sent.result_int(), 503u) << "also if everything was sent by then";
  RawRequest chunked(web, asset_path(large), "application/octet-stream", "Transfer-Encoding: chunked\r\n");
  chunked.send(fmt::format("{:x}\r\n{}\r\n0\r\n\r\n", large.size(), large));
  EXPECT_EQ(chunked.read().result_int(), 503u);
  EXPECT_TRUE(eventually([&] { return incoming(web) == 0; }));
}

TEST(WebSubmit, AnUploadThatIsCutLeavesNothing) {
  WebFarm web;
  const std::string bytes(std::size_t{1} << 20, 'x');
  RawRequest cut(web, asset_path(bytes), bytes.size());
  cut.send(std::string_view(bytes).substr(0, bytes.size() / 2));
  EXPECT_TRUE(eventually([&] { return incoming(web) == 1; }));
  cut.close();
  EXPECT_TRUE(eventually([&] { return incoming(web) == 0; }));
  EXPECT_EQ(web.send(http::verb::post, asset_path(bytes), bytes, kBytes).result_int(), 200u);
}

TEST(WebSubmit, AStoppingCoordinatorLeavesNothing) {
  WebFarm web;
  const std::string bytes(std::size_t{64} << 20, 'x');
  RawRequest waits(web, asset_path("waits"), 5),
      job(web, "/api/v1/jobs", "application/json", "Content-Length: 99999\r\n");
  std::vector<std::jthread> senders;
  for (char name = 'a'; name < 'e'; ++name) {  // more than there are threads for the disk
    senders.emplace_back([&web, &bytes, name] {
      RawRequest sends(web, asset_path(std::string(1, name)), bytes.size() + 1);
      sends.send(bytes);
      sends.read();
    });
  }
  EXPECT_TRUE(eventually([&] { return incoming(web) == 5; }));
  web.farm().server().send(SIGTERM);
  EXPECT_EQ(web.farm().server().wait(), 0);
  EXPECT_EQ(incoming(web), 0);
}

TEST(WebSubmit, TheSameAssetSentTwiceAtOnceIsStoredOnce) {
  WebFarm web;
  const std::string bytes(std::size_t{1} << 20, 'y');
  RawRequest first(web, asset_path(bytes), bytes.size());
  first.send(std::string_view(bytes).substr(0, bytes.size() / 2));
  EXPECT_TRUE(eventually([&] { return incoming(web) == 1; }));
  EXPECT_EQ(web.send(http::verb::post, asset_path(bytes), bytes, kBytes).result_int(), 200u);
  first.send(std::string_view(bytes).substr(bytes.size() / 2));
  EXPECT_EQ(first.read().result_int(), 200u);
  EXPECT_EQ(incoming(web), 0);
  const std::string hex = sha256(bytes).hex();
  EXPECT_TRUE(read_file(web.farm().data() / "assets" / hex.substr(0, 2) / hex.substr(2)).value() == bytes);
}

TEST(WebSubmit, UploadsOfOneCallerHaveALimit) {
  WebFarm web({"--caller-streams", "2"});
  RawRequest first(web, asset_path("first"), 5), second(web, asset_path("second"), 6);
  EXPECT_TRUE(eventually([&] { return incoming(web) == 2; }));
  const Response third = web.send(http::verb::post, asset_path("third"), "third", kBytes);
  EXPECT_EQ(third.result_int(), 503u);
  EXPECT_TRUE(says(third, "--caller-streams")) << third.body();
  first.send("first");
  EXPECT_EQ(first.read().result_int(), 200u);
  EXPECT_TRUE(eventually(
      [&] { return web.send(http::verb::post, asset_path("third"), "third", kBytes).result_int() == 200u; }));
}

TEST(WebSubmit, EveryRequestCountsTowardsTheLimitOfItsCaller) {
  WebFarm web({"--caller-requests", "2"});  // and 20 at once
  const auto refused = [&](const auto& ask) {
    for (int i = 0; i < 100; ++i) {
      if (const Response response = ask(); response.result_int() == 503u) {
        return says(response, "--caller-requests");
      }
    }
    return false;
  };
  EXPECT_TRUE(refused([&] { return web.get("/api/v1/farm"); }));
  EXPECT_TRUE(refused([&] { return web.post("/api/v1/logout"); }));
  EXPECT_TRUE(refused([&] { return web.post("/api/v1/jobs"); }));
  EXPECT_TRUE(refused([&] { return web.post("/api/v1/assets/missing"); }));
  EXPECT_EQ(web.send(http::verb::post, asset_path("one"), "one", kBytes).result_int(), 200u) << "as over gRPC";
}

TEST(WebSubmit, ATooSlowRequestIsDisconnected) {
  constexpr auto kSilence = std::chrono::seconds(5);
  WebFarm web({"--http-seconds", std::to_string(kSilence.count())});
  const auto start = std::chrono::steady_clock::now();
  RawRequest silent(web, asset_path("silent"), 1'000'000), slow(web, asset_path("slow"), 1'000'000);
  RawRequest job(web, "/api/v1/jobs", "application/json", "Content-Length: 1000000\r\n");
  silent.send("x");
  EXPECT_TRUE(eventually([&] {
    slow.send("x");
    job.send(" ");
    EXPECT_EQ(web.get("/").result_int(), 200u) << "no other request waits for them";
    return slow.closed_by_server();
  }));
  EXPECT_GE(std::chrono::steady_clock::now() - start, kSilence) << "not before";
  EXPECT_TRUE(eventually([&] { return silent.closed_by_server() && job.closed_by_server() && incoming(web) == 0; }));
}

TEST(WebSubmit, IdleLargeRequestsDelayNoOtherCaller) {
  WebFarm web;
  std::vector<std::unique_ptr<RawRequest>> idle;
  for (int i = 0; i < 20; ++i) {
    idle.push_back(
        std::make_unique<RawRequest>(web, "/api/v1/jobs", "application/json", "Content-Length: 25000000\r\n"));
    idle.back()->send("{");
  }
  // Far more than a small body, and no job.
  const Response answer = web.post("/api/v1/jobs", "{" + std::string(8'000'000, ' ') + "}");
  EXPECT_EQ(answer.result_int(), 400u) << answer.body();
  EXPECT_TRUE(says(answer, "request_id")) << answer.body();
}

TEST(WebSubmit, AFullDiskIsNamedAndLeavesNothing) {
  const SmallDisk disk(64);
  if (!disk.mounted()) {
    GTEST_SKIP() << "cannot mount a disk (needs root)";
  }
  WebFarm web({"--reserve-gib", "0"});
  const std::string bytes(std::size_t{16} << 20, 'z');
  disk.fill(64);
  const Response refused = web.send(http::verb::post, asset_path(bytes), bytes, kBytes);
  EXPECT_EQ(refused.result_int(), 503u);
  EXPECT_EQ(json::parse(refused.body())["error"]["code"], "RESOURCE_EXHAUSTED");
  EXPECT_TRUE(says(refused, "No space left on device")) << refused.body();
  EXPECT_EQ(incoming(web), 0);
  disk.make_room();
  EXPECT_EQ(web.send(http::verb::post, asset_path(bytes), bytes, kBytes).result_int(), 200u);
}

}  // namespace
}  // namespace lightmill::test
