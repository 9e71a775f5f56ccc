// Access over HTTP, on real encrypted connections: all paths × all roles × own and others' jobs, and logins.
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>

#include <set>

#include "lightmill/v1/web.pb.h"
#include "tests/integration/secure_web.h"
#include "tests/support/movable_clock.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using nlohmann::json;

/// A page that receives live messages.
class SecurePage {
 public:
  SecurePage(SecureWeb& web, const Headers& headers) : socket_(web.connect(error)) {
    socket_.set_option(websocket::stream_base::decorator([headers](websocket::request_type& request) {
      for (const auto& [name, value] : headers) {
        request.set(name, value);
      }
    }));
    socket_.handshake(web.host(), "/api/v1/live", error);
    socket_.binary(true);
  }
  void ask(std::uint64_t job = 0) {
    v1::ViewRequest request;
    request.set_jobs(true);
    request.set_job(job);
    request.set_seen(seen_);
    socket_.write(asio::buffer(request.SerializeAsString()), error);
  }
  v1::ViewUpdate read() {
    beast::get_lowest_layer(socket_).expires_after(kTimeout);
    beast::flat_buffer buffer;
    socket_.read(buffer, error);
    v1::ViewUpdate update;
    if (!error) {
      ++seen_;
      EXPECT_TRUE(update.ParseFromArray(buffer.data().data(), static_cast<int>(buffer.size())));
    }
    return update;
  }
  /// Reads until the page is closed, and returns the close code.
  int closed_with() {
    while (!error) {
      read();
      if (!error) {
        ask();
      }
    }
    return socket_.reason().code;
  }

  beast::error_code error;

 private:
  websocket::stream<TlsStream> socket_;
  std::uint64_t seen_ = 0;
};

/// Status of an allowed request with the body {}, about a cancelled job without samples. openapi.json has the roles of
/// each path.
const std::map<std::string, unsigned>& answers() {
  static const std::map<std::string, unsigned> paths{
      {"get /farm", 200},
      {"post /login", 401},  // without a token in the body
      {"post /logout", 200},
      {"get /jobs", 200},
      {"post /jobs", 400},  // of an invalid job
      {"post /assets/missing", 200},
      {"post /assets/{digest}", 200},
      {"post /inspect", 400},  // without files
      {"get /jobs/{id}/spec", 200},
      {"post /jobs/{id}/delete", 200},
      {"get /jobs/{id}", 200},
      {"get /jobs/{id}/thumbnail.png", 404},
      {"get /jobs/{id}/meters", 200},
      {"get /jobs/{id}/picture.exr", 409},
      {"get /jobs/{id}/picture.png", 409},
      {"post /jobs/{id}/pause", 409},
      {"post /jobs/{id}/resume", 409},
      {"post /jobs/{id}/cancel", 409},
      {"post /jobs/{id}/extend", 409},
      {"post /jobs/{id}/priority", 409},
      {"get /workers", 200},
      {"get /workers/{name}/history", 200},
      {"get /history", 200},
      {"get /events", 200},
      {"get /actions", 200},
      {"get /metrics", 200},
      {"post /workers/{name}/drain", 404},
      {"post /workers/{name}/quarantine", 404},
      {"post /workers/{name}/release", 404},
  };
  return paths;
}

/// Whether openapi.json lets the role make the call. Roles for the caller's own jobs are listed separately.
bool is_allowed(const json& call, const std::string& role, bool own) {
  const auto names = [&](const char* roles) {
    return std::ranges::count(call.value(roles, json::array()), json(role)) > 0;
  };
  return !call.contains("x-roles") || names("x-roles") || (own && names("x-own-roles"));
}

std::string filled_in(std::string path, const std::string& name, const std::string& value) {
  const std::size_t at = path.find(name);
  return at == std::string::npos ? path : path.replace(at, name.size(), value);
}

