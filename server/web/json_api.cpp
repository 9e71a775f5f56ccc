#include "server/web/json_api.h"

#include <algorithm>

#include "common/base/text.h"
#include "lightmill/v1/web.pb.h"
#include "server/operations/operation_call.h"
#include "server/web/metrics.h"

namespace lightmill {
namespace {

constexpr std::string_view kPrefix = "/api/v1/";
constexpr std::string_view kThumbnail = "thumbnail.png", kExr = "picture.exr", kPng = "picture.png", kMeters = "meters";

Status unknown_path(const ApiRequest& request) {
  return not_found("there is no {}: see /openapi.json", printable(request.path));
}

Status other_method(const ApiRequest& request, std::string_view method) {
  return make_error(StatusCode::kUnimplemented, "{} must be requested with {}", printable(request.path), method);
}

/// Parses the JSON of a body, and the parameters of path and query. INVALID_ARGUMENT.
Status read_request(const HttpRoute& route, const std::string& body, std::string_view query, WireMessage& request) {
  LM_RETURN_IF_ERROR(route.post ? read_json(body, request) : ok_status());
  return fill_request(route, query, request);
}

/// Sends a large reply if there is memory for it. Another thread makes its JSON. On the farm thread.
void send_large(const std::shared_ptr<OperationCall>& done, const Holder& holder, CallersBudget& budget,
                const OnSideThread& on_side_thread, const PendingReply& back) {
  const Traits& traits = done->operation().traits;
  const std::uint64_t bytes = done->reply().ByteSizeLong();
  const std::uint64_t more = traits.more_json == nullptr ? 0 : traits.more_json(done->reply());
  ByteBudget::Reservation reservation =
      budget.take(holder, static_cast<std::uint64_t>(traits.json_factor) * bytes + more);
  if (reservation == nullptr) {
    return back(error_reply(resource_exhausted("too many scenes are fetched at once: try again")));
  }
  on_side_thread([done, reservation = std::move(reservation), back] {
    const auto fill = done->operation().traits.fill_json;
    const Status filled = fill == nullptr ? ok_status() : fill(done->reply());
    ApiReply answer = filled.ok() ? json_reply(done->reply()) : error_reply(filled);
    answer.file = bytes_with_reservation(std::move(answer.body), reservation);
    back(std::move(answer));
  });
}

}  // namespace

const Operation* find_large_operation(std::string_view path) {
  if (!path.starts_with(kPrefix)) {
    return nullptr;
  }
  const std::optional<HttpRoute> route = find_route(path.substr(kPrefix.size()), true);
  return route && route->post && route->operation->traits.most_body_bytes > 0 ? route->operation : nullptr;
}

JsonApi::JsonApi(ApiParts parts)
    : runtime_(parts.runtime),
      access_(parts.runtime.access()),
      authenticator_(parts.authenticator),
      page_jobs_(parts.page_jobs),
      greeting_(std::move(parts.greeting)),
      on_side_thread_(std::move(parts.on_side_thread)),
      farm_requests_(parts.runtime.loop(), std::move(parts.on_web_thread)),
      thumbnails_(farm_requests_, access_, kThumbnailAnswer),
      meters_(farm_requests_, access_, kMetersAnswer),
      pictures_(farm_requests_, access_, parts.picture_bytes) {}

void JsonApi::handle(ApiRequest request, Reply reply) {
  if (request.path == kMetricsPath) {
    return show_metrics(request, std::move(reply));
  }
  const std::string path = request.path.substr(std::min(request.path.size(), kPrefix.size()));
  if (path == "farm" || path == "login" || path == "logout") {
    return reply(handle_caller(request, path));
  }
  if (show_film(request, path, reply)) {
    return;
  }
  const std::optional<HttpRoute> route = find_route(path, request.post);
  if (route && route->post == request.post) {
    return run(*route, std::move(request), std::move(reply));
  }
  const bool is_upload = path.starts_with("assets/") && !request.post;
  reply(error_reply(route || is_upload ? other_method(request, request.post ? "GET" : "POST") : unknown_path(request)));
}

/// Admits the call unless it is admitted, reads its body, and runs the operation.
void JsonApi::run(const HttpRoute& route, ApiRequest request, Reply reply) {
  const Operation& operation = *route.operation;
  const auto pending_call = std::make_shared<OperationCall>(runtime_, operation);
  Status status = fill_request(route, request.query, pending_call->request());
  Result<Call> call = request.call ? *std::move(request.call)
                                   : access_.admit(request.caller, request.peer, operation.rpc, pending_call->about());
  if (!call.ok()) {
    status = call.status();
  } else if (const std::string page(query_value(request.query, kPageParameter));
             status.ok() && !page.empty() && operation.rpc.method == "SubmitJob") {
    status = page_jobs_.check(page, *call);
    call->on_submitted = page_jobs_.submission_callback(page, *call);
  }
  if (!status.ok()) {
    return reply(error_reply(status));
  }
  auto work = [pending_call, route, query = std::move(request.query), body = std::move(request.body),
               call = *std::move(call), budget = budget_, on_side_thread = on_side_thread_,
               back = farm_requests_.expect(std::move(reply))]() mutable {
    if (const Status read = read_request(route, body.text, query, pending_call->request()); !read.ok()) {
      return back(error_reply(read));
    }
    body.text = {};
    const Holder holder = holder_of(call.caller, call.peer);
    pending_call->start(std::move(call), [pending_call, holder, budget, on_side_thread, back,
                                          reservation = std::move(body.reservation)](const Status& done) {
      if (!done.ok()) {
        back(error_reply(done));
      } else if (pending_call->operation().traits.json_factor > 0) {
        send_large(pending_call, holder, *budget, on_side_thread, back);
      } else {
        back.compute([pending_call] { return json_reply(pending_call->reply()); });
      }
    });
  };
  operation.traits.most_body_bytes > 0 ? on_side_thread_(std::move(work)) : work();
}

// ---- identity and sessions ----

ApiReply JsonApi::handle_caller(const ApiRequest& request, std::string_view what) {
  if (request.post != (what != "farm")) {
    return error_reply(other_method(request, what == "farm" ? "GET" : "POST"));
  }
  if (what == "login") {
    return log_in(request);
  }
  const Identity caller = request.caller.ok() ? *request.caller : Identity{};
  if (const Status taken = access_.take_request(caller, request.peer); !taken.ok()) {
    return error_reply(taken);
  }
  return what == "farm" ? greet(request.caller) : log_out(request);
}

ApiReply JsonApi::greet(const Result<Identity>& caller) const {
  if (!caller.ok()) {
    return error_reply(caller.status());
  }
  FarmGreeting greeting = greeting_;
  greeting.caller = *caller;
  v1::FarmGreeting wire;
  to_wire(greeting, &wire);
  return json_reply(wire);
}

ApiReply JsonApi::log_in(const ApiRequest& request) {
  v1::LoginRequest body;
  if (const Status status = read_json(request.body.text, body); !status.ok()) {
    return error_reply(status);
  }
  const Result<HttpAuthenticator::LoggedIn> logged_in = authenticator_.log_in(body.token(), request.peer);
  if (!logged_in.ok()) {
    return error_reply(logged_in.status());
  }
  ApiReply reply = greet(logged_in->caller);
  reply.set_cookie = set_cookie_header(request.cookie, logged_in->secret, logged_in->seconds);
  return reply;
}

/// Succeeds without a session, too.
ApiReply JsonApi::log_out(const ApiRequest& request) {
  authenticator_.log_out(request.login);
  ApiReply reply{200, "application/json", "{}\n"};
  reply.set_cookie = set_cookie_header(request.cookie, "", 0);
  return reply;
}

// ---- requests that are not operations ----

/// Thumbnails, meters and pictures of a job. False if the path is another one.
bool JsonApi::show_film(const ApiRequest& request, std::string_view path, Reply& reply) {
  constexpr std::string_view kJobs = "jobs/";
  const std::size_t slash = path.find('/', kJobs.size());
  if (!path.starts_with(kJobs) || slash == std::string_view::npos) {
    return false;
  }
  const auto job = parse_number<std::uint64_t>(path.substr(kJobs.size(), slash - kJobs.size()));
  const std::string_view what = path.substr(slash + 1);
  if (!job || (what != kThumbnail && what != kExr && what != kPng && what != kMeters)) {
    return false;
  }
  if (request.post) {
    reply(error_reply(other_method(request, "GET")));
    return true;
  }
  const Result<Call> call = access_.admit(request.caller, request.peer, kGetFilm, {*job});
  if (!call.ok()) {
    reply(error_reply(call.status()));
  } else if (what == kThumbnail) {
    thumbnails_.send(*call, JobId{*job}, std::move(reply));
  } else if (what == kMeters) {
    meters_.send(*call, JobId{*job}, std::move(reply));
  } else {
    pictures_.send(*call, JobId{*job}, what == kExr ? PictureFormat::exr : PictureFormat::png, std::move(reply));
  }
  return true;
}

void JsonApi::show_metrics(const ApiRequest& request, Reply reply) {
  if (request.post) {
    return reply(error_reply(other_method(request, "GET")));
  }
  const Result<Call> call = access_.admit(request.caller, request.peer, kListWorkers);
  if (!call.ok()) {
    return reply(error_reply(call.status()));
  }
  farm_requests_.post(std::move(reply), [&loop = runtime_.loop(), version = greeting_.version](
                                            FarmLoop::TaskContext& context, const PendingReply& back) {
    back.compute([farm = MetricValues{context.farm.totals(), context.farm.gauges(context.now),
                                      context.farm.wanted_workers(context.now), context.farm.held().empty()},
                  &loop, version] {
      return ApiReply{200, std::string(kMetricsType),
                      metrics_text(farm, loop.commit_seconds(), loop.traffic(), process_figures(), version)};
    });
  });
}

}  // namespace lightmill
