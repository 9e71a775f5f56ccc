// The coordinator's page and JSON API over real sockets: what is served.
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/wire/bytes.h"
#include "tests/integration/web_farm.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using nlohmann::json;

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

TEST(Web, JobsAndWorkersAreListedAndControlled) {
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
