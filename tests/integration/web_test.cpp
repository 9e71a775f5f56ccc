// The coordinator's page and JSON API over real sockets: what is served and refused, and the limits.
#include <gtest/gtest.h>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <sys/resource.h>

#include <atomic>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "common/wire/bytes.h"
#include "lightmill/v1/web.pb.h"
#include "tests/integration/web_farm.h"
#include "tests/support/places.h"

namespace lightmill::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using nlohmann::json;
/// A viewer that reads only when the test asks for it.
class Page {
 public:
  explicit Page(WebFarm& farm, const Headers& headers = {}) : socket_(farm.connect()) {
    socket_.set_option(websocket::stream_base::decorator([headers](websocket::request_type& request) {
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
  void send(const std::string& bytes) { socket_.write(asio::buffer(bytes), error); }
  /// The next message. At the connection's end it is empty, with `error`.
  v1::ViewUpdate read() {
    beast::flat_buffer buffer;
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
  websocket::close_code close_code() const { return static_cast<websocket::close_code>(socket_.reason().code); }

  beast::error_code error;
  std::uint64_t received = 0;

 private:
  websocket::stream<tcp::socket> socket_;
};

Picture small_picture(std::uint64_t samples = 8) {
  Picture picture;
  picture.side = 96;
  picture.samples = samples;
  return picture;
}

TEST(Web, ServesThePageWithItsSecurityHeadersAndNoOtherFile) {
  WebFarm web;
  const Response page = web.get("/");
  EXPECT_EQ(page.result_int(), 200u);
  EXPECT_EQ(page.body(), "<p>the page</p>");
  EXPECT_NE(page["Content-Security-Policy"].find("default-src 'none'"), beast::string_view::npos);
  EXPECT_EQ(page["X-Content-Type-Options"], "nosniff");
  EXPECT_EQ(web.get("/", {{"If-None-Match", std::string(page[http::field::etag])}}).result_int(), 304u);
  EXPECT_EQ(web.get("/assets/a.js").body(), "let a;");
  const Response packed = web.get("/assets/a.js", {{"Accept-Encoding", "gzip, br"}});
  EXPECT_EQ(packed.body(), "packed");
  EXPECT_EQ(packed[http::field::content_encoding], "gzip");
  EXPECT_NE(packed[http::field::cache_control].find("immutable"), beast::string_view::npos);
  for (const char* target : {"/port", "/../port", "/assets/../../etc/passwd", "/%2e%2e/etc/passwd", "/etc/passwd"}) {
    EXPECT_EQ(web.get(target).result_int(), 404u) << target;
  }
  EXPECT_EQ(web.send(http::verb::head, "/").result_int(), 200u);
  EXPECT_EQ(web.send(http::verb::delete_, "/").result_int(), 405u);
}

TEST(Web, APathWithASlashLeadsToItsDocument) {
  WebFarm web;
  EXPECT_EQ(web.get("/docs").body(), "<p>the documents</p>");
  const Response moved = web.get("/docs/");
  EXPECT_EQ(moved.result_int(), 308u);
  EXPECT_EQ(moved[http::field::location], "../docs");
  for (const char* target : {"/assets/", "/nothing/", "/docs//", "/docs.html/x/"}) {
    const Response missing = web.get(target);
    EXPECT_EQ(missing.result_int(), 404u) << target;
    EXPECT_EQ(missing[http::field::location], "") << target;
  }
}

TEST(Web, JobsAndWorkersAreListedAndSteered) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::string job = std::to_string(client.submit(small_picture()).id());
  EXPECT_EQ(json::parse(web.get("/api/v1/farm").body())["renderer_version"], kRendererVersion);
  const json list = json::parse(web.get("/api/v1/jobs").body());
  ASSERT_EQ(list["jobs"].size(), 1u);
  EXPECT_EQ(list["jobs"][0]["id"], job);
  EXPECT_EQ(json::parse(web.get("/api/v1/jobs/" + job).body())["state"], "JOB_STATE_QUEUED");
  EXPECT_EQ(web.get("/api/v1/jobs/" + job + "/thumbnail.png").result_int(), 404u) << "no samples yet";

  const std::string path = "/api/v1/jobs/" + job;
  for (const char* const body : {"[", "{\"x\": 1}"}) {
    EXPECT_EQ(web.post(path + "/pause", body).result_int(), 400u) << body;
  }
  EXPECT_EQ(json::parse(web.post(path + "/pause").body())["state"], "JOB_STATE_PAUSED");
  EXPECT_EQ(json::parse(web.post(path + "/resume").body())["state"], "JOB_STATE_QUEUED");
  EXPECT_EQ(json::parse(web.post(path + "/extend", R"({"samples": "16"})").body())["goal"]["samples"], "16");
  EXPECT_EQ(web.post(path + "/extend", R"({"samples": "2"})").result_int(), 400u);
  EXPECT_EQ(json::parse(web.post(path + "/priority", R"({"priority": -3})").body())["priority"], -3);
  EXPECT_EQ(web.post(path + "/priority", R"({"priority": 3000000000})").result_int(), 400u);
  EXPECT_EQ(web.post(path + "/resume").result_int(), 409u);

  EXPECT_EQ(json::parse(web.get("/api/v1/workers").body())["wanted_workers"], 1);
  web.farm().add_worker(1, "w 1");
  client.wait_until_ended(std::stoull(job));
  const Response thumbnail = web.get(path + "/thumbnail.png");
  EXPECT_EQ(thumbnail[http::field::content_type], "image/png");
  EXPECT_EQ(thumbnail.body().substr(1, 3), "PNG");
  EXPECT_EQ(web.get(path + "/thumbnail.png").body(), thumbnail.body());
  EXPECT_EQ(json::parse(web.get("/api/v1/workers").body())["workers"][0]["name"], "w 1");
  const auto quarantined = [&](const std::string& body) {
    return json::parse(web.post("/api/v1/workers/w%201/quarantine", body).body()).value("quarantine", "");
  };
  EXPECT_EQ(quarantined(R"({"reason": "smells of smoke"})"), "put there by hand: smells of smoke");
  EXPECT_EQ(quarantined("{}"), "put there by hand: smells of smoke") << "the first reason stays";
  EXPECT_EQ(web.post("/api/v1/workers/w%201/quarantine", R"({"reason": "two\nlines"})").result_int(), 400u);
  EXPECT_EQ(json::parse(web.post("/api/v1/workers/w%201/release").body()).value("quarantine", ""), "");
  EXPECT_EQ(json::parse(web.post("/api/v1/workers/w%201/drain").body())["draining"], true);
  EXPECT_EQ(web.farm().worker("w 1").wait(), 0);

  EXPECT_EQ(json::parse(web.post("/api/v1/jobs/42/cancel").body())["error"]["code"], "NOT_FOUND");
  EXPECT_EQ(web.post(path + "/explode").result_int(), 404u);
  EXPECT_EQ(web.get(path + "/cancel").result_int(), 405u);
  EXPECT_EQ(web.get("/api/v1/nothing").result_int(), 404u);
  EXPECT_EQ(web.get("/api/v1/live").result_int(), 400u) << "it is a WebSocket";
  EXPECT_EQ(web.post(path + "/extend", "{\"samples\": ").result_int(), 400u);
  EXPECT_EQ(web.post("/api/v1/workers/%zz/drain").result_int(), 400u);
  EXPECT_EQ(json::parse(web.post("/api/v1/workers/unknown/release").body())["error"]["code"], "NOT_FOUND");
  EXPECT_EQ(web.get("/api/v1/workers/unknown/release").result_int(), 405u);
  EXPECT_EQ(web.post("/api/v1/workers/unknown").result_int(), 404u);
}

TEST(Web, AnEndedJobShowsItsLastPicture) {
  WebFarm web({"--unit-seconds", "0.05"});
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t job = client.submit(small_picture(1'000'000)).id();
  web.farm().add_worker(1, "w1");
  const std::string path = fmt::format("/api/v1/jobs/{}", job);
  ASSERT_TRUE(eventually([&] { return web.get(path + "/thumbnail.png").result_int() == 200u; }));
  client.wait_for_samples(job, client.job(job).samples_done() + 1);  // the picture shown is recent, but not the last
  web.post(path + "/cancel");
  client.wait_until_ended(job);
  const std::string last = web.get(path + "/thumbnail.png").body();
  web.restart();  // it has shown nothing before; the cancellation is stored with everything before it
  EXPECT_TRUE(web.get(path + "/thumbnail.png").body() == last);
}

TEST(Web, EveryPathOfOpenApiJsonIsServed) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::string job = std::to_string(client.submit(small_picture(1)).id());
  web.farm().add_worker(1, "w");
  client.wait_until_ended(std::stoull(job));
  const std::string other = std::to_string(client.submit(small_picture(1), "to be deleted").id());
  client.wait_until_ended(std::stoull(other));
  const std::string source = source_file("client/web/public/openapi.json");
  const json description = json::parse(read_file(source).value());
  int calls = 0;
  for (const auto& [path, methods] : description["paths"].items()) {
    std::string target = (methods.contains("servers") ? "" : "/api/v1") + path;  // "/" has its own server entry
    for (const auto& [name, value] :
         {std::pair{"{id}", path.ends_with("/delete") ? other : job}, std::pair{"{name}", std::string("w")},
          std::pair{"{digest}", sha256("{}").hex()}}) {
      if (const std::size_t at = target.find(name); at != std::string::npos) {
        target.replace(at, std::string(name).size(), value);
      }
    }
    const Headers types{{"Content-Type", path == "/assets/{digest}" ? "application/octet-stream" : "application/json"}};
    for (const char* method : {"get", "post"}) {
      const unsigned status =
          std::string(method) == "get" ? web.get(target).result_int() : web.post(target, "{}", types).result_int();
      if (!methods.contains(method)) {
        EXPECT_EQ(status, 405u) << method << " " << target;
        continue;
      }
      EXPECT_TRUE(methods[method]["responses"].contains(std::to_string(status))) << target << ": " << status;
      ++calls;
    }
  }
  EXPECT_EQ(calls, 29);
}

TEST(Web, ReportsEventsOfTheFarm) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  web.farm().add_worker(1, "w 1");
  const std::uint64_t job = client.submit(small_picture()).id();
  client.wait_until_ended(job);
  const auto texts = [&](const std::string& query) {
    std::vector<std::string> all;
    for (const json& event : json::parse(web.get("/api/v1/events" + query).body()).value("events", json::array())) {
      all.push_back(event["text"]);
    }
    return all;
  };
  const auto has = [](const std::vector<std::string>& all, const std::string& part) {
    return std::ranges::any_of(all, [&](const std::string& text) { return text.find(part) != std::string::npos; });
  };
  const std::string of_job = fmt::format("?job={}", job);
  EXPECT_TRUE(eventually([&] { return has(texts(of_job), fmt::format("job {} is done", job)); }));
  EXPECT_TRUE(has(texts(of_job), "starts on worker w 1"));
  EXPECT_FALSE(has(texts(of_job), "worker w 1 connected"));
  EXPECT_TRUE(has(texts("?worker=w%201"), "worker w 1 connected"));
  EXPECT_EQ(texts("?page_size=2").size(), 2u);
  EXPECT_FALSE(has(texts("?kind=warnings"), "is done"));
  EXPECT_FALSE(has(texts("?kind=jobs"), "worker w 1 connected"));
  EXPECT_TRUE(has(texts("?kind=workers"), "worker w 1 connected: 1 thread on"));
  EXPECT_EQ(web.get("/api/v1/events?kind=jokes").result_int(), 400u);
  EXPECT_EQ(web.get("/api/v1/events?page_size=0").result_int(), 400u);
  EXPECT_EQ(web.get("/api/v1/events?page_token=x").result_int(), 400u);
  EXPECT_EQ(web.get("/api/v1/history?span=86401").result_int(), 400u);
  EXPECT_EQ(web.post("/api/v1/history").result_int(), 405u);
  EXPECT_EQ(web.get("/api/v1/workers/%zz/history").result_int(), 400u);
  EXPECT_EQ(json::parse(web.get("/api/v1/history?span=86400").body())["interval_seconds"], 300.0);

  const auto merged = [&] {  // a sample of the history appears after ten seconds
    double sum = 0;
    for (const json& each : json::parse(web.get("/api/v1/history").body()).value("samples", json::array())) {
      sum += each.value("pixel_samples", 0.0);
    }
    return sum;
  };
  const v1::Job done = client.job(job);
  EXPECT_TRUE(eventually([&] { return merged() == static_cast<double>(done.samples_done()); }));
}

TEST(Web, PicturesAreTheFilesThatTheCommandLineWrites) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t job = client.submit(small_picture()).id();
  web.farm().add_worker(1, "w");
  client.wait_until_ended(job);
  for (const std::string& kind : {std::string("exr"), std::string("png")}) {
    const std::string file = (web.farm().folder() / ("fetched." + kind)).string();
    const CommandResult fetched =
        run_command({program("lightmill"), "fetch", std::to_string(job), "-o", file, "--server", web.farm().address()});
    ASSERT_EQ(fetched.exit_code, 0) << fetched.err;
    const Response picture = web.get(fmt::format("/api/v1/jobs/{}/picture.{}", job, kind));
    EXPECT_EQ(picture[http::field::content_type], kind == "exr" ? "image/x-exr" : "image/png");
    EXPECT_NE(picture[http::field::content_disposition].find(fmt::format("job-{}.{}", job, kind)),
              beast::string_view::npos);
    EXPECT_TRUE(picture.body() == read_file(file).value()) << kind;
  }
  kill_at_once(web.farm().worker("w"));
  const std::uint64_t queued = client.submit(small_picture(), "never rendered").id();
  EXPECT_EQ(web.get(fmt::format("/api/v1/jobs/{}/picture.exr", queued)).result_int(), 409u) << "as fetch refuses it";
  EXPECT_EQ(web.get("/api/v1/jobs/42/picture.exr").result_int(), 404u);
  EXPECT_EQ(web.get(fmt::format("/api/v1/jobs/{}/picture.gif", job)).result_int(), 404u);
  EXPECT_EQ(web.post(fmt::format("/api/v1/jobs/{}/picture.exr", job)).result_int(), 405u);
}

TEST(Web, APictureThatIsTooLargeIsLeftToTheCommandLine) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  Picture large = small_picture();
  large.side = 4'200;  // at 64 bytes per pixel, more than 1 GiB
  const std::uint64_t job = client.submit(large).id();
  const Response answer = web.get(fmt::format("/api/v1/jobs/{}/picture.exr", job));
  EXPECT_EQ(answer.result_int(), 503u);
  EXPECT_NE(answer.body().find(fmt::format("lightmill fetch {}", job)), std::string::npos) << answer.body();
}