TEST(WebAccess, EveryPathChecksRolesAndOwners) {
  SecureWeb web;
  const auto ada = web.channel("ada", {Role::submit}), bob = web.channel("bob", {Role::submit});
  upload_assets(ada);
  const std::string adas = std::to_string(ended_job(ada)), bobs = std::to_string(ended_job(bob));
  std::vector<std::pair<std::string, Headers>> callers{
      {"anonymous", {}},
      {"anonymous", bearer(make_token()->text)},
      {"anonymous", {{"Authorization", "rubbish"}}},
      {"anonymous", {{"Cookie", fmt::format("__Host-lightmill-{}=rubbish", web.port())}}}};
  for (const Role role : kRoles) {
    const std::string token = web.token("ada", {role});
    callers.emplace_back(name_of(role), bearer(token));
    if (role == Role::worker || role == Role::enrol) {
      const Response refused = web.log_in(token);
      EXPECT_EQ(refused.result_int(), 403u) << "workers see nothing on the page";
      EXPECT_NE(refused.body().find("roles"), std::string::npos) << refused.body();
    } else {
      callers.emplace_back(name_of(role), web.cookie_of(token));
    }
  }
  const std::string source = source_file("client/web/public/openapi.json");
  const json described = json::parse(read_file(source).value());
  std::size_t walked = 0;
  for (const auto& [path, methods] : described["paths"].items()) {
    for (const std::string& method : {std::string("get"), std::string("post")}) {
      if (!methods.contains(method)) {
        continue;
      }
      const std::string name = method + " " + path;
      ASSERT_TRUE(answers().contains(name)) << name << " has no line in this table";
      const unsigned answer = answers().at(name);
      ++walked;
      for (const auto& [role, shown] : callers) {
        Headers headers = path == "/logout" ? Headers{} : shown;  // the others have to stay logged in
        if (path == "/assets/{digest}") {
          headers["Content-Type"] = "application/octet-stream";
        }
        for (const bool own : {false, true}) {
          const bool deletes = path == "/jobs/{id}/delete";
          const std::string job = deletes ? std::to_string(ended_job(own ? ada : bob)) : own ? adas : bobs;
          const std::string target =
              (methods.contains("servers") ? "" : "/api/v1") +
              filled_in(filled_in(filled_in(path, "{id}", job), "{name}", "unknown"), "{digest}", sha256("{}").hex());
          const bool let_in = is_allowed(methods[method], role, own);
          const Response response = web.send(method == "get" ? http::verb::get : http::verb::post, target, headers);
          EXPECT_EQ(response.result_int(), let_in                ? answer
                                           : role == "anonymous" ? 401
                                                                 : 403)
              << name << " as " << role << (own ? ", own job: " : ", another's job: ") << response.body();
          EXPECT_EQ(response.count(http::field::www_authenticate), response.result_int() == 401 ? 1u : 0u);
          if (!let_in) {
            const auto message = json::parse(response.body())["error"]["message"].get<std::string>();
            EXPECT_FALSE(message.empty());
            EXPECT_EQ(message.starts_with("this farm requires authentication, and got no token: log in with one"),
                      shown.empty())
                << message;
          }
        }
      }
    }
  }
  EXPECT_EQ(walked, answers().size());
}

