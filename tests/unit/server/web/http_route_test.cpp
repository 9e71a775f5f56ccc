#include "server/web/http_route.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/file.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/web.pb.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

using nlohmann::json;

/// The operation's form in the table. Empty for a path without an operation.
std::string_view form_of(std::string_view path, bool post) {
  const std::optional<HttpRoute> route = find_route(path, post);
  return route ? route->operation->http : "";
}

Status fill(std::string_view path, std::string_view query, WireMessage& request) {
  const std::optional<HttpRoute> route = find_route(path, false);
  return route ? fill_request(*route, query, request) : not_found("{}", path);
}

TEST(HttpRoute, PathsWithAndWithoutParametersFindTheirOperation) {
  EXPECT_EQ(form_of("jobs", true), "POST jobs");
  EXPECT_EQ(form_of("jobs", false), "GET jobs?page_size=1..1000&page_token");
  EXPECT_EQ(form_of("jobs/12", false), "GET jobs/{id}");
  EXPECT_EQ(form_of("jobs/12/pause", true), "POST jobs/{id}/pause");
  EXPECT_EQ(form_of("workers/lab/render-1/drain", true), "POST workers/{name}/drain");
  for (const char* const nowhere :
       {"", "job", "jobs/", "jobs/x", "jobs/1x/pause", "jobs/-1", "jobs/1/pause/", "workers/a"}) {
    EXPECT_EQ(form_of(nowhere, true), "") << nowhere;
  }
}

TEST(HttpRoute, APathWithTheWrongMethodFindsItsRoute) {
  EXPECT_TRUE(find_route("jobs/1/pause", false)->post);
  EXPECT_FALSE(find_route("workers", true)->post);
}

TEST(HttpRoute, ParametersOfPathAndQueryBecomeFieldsOfTheRequest) {
  v1::EventsRequest events;
  ASSERT_TRUE(fill("events", "kind=jobs&worker=w%201&job=18446744073709551615&page_size=1000", events).ok());
  EXPECT_EQ(events.kind(), "jobs");
  EXPECT_EQ(events.worker(), "w 1");
  EXPECT_EQ(events.job(), 18446744073709551615u);
  EXPECT_EQ(events.page_size(), 1000);
  v1::WorkerHistoryRequest worker;
  ASSERT_TRUE(fill("workers/lab%2Fa/history", "", worker).ok());
  EXPECT_EQ(worker.name(), "lab/a");
  v1::GetJobRequest job;
  ASSERT_TRUE(fill("jobs/12", "", job).ok());
  EXPECT_EQ(job.id(), 12u);
}

TEST(HttpRoute, NumbersOutOfTheirRangeAreNamed) {
  v1::EventsRequest events;
  for (const char* const size : {"0", "1001", "x", "99999999999", "1e2"}) {
    const Status status = fill("events", std::string("page_size=") + size, events);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(message_of(status), std::string("page_size must be a number from 1 to 1000, got '") + size + "'");
  }
  EXPECT_EQ(fill("workers/%zz/history", "", events).code(), StatusCode::kInvalidArgument);
}

TEST(HttpRoute, UnknownParametersAreNamed) {
  v1::EventsRequest events;
  EXPECT_EQ(message_of(fill("events", "job=1&pagesize=3", events)),
            "the query has an unknown parameter 'pagesize'. This path has page_size, page_token, job, worker, kind");
  v1::GetJobRequest job;
  EXPECT_EQ(message_of(fill("jobs/12", "spp=3", job)), "the query has an unknown parameter 'spp'. This path has none");
  v1::SubmitJobRequest submission;
  EXPECT_TRUE(fill_request(*find_route("jobs", true), "page=a", submission).ok());
  EXPECT_EQ(fill_request(*find_route("jobs", true), "side=a", submission).code(), StatusCode::kInvalidArgument);
}

TEST(HttpRoute, EachRouteIsDescribedWithItsParameters) {
  const json paths = json::parse(read_file(source_file("client/web/public/openapi.json")).value())["paths"];
  int routes = 0;
  for (const Operation& operation : operations()) {
    if (operation.http.empty()) {
      continue;
    }
    ++routes;
    const std::string form(operation.http);
    const std::size_t space = form.find(' '), mark = std::min(form.find('?'), form.size());
    const std::string path = "/" + form.substr(space + 1, mark - space - 1);
    ASSERT_TRUE(paths.contains(path)) << form;
    const std::string method = form.starts_with("POST") ? "post" : "get";
    ASSERT_TRUE(paths[path].contains(method)) << form;
    std::vector<std::string> described;
    for (const json& parameter : paths[path][method].value("parameters", json::array())) {
      described.push_back(parameter["name"]);
    }
    std::vector<std::string> taken;
    for (std::size_t at = mark; at < form.size();) {
      const std::size_t end = std::min(form.find('&', at + 1), form.size());
      const std::string field = form.substr(at + 1, end - at - 1);
      taken.push_back(field.substr(0, field.find('=')));
      EXPECT_NE(operation.handler.request->GetDescriptor()->FindFieldByName(taken.back()), nullptr) << form;
      at = end;
    }
    if (operation.rpc.method == "SubmitJob") {
      taken.emplace_back("page");  // only the page uses it
    }
    EXPECT_EQ(taken, described) << form;
  }
  EXPECT_EQ(routes, 20);
}

}  // namespace
}  // namespace lightmill::test