TEST(Web, ListsComeInPages) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  for (int i = 0; i < 3; ++i) {
    client.submit(small_picture(), fmt::format("request {}", i));
  }
  const json first = json::parse(web.get("/api/v1/jobs?page_size=2").body());
  EXPECT_EQ(first["jobs"].size(), 2u);
  const std::string token = first["next_page_token"];
  const json second = json::parse(web.get("/api/v1/jobs?page_size=2&page_token=" + token).body());
  ASSERT_EQ(second["jobs"].size(), 1u);
  EXPECT_EQ(second["next_page_token"], "");
  for (const char* query : {"page_size=0", "page_size=x", "page_size=1001", "page_token=x"}) {
    EXPECT_EQ(web.get(std::string("/api/v1/jobs?") + query).result_int(), 400u) << query;
  }
}

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

TEST(Web, RequestsThatAProxyMayUnderstandOtherwiseAreRefused) {
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

/// The answer to a job that a page submits.
Response submit_for(WebFarm& web, const std::string& page, const std::string& request_id) {
  return web.post("/api/v1/jobs?page=" + page, submit_body(job_of(small_picture(1'000'000), request_id)));
}

void name(Page& page, const std::string& name) {
  v1::ViewRequest request;
  request.set_page(name);
  page.send(request.SerializeAsString());
  EXPECT_FALSE(page.read().greeting().version().empty()) << "then the coordinator knows it";
}

TEST(Web, JobsOfAPageEndWithItsLastConnection) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t kept = client.submit(small_picture(), "kept").id();
  EXPECT_EQ(submit_for(web, "unknown", "early").result_int(), 409u) << "no connection has named this page";
  EXPECT_EQ(client.jobs(), std::vector{kept});
  auto page = std::make_unique<Page>(web), other = std::make_unique<Page>(web);
  name(*page, "a-page");
  name(*other, "b-page");
  EXPECT_EQ(submit_for(web, "a-page", "first").result_int(), 200u);
  EXPECT_EQ(submit_for(web, "b-page", "second").result_int(), 200u);
  const std::vector<std::uint64_t> all = client.jobs();
  ASSERT_EQ(all.size(), 3u);
  page.reset();  // like a killed program: it says nothing
  EXPECT_TRUE(eventually([&] { return client.jobs() == std::vector{all[0], kept}; }));
  other.reset();
  EXPECT_TRUE(eventually([&] { return client.jobs() == std::vector{kept}; }));
}

