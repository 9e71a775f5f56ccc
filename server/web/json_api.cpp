#include "server/web/json_api.h"

#include <algorithm>
#include <array>

#include "common/base/text.h"
#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/web.pb.h"
#include "server/operations/job_list.h"
#include "server/operations/worker_message.h"
#include "server/runtime/records.h"
#include "server/web/look_back.h"
#include "server/web/metrics.h"

namespace lightmill {
namespace {

constexpr std::string_view kPrefix = "/api/v1/";
constexpr int kMostListed = 1'000;
constexpr int kListed = 100;
constexpr std::string_view kThumbnail = "/thumbnail.png", kExr = "/picture.exr", kPng = "/picture.png", kSpec = "/spec",
                           kMeters = "/meters";

Status unknown_path(const ApiRequest& request) {
  return not_found("there is no {}: /openapi.json says what there is", printable(request.path));
}

Status other_method(const ApiRequest& request, std::string_view method) {
  return make_error(StatusCode::kUnimplemented, "{} is asked for by {}", printable(request.path), method);
}

using Turn = FarmLoop::Turn;

using Task = std::function<Status(Turn&)>;

/// A body that says nothing: {}.
template <class Request>
Status read_nothing(const std::string& body) {
  Request request;
  return read_json(body, request);
}

Result<Task> read_extension(JobId job, const std::string& body) {
  v1::ExtendJobRequest request;
  LM_RETURN_IF_ERROR(read_json(body, request));
  return [job, to = Extension{request.samples(), request.error()}](Turn& turn) {
    return turn.farm.extend(job, to, turn.now, turn.effects);
  };
}

Result<Task> read_priority(JobId job, const std::string& body) {
  v1::SetPriorityRequest request;
  LM_RETURN_IF_ERROR(read_json(body, request));
  return [job, priority = request.priority()](Turn& turn) {
    return turn.farm.set_priority(job, priority, turn.now, turn.effects);
  };
}

Result<Task> read_deletion(JobId job, const std::string& body) {
  v1::DeleteJobRequest request;
  LM_RETURN_IF_ERROR(read_json(body, request));
  return [job, cancel = request.cancel()](Turn& turn) {
    return cancel ? turn.farm.discard(job, turn.now, turn.unix_ms, turn.effects)
                  : turn.farm.remove(job, turn.now, turn.effects);
  };
}

Result<Task> read_quarantine(const std::string& name, const Identity& caller, const std::string& body) {
  v1::QuarantineWorkerRequest request;
  LM_RETURN_IF_ERROR(read_json(body, request));
  request.set_name(name);
  LM_ASSIGN_OR_RETURN(const Quarantining asked, from_wire(request, caller));
  return [asked](Turn& turn) {
    return turn.farm.quarantine_worker(asked.worker, asked.reason, asked.render_again, turn.now, turn.effects);
  };
}

struct JobChange {
  std::string_view path;
  Rpc rpc;
  Result<Task> (*read)(JobId, const std::string& body);
};
constexpr std::array<JobChange, 6> kActions{{
    {"/pause", Rpc::pause_job,
     [](JobId job, const std::string& body) -> Result<Task> {
       LM_RETURN_IF_ERROR(read_nothing<v1::PauseJobRequest>(body));
       return [job](Turn& turn) { return turn.farm.pause(job, turn.now, turn.effects); };
     }},
    {"/resume", Rpc::resume_job,
     [](JobId job, const std::string& body) -> Result<Task> {
       LM_RETURN_IF_ERROR(read_nothing<v1::ResumeJobRequest>(body));
       return [job](Turn& turn) { return turn.farm.resume(job, turn.now, turn.effects); };
     }},
    {"/cancel", Rpc::cancel_job,
     [](JobId job, const std::string& body) -> Result<Task> {
       LM_RETURN_IF_ERROR(read_nothing<v1::CancelJobRequest>(body));
       return [job](Turn& turn) { return turn.farm.cancel(job, turn.now, turn.unix_ms, turn.effects); };
     }},
    {"/extend", Rpc::extend_job, read_extension},
    {"/priority", Rpc::set_priority, read_priority},
    {"/delete", Rpc::delete_job, read_deletion},
}};

/// What can be done to a worker by POST.
struct WorkerChange {
  std::string_view path;
  Rpc rpc;
  Result<Task> (*read)(const std::string& name, const Identity& caller, const std::string& body);
};
constexpr std::array<WorkerChange, 3> kWorkerActions{{
    {"/drain", Rpc::drain_worker,
     [](const std::string& name, const Identity&, const std::string& body) -> Result<Task> {
       LM_RETURN_IF_ERROR(read_nothing<v1::DrainWorkerRequest>(body));
       return [name](Turn& turn) { return turn.farm.drain_worker(name, turn.now, turn.effects); };
     }},
    {"/quarantine", Rpc::quarantine_worker, read_quarantine},
    {"/release", Rpc::release_worker,
     [](const std::string& name, const Identity&, const std::string& body) -> Result<Task> {
       LM_RETURN_IF_ERROR(read_nothing<v1::ReleaseWorkerRequest>(body));
       return [name](Turn& turn) { return turn.farm.release_worker(name, turn.now, turn.effects); };
     }},
}};

struct Page {
  int size = kListed;
  std::uint64_t before = 0;  ///< 0: from the newest
};

Result<Page> page_of(std::string_view query) {
  Page page;
  if (const std::string_view size = query_value(query, "page_size"); !size.empty()) {
    const auto number = parse_number<int>(size);
    if (!number || *number < 1 || *number > kMostListed) {
      return invalid_argument("page_size must be a number from 1 to {}, got '{}'", kMostListed, printable(size));
    }
    page.size = *number;
  }
  if (const std::string_view token = query_value(query, "page_token"); !token.empty()) {
    const auto number = parse_number<std::uint64_t>(token);
    if (!number) {
      return invalid_argument("page_token '{}' is not one that this farm gave", printable(token));
    }
    page.before = *number;
  }
  return page;
}

/// Answers with the worker; with nothing but its name if it is not there.
WebChange changed_worker(const std::string& name, const Task& task) {
  return [name, task](Turn& turn, About& about) -> Result<ApiReply> {
    about.text = name;
    LM_RETURN_IF_ERROR(task(turn));
    v1::Worker wire;
    show_worker(turn, name, &wire);
    return json_reply(wire);
  };
}

ApiReply empty_reply() {
  return {200, "application/json", "{}\n"};
}

}  // namespace

JsonApi::JsonApi(ApiParts parts)
    : loop_(parts.loop),
      gate_(parts.gate),
      logins_(parts.logins),
      greeting_(std::move(parts.greeting)),
      desk_(parts.loop, std::move(parts.on_web_thread)),
      thumbnails_(desk_, gate_, kThumbnailAnswer),
      meters_(desk_, gate_, kMetersAnswer),
      pictures_(desk_, gate_, parts.picture_bytes),
      intake_(desk_, gate_, parts.assets, parts.page_jobs, std::move(parts.on_side_thread)) {}

void JsonApi::handle(ApiRequest request, Reply reply) {
  if (request.path == kMetricsPath) {
    return show_metrics(request, std::move(reply));
  }
  std::string_view path = request.path;
  path.remove_prefix(std::min(path.size(), kPrefix.size()));
  const std::string_view collection = path.substr(0, path.find('/'));
  const std::string_view rest = collection.size() < path.size() ? path.substr(collection.size() + 1) : "";
  if (path == "farm" || path == "login" || path == "logout") {
    return reply(handle_caller(request, path));
  }
  if (path == "jobs") {
    return request.post ? intake_.submit(*request.call, query_value(request.query, "page"), std::move(request.body),
                                         std::move(reply))
                        : list_jobs(request, std::move(reply));
  }
  if (collection == "jobs") {
    const std::string_view number = rest.substr(0, rest.find('/'));
    if (const auto job = parse_number<std::uint64_t>(number)) {
      return handle_job(request, JobId{*job}, rest.substr(number.size()), std::move(reply));
    }
  }
  if (looks_back(path)) {
    return look_back(request, path, std::move(reply));
  }
  if (collection == "workers") {
    return handle_workers(request, rest, std::move(reply));
  }
  if (path == "assets/missing" && request.post) {
    return intake_.find_missing(std::move(request.body), std::move(reply));
  }
  if (path == "inspect") {
    return request.post ? intake_.inspect(*request.call, std::move(request.body), std::move(reply))
                        : reply(error_reply(other_method(request, "POST")));
  }
  if (collection == "assets" && !rest.empty() && !request.post) {
    return reply(error_reply(other_method(request, "POST")));
  }
  reply(error_reply(unknown_path(request)));
}

// ---- who asks ----

ApiReply JsonApi::handle_caller(const ApiRequest& request, std::string_view what) {
  if (request.post != (what != "farm")) {
    return error_reply(other_method(request, what == "farm" ? "GET" : "POST"));
  }
  if (what == "login") {
    return log_in(request);
  }
  const Identity caller = request.caller.ok() ? *request.caller : Identity{};
  if (const Status taken = gate_.take_request(caller, request.peer); !taken.ok()) {
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
  const Result<Logins::LoggedIn> logged_in = logins_.log_in(body.token(), request.peer);
  if (!logged_in.ok()) {
    return error_reply(logged_in.status());
  }
  ApiReply reply = greet(logged_in->caller);
  reply.set_cookie = set_cookie_header(request.cookie, logged_in->secret, logged_in->seconds);
  return reply;
}

/// Also of who is not logged in: afterwards nobody is.
ApiReply JsonApi::log_out(const ApiRequest& request) {
  logins_.log_out(request.login);
  ApiReply reply = empty_reply();
  reply.set_cookie = set_cookie_header(request.cookie, "", 0);
  return reply;
}

// ---- jobs ----

void JsonApi::list_jobs(const ApiRequest& request, Reply reply) {
  const Result<Call> call = gate_.admit(request.caller, request.peer, Rpc::list_jobs);
  const Result<Page> page = call.ok() ? page_of(request.query) : call.status();
  if (!page.ok()) {
    return reply(error_reply(page.status()));
  }
  desk_.ask(std::move(reply),
            [page = *page, caller = call->caller, notices = greeting_.notices](Turn& turn, const FarmReply& back) {
              v1::ListJobsResponse list;
              list.mutable_notices()->Add(notices.begin(), notices.end());
              lightmill::list_jobs(turn, caller, {.size = page.size, .before = page.before}, &list);
              back(json_reply(list));
            });
}

void JsonApi::handle_job(const ApiRequest& request, JobId job, std::string_view what, Reply reply) {
  const bool state = what.empty() || what == kSpec;
  const bool looks = state || what == kThumbnail || what == kExr || what == kPng || what == kMeters;
  const auto action = std::ranges::find(kActions, what, &JobChange::path);
  if (!looks && action == kActions.end()) {
    return reply(error_reply(unknown_path(request)));
  }
  if (request.post == looks) {
    return reply(error_reply(other_method(request, looks ? "GET" : "POST")));
  }
  const Rpc rpc = state ? Rpc::get_job : looks ? Rpc::get_film : action->rpc;
  const Result<Call> call = gate_.admit(request.caller, request.peer, rpc, {job.value});
  if (call.ok() && looks) {
    return show(*call, job, what, std::move(reply));
  }
  const Result<Task> task = call.ok() ? action->read(job, request.body.text) : call.status();
  if (!task.ok()) {
    return reply(error_reply(task.status()));
  }
  change(
      *call,
      [&gate = gate_, call = *call, job, task = *task](Turn& turn, About& about) -> Result<ApiReply> {
        about.job = job.value;
        LM_RETURN_IF_ERROR(check_job_call(turn, gate, call, job));
        LM_RETURN_IF_ERROR(task(turn));
        return call.rpc == Rpc::delete_job ? empty_reply() : job_reply(turn, job);
      },
      std::move(reply), rpc == Rpc::extend_job ? std::optional(job) : std::nullopt);
}

void JsonApi::show(const Call& call, JobId job, std::string_view what, Reply reply) {
  if (what == kSpec) {
    return intake_.send_spec(call, job, std::move(reply));
  }
  if (what == kThumbnail) {
    return thumbnails_.send(call, job, std::move(reply));
  }
  if (what == kMeters) {
    return meters_.send(call, job, std::move(reply));
  }
  if (!what.empty()) {
    return pictures_.send(call, job, what == kExr ? PictureFormat::exr : PictureFormat::png, std::move(reply));
  }
  desk_.ask(std::move(reply), [&gate = gate_, call, job](Turn& turn, const FarmReply& back) {
    const Status status = check_job_call(turn, gate, call, job);
    const Result<ApiReply> answer = status.ok() ? job_reply(turn, job) : status;
    back(answer.ok() ? *answer : error_reply(answer.status()));
  });
}

void JsonApi::change(const Call& call, WebChange change, Reply reply, std::optional<JobId> with_film_of) {
  desk_.ask(
      std::move(reply),
      [&gate = gate_, call, change = std::move(change)](Turn& turn, const FarmReply& back) {
        make_change(turn, gate, call, back, change);
      },
      with_film_of);
}

// ---- workers ----

void JsonApi::handle_workers(const ApiRequest& request, std::string_view rest, Reply reply) {
  const auto action =
      std::ranges::find_if(kWorkerActions, [rest](const WorkerChange& each) { return rest.ends_with(each.path); });
  const bool known = rest.empty() || action != kWorkerActions.end();
  if (!known || request.post != !rest.empty()) {
    return reply(error_reply(known ? other_method(request, rest.empty() ? "GET" : "POST") : unknown_path(request)));
  }
  const Result<std::string> name =
      percent_decoded(rest.empty() ? rest : rest.substr(0, rest.size() - action->path.size()));
  const Result<Call> call =
      gate_.admit(request.caller, request.peer, rest.empty() ? Rpc::list_workers : action->rpc, {0, name.value_or("")});
  if (!call.ok()) {
    return reply(error_reply(call.status()));
  }
  if (!rest.empty()) {
    const Result<Task> task = name.ok() ? action->read(*name, call->caller, request.body.text) : name.status();
    return task.ok() ? change(*call, changed_worker(*name, *task), std::move(reply))
                     : reply(error_reply(task.status()));
  }
  desk_.ask(std::move(reply), [](Turn& turn, const FarmReply& back) {
    v1::ListWorkersResponse list;
    for (const WorkerStatus& worker : turn.farm.workers(turn.now)) {
      to_wire(worker, list.add_workers());
    }
    list.set_wanted_workers(turn.farm.wanted_workers(turn.now));
    back(json_reply(list));
  });
}

void JsonApi::show_metrics(const ApiRequest& request, Reply reply) {
  if (request.post) {
    return reply(error_reply(other_method(request, "GET")));
  }
  const Result<Call> call = gate_.admit(request.caller, request.peer, Rpc::list_workers);
  if (!call.ok()) {
    return reply(error_reply(call.status()));
  }
  desk_.ask(std::move(reply), [&loop = loop_, version = greeting_.version](Turn& turn, const FarmReply& back) {
    back.compute([farm = FarmMetrics{turn.farm.totals(), turn.farm.snapshot(), turn.farm.wanted_workers(turn.now),
                                     turn.farm.held().empty()},
                  &loop, version] {
      return ApiReply{200, std::string(kMetricsType),
                      metrics_text(farm, loop.commit_seconds(), loop.traffic(), process_figures(), version)};
    });
  });
}

void JsonApi::look_back(const ApiRequest& request, std::string_view path, Reply reply) {
  if (request.post) {
    return reply(error_reply(other_method(request, "GET")));
  }
  const Result<Call> call = gate_.admit(request.caller, request.peer, Rpc::list_workers);
  const Result<LookBack> look = call.ok() ? look_back_at(path, request.query, call->caller) : call.status();
  if (!look.ok()) {
    return reply(error_reply(look.status()));
  }
  desk_.ask(std::move(reply), [look = *look](Turn& turn, const FarmReply& back) { back.compute(look(turn)); });
}

}  // namespace lightmill