TEST(WebAccess, ALoginIsACookieThatEndsAtLogout) {
  SecureWeb web;
  const std::string token = web.token("ada", {Role::view, Role::submit});
  const Response login = web.log_in(token);
  EXPECT_EQ(login.result_int(), 200u) << login.body();
  const std::string cookie(login[http::field::set_cookie]);
  EXPECT_TRUE(cookie.starts_with(fmt::format("__Host-lightmill-{}=", web.port()))) << cookie;
  for (const char* flag : {"; HttpOnly", "; Secure", "; SameSite=Strict", "; Path=/"}) {
    EXPECT_NE(cookie.find(flag), std::string::npos) << cookie;
  }
  EXPECT_EQ(cookie.find(token), std::string::npos);
  const Headers shown{{"Cookie", cookie.substr(0, cookie.find(';'))}};
  const json farm = json::parse(web.get("/api/v1/farm", shown).body());
  EXPECT_EQ(farm["caller"], "ada");
  EXPECT_EQ(farm["roles"], (json{"view", "submit"}));
  const auto names = [](const json& list, const char* method) { return std::ranges::count(list, method) == 1; };
  EXPECT_TRUE(names(farm["may"], "GetJob"));
  EXPECT_FALSE(names(farm["may"], "PauseJob"));
  EXPECT_TRUE(names(farm["may_with_own"], "PauseJob"));
  EXPECT_NE(std::string(web.log_in(token)[http::field::set_cookie]), cookie) << "each browser has a secret of its own";

  EXPECT_EQ(web.get("/nothing").result_int(), 404u) << "everyone gets the page";
  const Response logout = web.send(http::verb::post, "/api/v1/logout", shown);
  EXPECT_NE(std::string(logout[http::field::set_cookie]).find("Max-Age=0"), std::string::npos);
  EXPECT_EQ(web.get("/api/v1/jobs", shown).result_int(), 401u);
  EXPECT_EQ(web.get("/api/v1/jobs", bearer(token)).result_int(), 200u);
  EXPECT_EQ(web.log_in(make_token()->text).result_int(), 401u);
  EXPECT_EQ(web.log_in("rubbish").result_int(), 401u);
}

TEST(WebAccess, TheSchemeOfATokenMayBeWrittenInAnyCase) {
  SecureWeb web;
  const std::string token = web.token("ada", {Role::view});
  for (const char* const scheme : {"Bearer ", "bearer ", "BEARER "}) {
    EXPECT_EQ(web.send(http::verb::get, "/api/v1/jobs", {{"Authorization", scheme + token}}).result_int(), 200u)
        << scheme;
  }
  EXPECT_EQ(web.send(http::verb::get, "/api/v1/jobs", {{"Authorization", "Basic " + token}}).result_int(), 401u);
}

TEST(WebAccess, OtherPagesCannotUseALogin) {
  SecureWeb web;
  Headers shown = web.cookie_of(web.token("ada", {Role::operate}));
  const auto drain = [&] { return web.send(http::verb::post, "/api/v1/workers/w/drain", shown).result_int(); };
  EXPECT_EQ(drain(), 404u);
  shown["Origin"] = "https://" + web.host();
  EXPECT_EQ(drain(), 404u) << "the page's own may; there is no such worker";
  for (const std::string& origin : {"http://" + web.host(), std::string("https://evil.example"), std::string("null")}) {
    shown["Origin"] = origin;
    EXPECT_EQ(drain(), 403u) << origin;
    EXPECT_EQ(SecurePage(web, shown).error, websocket::error::upgrade_declined) << origin;
  }
  shown.erase("Origin");
  shown["Host"] = "evil.example";
  EXPECT_EQ(web.get("/api/v1/jobs", shown).result_int(), 403u);
}

TEST(WebAccess, ARevokedTokenEndsItsLoginsAndPagesAtOnce) {
  SecureWeb web;
  const std::string token = web.token("ada", {Role::view}), other = web.token("ada", {Role::view});
  const Headers shown = web.cookie_of(token);
  SecurePage by_cookie(web, shown), by_token(web, bearer(token)), stays(web, web.cookie_of(other));
  for (SecurePage* page : {&by_cookie, &by_token, &stays}) {
    ASSERT_FALSE(page->error) << page->error.message();
    page->ask();
    EXPECT_EQ(page->read().greeting().caller(), "ada");
  }
  web.revoke(token);
  EXPECT_EQ(web.get("/api/v1/jobs", shown).result_int(), 401u);
  EXPECT_EQ(SecurePage(web, shown).error, websocket::error::upgrade_declined);
  EXPECT_EQ(by_cookie.closed_with(), 4401);
  EXPECT_EQ(by_token.closed_with(), 4401);
  stays.ask();
  stays.read();
  EXPECT_FALSE(stays.error) << stays.error.message();
}