TEST(Web, JobsOfAPageEndWithTheirCoordinator) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t kept = client.submit(small_picture(), "kept").id();
  Page page(web);
  name(page, "a-page");
  EXPECT_EQ(submit_for(web, "a-page", "first").result_int(), 200u);
  EXPECT_EQ(client.jobs().size(), 2u);
  web.restart();
  FarmClient again = web.farm().client();
  EXPECT_TRUE(eventually([&] { return again.jobs() == std::vector{kept}; }));
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

TEST(Web, APageSeesThePictureComeAndCatchesUpAfterABreak) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t job = client.submit(small_picture()).id();
  web.farm().add_worker(1, "w");
  std::map<std::pair<int, int>, v1::ViewTile> tiles;
  const auto watch = [&](Page& page) {
    page.ask(job);
    page.follow(job, [&](const v1::ViewUpdate& update) {
      for (const v1::ViewTile& tile : update.tiles()) {
        tiles[{tile.rect().x(), tile.rect().y()}] = tile;
      }
      return tiles.size() == 4 &&
             std::ranges::all_of(tiles, [](const auto& entry) { return entry.second.samples() == 8; });
    });
  };
  Page page(web);
  watch(page);
  client.wait_until_ended(job);
  tiles.clear();
  Page again(web);
  watch(again);
  ASSERT_EQ(tiles.size(), 4u);
  const FilmPlanes film = client.film(job);
  for (const auto& [corner, tile] : tiles) {
    EXPECT_EQ(tile.samples(), 8u);
    EXPECT_EQ(tile.rgbe().size(), 8u * static_cast<std::size_t>(tile.rect().width() * tile.rect().height()));
  }
  EXPECT_EQ(tiles.at({64, 64}).rect().width(), 32);
}

TEST(Web, AnEndedJobIsShownAndExtendedFromTheStore) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  Picture picture = small_picture();
  const std::uint64_t job = client.submit(picture).id();
  web.farm().add_worker(1, "w");
  client.wait_until_ended(job);
  const std::string path = "/api/v1/jobs/" + std::to_string(job);
  const std::string thumbnail = web.get(path + "/thumbnail.png").body(), meters = web.get(path + "/meters").body();
  web.restart();
  EXPECT_EQ(web.get(path + "/thumbnail.png").body(), thumbnail);
  web.restart();
  EXPECT_EQ(web.get(path + "/meters").body(), meters);
  web.restart();
  EXPECT_EQ(web.get(path + "/picture.png").body().substr(1, 3), "PNG");
  web.restart();
  {
    Page page(web);
    page.ask(job);
    std::set<std::pair<int, int>> tiles;
    page.follow(job, [&](const v1::ViewUpdate& update) {
      for (const v1::ViewTile& tile : update.tiles()) {
        tiles.insert({tile.rect().x(), tile.rect().y()});
      }
      return tiles.size() == 4;
    });
  }
  web.restart();
  picture.samples += 5;
  EXPECT_EQ(web.post(path + "/extend", fmt::format("{{\"samples\": \"{}\"}}", picture.samples)).result_int(), 200u);
  expect_reference_film(web.farm().client(), job, picture);
}