TEST(WebAccess, PagesEndWithTheirLoginAndLoginsWithTheirToken) {
  const MovableClock clock;
  SecureWeb web(clock.environment());
  const Headers shown = web.cookie_of(web.token("ada", {Role::view}));
  SecurePage page(web, shown);
  page.ask();
  web.send(http::verb::post, "/api/v1/logout", shown);
  EXPECT_EQ(page.closed_with(), 4401);

  const Headers short_lived = web.cookie_of(web.token("ada", {Role::view}, now_unix_s() + 3600));
  SecurePage ending(web, short_lived);
  ending.ask();
  ending.read();
  EXPECT_FALSE(ending.error) << "not before: " << ending.error.message();
  EXPECT_EQ(web.get("/api/v1/jobs", short_lived).result_int(), 200u);
  clock.move("+2h");
  EXPECT_EQ(ending.closed_with(), 4401);
  EXPECT_EQ(web.get("/api/v1/jobs", short_lived).result_int(), 401u);
}

TEST(WebAccess, OthersJobsAreHiddenAndViewsAreRecorded) {
  SecureWeb web;
  const auto ada = web.channel("ada", {Role::submit}), bob = web.channel("bob", {Role::submit});
  upload_assets(ada);
  const std::uint64_t adas = ended_job(ada), bobs = ended_job(bob);
  const std::string token = web.token("ada", {Role::submit});
  const Headers shown = web.cookie_of(token);
  const json list = json::parse(web.get("/api/v1/jobs", shown).body());
  ASSERT_EQ(list["jobs"].size(), 1u);
  EXPECT_EQ(list["jobs"][0]["id"], std::to_string(adas));
  const auto jobs_of_events = [&](const Headers& who) {
    std::set<std::string> jobs;
    const json events = json::parse(web.get("/api/v1/events?kind=jobs", who).body());
    for (const json& event : events["events"]) {
      jobs.insert(event["job"]);
    }
    return jobs;
  };
  EXPECT_EQ(jobs_of_events(shown), std::set{std::to_string(adas)});
  EXPECT_EQ(jobs_of_events(bearer(web.token("carl", {Role::view}))),
            (std::set{std::to_string(adas), std::to_string(bobs)}));
  SecurePage page(web, shown);
  page.ask(bobs);
  std::string failure;
  while (failure.empty() && !page.error) {
    const v1::ViewUpdate update = page.read();
    EXPECT_FALSE(update.has_job());
    failure = update.job_failure();
    page.ask(bobs);
  }
  EXPECT_NE(failure.find("belongs to another user"), std::string::npos) << failure;
  web.send(http::verb::post, fmt::format("/api/v1/jobs/{}/cancel", bobs), shown);
  web.log_in("rubbish");

  v1::ListActionsResponse actions;
  const auto stub = v1::AccessService::NewStub(web.channel("root", {Role::admin}));
  const auto written = [&](const std::string& what, const std::string& who, std::uint64_t job, int outcome) {
    return std::ranges::any_of(actions.actions(), [&](const v1::Action& action) {
      return action.operation() == what && action.caller() == who && action.job() == job && action.code() == outcome &&
             action.peer().starts_with("127.0.0.1:");
    });
  };
  EXPECT_TRUE(eventually([&] {
    grpc::ClientContext context;
    EXPECT_TRUE(stub->ListActions(&context, {}, &actions).ok());
    return written("Login", "ada", 0, grpc::StatusCode::OK) &&
           written("Login", "", 0, grpc::StatusCode::UNAUTHENTICATED) &&
           written("WatchJob", "ada", bobs, grpc::StatusCode::PERMISSION_DENIED) &&
           written("CancelJob", "ada", bobs, grpc::StatusCode::PERMISSION_DENIED);
  })) << actions.DebugString();
}