TEST(Web, APageThatAcknowledgesNothingGetsTwoMessages) {
  WebFarm web;
  FarmClient client = web.farm().client();
  client.upload_assets();
  const std::uint64_t job = client.submit(small_picture(100'000)).id();
  web.farm().add_worker(1, "w");
  client.wait_for_samples(job, 96 * 96);
  Page slow(web);
  slow.ask(job, 0);
  slow.read();
  slow.read();
  Page quick(web);
  quick.ask(job);
  std::uint64_t seen = 0;
  quick.follow(job, [&](const v1::ViewUpdate& update) {
    seen = std::max(seen, update.job().samples_done());
    return quick.received == 10;
  });
  slow.ask(job);
  v1::ViewUpdate newest = slow.read();
  while (!newest.has_job()) {
    slow.ask(job);
    newest = slow.read();
  }
  EXPECT_LT(slow.received, 10u) << "nothing was queued";
  EXPECT_GE(newest.job().samples_done(), seen);
  EXPECT_GT(seen, 0u);
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
  const auto began = std::chrono::steady_clock::now();
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
  const auto took = std::chrono::steady_clock::now() - began;
  EXPECT_LE(tries(), took / std::chrono::milliseconds(50) + 1) << "it waits 50 ms, and takes no processor's time";
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

TEST(Web, SceneFilesAreReadByAWorker) {
  WebFarm farm;
  const std::string path = "/api/v1/inspect";
  EXPECT_EQ(farm.get(path).result_int(), 405u);
  EXPECT_EQ(farm.post(path, R"({"scene": []})").result_int(), 400u);
  EXPECT_EQ(farm.post(path, R"({"scene": ["a.obj"]})").result_int(), 503u) << "there is no worker";
  EXPECT_EQ(farm.post(path, "{}", {{"Origin", "http://elsewhere.example"}}).result_int(), 403u);
  farm.farm().add_worker(1, "w1");
  ASSERT_TRUE(eventually([&] { return farm.farm().met("w1"); }));
  LoadedScene files;
  v1::InspectSceneRequest request;
  request.add_scene("cornell-bench-blocks.json");
  for (const std::string& name :
       std::vector<std::string>{"cornell-bench-blocks.json", "assets/CornellBox.obj", "assets/CornellBlocks.obj"}) {
    const std::string bytes = read_file(source_file("scenes/" + name)).value();
    const Sha256 digest = sha256(bytes);
    files.assets[digest] = bytes;
    request.add_files()->set_path(name);
    request.mutable_files()->rbegin()->set_digest(digest_bytes(digest));
  }
  farm.farm().client().upload_assets(files);
  const Response response = farm.post(path, json_of(request));
  ASSERT_EQ(response.result_int(), 200u) << response.body();
  const json found = json::parse(response.body());
  EXPECT_EQ(found.at("scene").at("name"), "cornell-bench-blocks");
  EXPECT_EQ(found.at("assets").size(), bench_box().assets.size());
  EXPECT_FALSE(found.at("packed").get<std::string>().empty());
  request.set_camera("not uploaded");
  const Response refused = farm.post(path, json_of(request));
  EXPECT_EQ(refused.result_int(), 400u);
  EXPECT_NE(refused.body().find("not uploaded: is not among the uploaded files"), std::string::npos) << refused.body();
}

}  // namespace
}  // namespace lightmill::test