// More than the 16 KiB of a TLS record.
TEST(WebAccess, LargeAnswersAndMessagesArriveWhole) {
  SecureWeb web;
  const auto ada = web.channel("ada", {Role::submit});
  upload_assets(ada);
  constexpr std::size_t kJobs = 200;
  for (std::size_t i = 0; i < kJobs; ++i) {
    ended_job(ada);
  }
  const Headers shown = web.cookie_of(web.token("ada", {Role::submit}));
  const Response list = web.get("/api/v1/jobs?page_size=200", shown);
  EXPECT_GT(list.body().size(), 40'000u);
  EXPECT_EQ(json::parse(list.body())["jobs"].size(), kJobs);
  SecurePage page(web, shown);
  std::set<std::uint64_t> jobs;
  std::size_t largest = 0;
  page.ask();
  while (jobs.size() < kJobs && !page.error) {
    const v1::ViewUpdate update = page.read();
    largest = std::max(largest, update.ByteSizeLong());
    for (const v1::Job& job : update.jobs().jobs()) {
      jobs.insert(job.id());
    }
    page.ask();
  }
  EXPECT_EQ(jobs.size(), kJobs) << page.error.message();
  EXPECT_GT(largest, 17'000u);
}

TEST(WebAccess, AJobBelongsToItsCallerAndIsRecorded) {
  SecureWeb web;
  upload_assets(web.channel("ada", {Role::submit}));
  const Headers ada = web.cookie_of(web.token("ada", {Role::submit}));
  Picture picture;
  picture.side = 64;
  JobSpec spec = job_of(picture, "mine");
  spec.owner = "bob";
  const Response submitted = web.send(http::verb::post, "/api/v1/jobs", ada, submit_body(spec));
  ASSERT_EQ(submitted.result_int(), 200u) << submitted.body();
  const json job = json::parse(submitted.body());
  EXPECT_EQ(job["owner"], "ada");
  const std::string path = "/api/v1/jobs/" + job["id"].get<std::string>();
  const Headers eve = bearer(web.token("eve", {Role::submit}));
  EXPECT_EQ(web.send(http::verb::post, "/api/v1/jobs", eve, submit_body(spec)).result_int(), 409u)
      << "her request id is that of another user's job";
  EXPECT_EQ(web.get(path + "/spec", eve).result_int(), 403u);
  EXPECT_EQ(web.send(http::verb::post, path + "/cancel", ada).result_int(), 200u);
  EXPECT_EQ(web.send(http::verb::post, path + "/delete", eve).result_int(), 403u);
  EXPECT_EQ(web.send(http::verb::post, path + "/delete", ada).result_int(), 200u);

  v1::ListActionsResponse actions;
  grpc::ClientContext context;
  const auto stub = v1::AccessService::NewStub(web.channel("root", {Role::admin}));
  ASSERT_TRUE(stub->ListActions(&context, {}, &actions).ok());
  const Response listed = web.get("/api/v1/actions?caller=ada&page_size=1", bearer(web.token("root", {Role::admin})));
  const json deletion = json::parse(listed.body())["actions"][0];
  EXPECT_EQ(deletion["operation"], "DeleteJob");
  EXPECT_EQ(deletion["about"], spec.name);
  EXPECT_EQ(deletion["change"], "state cancelled -> deleted");
  const auto times = [&](const std::string& what, const std::string& who, int outcome) {
    return std::ranges::count_if(actions.actions(), [&](const v1::Action& action) {
      return action.operation() == what && action.caller() == who && std::to_string(action.job()) == job["id"] &&
             action.code() == outcome;
    });
  };
  EXPECT_EQ(times("SubmitJob", "ada", grpc::StatusCode::OK), 1);
  EXPECT_EQ(times("DeleteJob", "ada", grpc::StatusCode::OK), 1);
  EXPECT_EQ(times("DeleteJob", "eve", grpc::StatusCode::PERMISSION_DENIED), 1);
  EXPECT_EQ(times("GetJob", "eve", grpc::StatusCode::PERMISSION_DENIED), 1);
}

}  // namespace
}  // namespace lightmill::test
