#include "server/web/json_api.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "common/base/text.h"
#include "common/film/film.h"
#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/web.pb.h"
#include "server/api/worker_message.h"
#include "server/web/thumbnail.h"

namespace lightmill {
namespace {

constexpr std::string_view kPrefix = "/api/v1/";
constexpr int kMostListed = 1'000;
constexpr int kListed = 100;
constexpr std::size_t kMostThumbnails = 1'000;

ApiReply json_reply(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  options.add_whitespace = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  return status.ok() ? ApiReply{200, "application/json", std::move(text)}
                     : error_reply(internal_error("{}", status.ToString()));
}

unsigned http_status(StatusCode code) {
  switch (code) {
    case StatusCode::kInvalidArgument:
    case StatusCode::kOutOfRange:
      return 400;
    case StatusCode::kUnauthenticated:
      return 401;
    case StatusCode::kPermissionDenied:
      return 403;
    case StatusCode::kNotFound:
      return 404;
    case StatusCode::kUnimplemented:
      return 405;
    case StatusCode::kFailedPrecondition:
    case StatusCode::kAlreadyExists:
      return 409;
    case StatusCode::kResourceExhausted:
    case StatusCode::kUnavailable:
      return 503;
    default:
      return 500;
  }
}

std::string json_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out.push_back('\\');
    }
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out.push_back(c);
    }
  }
  return out + '"';
}

template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return !text.empty() && error == std::errc() && end == text.data() + text.size() ? std::optional(number)
                                                                                   : std::nullopt;
}

/// The value of a query's field; empty if there is none.
std::string_view query_value(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    const std::string_view field = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), field.size() + 1));
    if (field.size() > name.size() && field.starts_with(name) && field[name.size()] == '=') {
      return field.substr(name.size() + 1);
    }
  }
  return {};
}

/// INVALID_ARGUMENT for what is no percent-encoding.
Result<std::string> percent_decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out.push_back(text[i]);
      continue;
    }
    unsigned char byte = 0;
    const std::string_view hex = text.substr(i + 1, 2);
    const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), byte, 16);
    if (hex.size() != 2 || error != std::errc() || end != hex.data() + 2) {
      return invalid_argument("'{}' is not percent-encoded", printable(text));
    }
    out.push_back(static_cast<char>(byte));
    i += 2;
  }
  return out;
}

Status unknown_path(const ApiRequest& request) {
  return not_found("there is no {}: /openapi.json says what there is", printable(request.path));
}

Status other_method(const ApiRequest& request, std::string_view method) {
  return make_error(StatusCode::kUnimplemented, "{} is asked for by {}", printable(request.path), method);
}

/// Fills `message`, which may also stay as it is.
Status read_body(const ApiRequest& request, google::protobuf::Message& message) {
  if (request.body.empty()) {
    return ok_status();
  }
  const auto status = google::protobuf::util::JsonStringToMessage(request.body, &message);
  return status.ok() ? ok_status() : invalid_argument("the body: {}", printable(status.ToString()));
}

using Turn = FarmLoop::Turn;

/// Writes into the farm's log what the caller has done.
void record(Turn& turn, const ApiRequest& request, Rpc rpc, std::uint64_t job, const std::string& about) {
  turn.keep({0, 0, request.caller.name, request.caller.proof, request.caller.token, request.peer,
             std::string(rule_of(rpc).method), job, about, StatusCode::kOk, ""});
}

/// What can be done to a job by POST.
struct JobChange {
  std::string_view path;
  Rpc rpc;
  Status (*change)(Turn&, JobId, const Extension&);
};
constexpr std::array<JobChange, 4> kActions{{
    {"/pause", Rpc::pause_job,
     [](Turn& turn, JobId job, const Extension&) { return turn.farm.pause(job, turn.now, turn.step); }},
    {"/resume", Rpc::resume_job,
     [](Turn& turn, JobId job, const Extension&) { return turn.farm.resume(job, turn.now, turn.step); }},
    {"/cancel", Rpc::cancel_job,
     [](Turn& turn, JobId job, const Extension&) { return turn.farm.cancel(job, turn.now, turn.unix_ms, turn.step); }},
    {"/extend", Rpc::extend_job,
     [](Turn& turn, JobId job, const Extension& to) { return turn.farm.extend(job, to, turn.now, turn.step); }},
}};

/// What can be done to a worker by POST.
struct WorkerChange {
  std::string_view path;
  Rpc rpc;
  Status (Coordinator::*change)(const std::string&, Time, Step&);
};
constexpr std::array<WorkerChange, 2> kWorkerActions{{
    {"/drain", Rpc::drain_worker, &Coordinator::drain_worker},
    {"/release", Rpc::release_worker, &Coordinator::release_worker},
}};

struct Page {
  int size = kListed;
  std::uint64_t before = 0;
};

Result<Page> page_of(std::string_view query) {
  Page page{kListed, std::numeric_limits<std::uint64_t>::max()};
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

}  // namespace

ApiReply error_reply(const Status& status) {
  return {http_status(status.code()), "application/json",
          fmt::format("{{\"error\": {{\"code\": \"{}\", \"message\": {}}}}}\n", absl::StatusCodeToString(status.code()),
                      json_text(message_of(status)))};
}

void FarmReply::compute(std::function<ApiReply()> answer) const {
  on_web_thread_([waiting = waiting_, id = id_, answer = std::move(answer)] {
    const auto replies = waiting.lock();
    if (replies == nullptr || !replies->contains(id)) {
      return;
    }
    const Reply reply = std::move(replies->at(id));
    replies->erase(id);
    reply(answer());
  });
}

JsonApi::JsonApi(FarmLoop& loop, FarmGreeting greeting, OnWebThread on_web_thread)
    : loop_(loop), greeting_(std::move(greeting)), on_web_thread_(std::move(on_web_thread)) {}

/// Runs `task` on the farm thread, which calls the reply, at once or after the commit.
void JsonApi::on_farm(Reply reply, FarmTask task) {
  const FarmReply back(on_web_thread_, waiting_, next_id_);
  waiting_->emplace(next_id_++, std::move(reply));
  if (!loop_.post([task = std::move(task), back](Turn& turn) { task(turn, back); })) {
    back(error_reply(resource_exhausted("the farm has too much to do at once: try again")));
  }
}

void JsonApi::handle(const ApiRequest& request, Reply reply) {
  std::string_view path = request.path;
  path.remove_prefix(std::min(path.size(), kPrefix.size()));
  const std::string_view collection = path.substr(0, path.find('/'));
  const std::string_view rest = collection.size() < path.size() ? path.substr(collection.size() + 1) : "";
  if (path == "farm") {
    if (request.post) {
      return reply(error_reply(other_method(request, "GET")));
    }
    v1::FarmGreeting farm;
    farm.set_version(greeting_.version);
    farm.set_renderer_version(kRendererVersion);
    farm.mutable_notices()->Add(greeting_.notices.begin(), greeting_.notices.end());
    farm.set_caller(request.caller.name);
    return reply(json_reply(farm));
  }
  if (path == "jobs") {
    return handle_jobs(request, std::move(reply));
  }
  if (collection == "jobs") {
    const std::string_view number = rest.substr(0, rest.find('/'));
    if (const auto job = parse_number<std::uint64_t>(number)) {
      return handle_job(request, JobId{*job}, rest.substr(number.size()), std::move(reply));
    }
  }
  if (collection == "workers") {
    return handle_workers(request, rest, std::move(reply));
  }
  reply(error_reply(unknown_path(request)));
}

void JsonApi::handle_jobs(const ApiRequest& request, Reply reply) {
  const Result<Page> page = page_of(request.query);
  const Status status = request.post ? other_method(request, "GET")
                        : !page.ok() ? page.status()
                                     : check_call(request.caller, Rpc::list_jobs);
  if (!status.ok()) {
    return reply(error_reply(status));
  }
  on_farm(std::move(reply),
          [page = *page, caller = request.caller, notices = greeting_.notices](Turn& turn, const FarmReply& back) {
            v1::ListJobsResponse list;
            list.mutable_notices()->Add(notices.begin(), notices.end());
            for (const JobStatus& job : turn.farm.jobs(turn.now)) {
              if (job.id.value >= page.before || !may_see_job(caller, job.owner)) {
                continue;
              }
              if (list.jobs_size() == page.size) {
                list.set_next_page_token(std::to_string(list.jobs(page.size - 1).id()));
                break;
              }
              to_wire(job, list.add_jobs());
            }
            back(json_reply(list));
          });
}

void JsonApi::handle_job(const ApiRequest& request, JobId job, std::string_view what, Reply reply) {
  const auto action = std::ranges::find(kActions, what, &JobChange::path);
  if (action == kActions.end() || !request.post) {
    const bool picture = what == "/thumbnail.png";
    if (request.post || (!what.empty() && !picture)) {
      const bool by_get = what.empty() || picture;
      const bool known = by_get || action != kActions.end();
      return reply(error_reply(known ? other_method(request, by_get ? "GET" : "POST") : unknown_path(request)));
    }
    return picture ? send_thumbnail(request, job, std::move(reply))
                   : change_job(
                         request, job, Rpc::get_job, [](Turn&) { return ok_status(); }, std::move(reply));
  }
  v1::ExtendJobRequest body;
  if (const Status status = read_body(request, body); !status.ok()) {
    return reply(error_reply(status));
  }
  change_job(
      request, job, action->rpc,
      [change = action->change, job, to = Extension{body.samples(), body.error()}](Turn& turn) {
        return change(turn, job, to);
      },
      std::move(reply));
}

/// Answers with the job, if it changed once that is durable.
void JsonApi::change_job(const ApiRequest& request, JobId job, Rpc rpc, std::function<Status(Turn&)> change,
                         Reply reply) {
  if (const Status status = check_call(request.caller, rpc); !status.ok()) {
    return reply(error_reply(status));
  }
  on_farm(std::move(reply), [job, rpc, request, change = std::move(change)](Turn& turn, const FarmReply& back) {
    const Result<std::string> owner = turn.farm.owner(job);
    Status status = owner.ok() ? check_job(request.caller, rpc, *owner) : owner.status();
    if (status.ok()) {
      status = change(turn);
    }
    if (status.ok() && rule_of(rpc).recorded) {
      record(turn, request, rpc, job.value, "");
    }
    const Result<JobStatus> now = status.ok() ? turn.farm.status(job, turn.now) : status;
    if (!now.ok()) {
      return back(error_reply(now.status()));
    }
    v1::Job wire;
    to_wire(*now, &wire);
    if (rpc == Rpc::get_job) {
      return back(json_reply(wire));
    }
    turn.replies.push_back(
        [back, answer = json_reply(wire)](const Status& stored) { back(stored.ok() ? answer : error_reply(stored)); });
  });
}

void JsonApi::handle_workers(const ApiRequest& request, std::string_view rest, Reply reply) {
  const auto action =
      std::ranges::find_if(kWorkerActions, [rest](const WorkerChange& each) { return rest.ends_with(each.path); });
  const bool known = rest.empty() || action != kWorkerActions.end();
  if (!known || request.post != !rest.empty()) {
    return reply(error_reply(known ? other_method(request, rest.empty() ? "GET" : "POST") : unknown_path(request)));
  }
  if (!rest.empty()) {
    const Result<std::string> name = percent_decoded(rest.substr(0, rest.size() - action->path.size()));
    return name.ok() ? change_worker(request, *name, action->rpc, action->change, std::move(reply))
                     : reply(error_reply(name.status()));
  }
  if (const Status status = check_call(request.caller, Rpc::list_workers); !status.ok()) {
    return reply(error_reply(status));
  }
  on_farm(std::move(reply), [](Turn& turn, const FarmReply& back) {
    v1::ListWorkersResponse list;
    for (const WorkerStatus& worker : turn.farm.workers(turn.now)) {
      to_wire(worker, list.add_workers());
    }
    back(json_reply(list));
  });
}

/// Answers with the worker once the change is durable; with nothing but its name if it is not there.
void JsonApi::change_worker(const ApiRequest& request, const std::string& name, Rpc rpc,
                            Status (Coordinator::*change)(const std::string&, Time, Step&), Reply reply) {
  if (const Status status = check_call(request.caller, rpc); !status.ok()) {
    return reply(error_reply(status));
  }
  on_farm(std::move(reply), [name, rpc, change, request](Turn& turn, const FarmReply& back) {
    if (const Status status = (turn.farm.*change)(name, turn.now, turn.step); !status.ok()) {
      return back(error_reply(status));
    }
    record(turn, request, rpc, 0, name);
    v1::Worker wire;
    wire.set_name(name);
    for (const WorkerStatus& worker : turn.farm.workers(turn.now)) {
      if (worker.name == name) {
        to_wire(worker, &wire);
      }
    }
    turn.replies.push_back(
        [back, answer = json_reply(wire)](const Status& stored) { back(stored.ok() ? answer : error_reply(stored)); });
  });
}

/// Takes the tiles on the farm thread, and adds them up on the web's unless that was done for just this film.
void JsonApi::send_thumbnail(const ApiRequest& request, JobId job, Reply reply) {
  if (const Status status = check_call(request.caller, Rpc::get_film); !status.ok()) {
    return reply(error_reply(status));
  }
  const auto kept = thumbnails_->find(job);
  const std::uint64_t known = kept == thumbnails_->end() ? 0 : kept->second.film_version;
  on_farm(std::move(reply), [job, known, caller = request.caller, thumbnails = thumbnails_](Turn& turn,
                                                                                            const FarmReply& back) {
    const Result<std::string> owner = turn.farm.owner(job);
    const Film* const film = turn.farm.film(job);
    Status status = owner.ok() ? check_job(caller, Rpc::get_film, *owner) : owner.status();
    if (status.ok() && (film->pixel_samples() == 0 || film->grid().picture_tiles() > kMostThumbnailTiles)) {
      status = not_found("job {} has no thumbnail: {}", job.value,
                         film->pixel_samples() == 0 ? "it has no samples yet" : "its film is too large");
    }
    if (!status.ok()) {
      return back(error_reply(status));
    }
    std::vector<TileSnapshot> tiles;
    for (std::uint32_t tile = 0; film->version() != known && tile < film->grid().picture_tiles(); ++tile) {
      tiles.push_back(snapshot(*film, TileId{tile}));
    }
    back.compute([job, thumbnails, tiles = std::move(tiles), crop = film->grid().crop(), version = film->version()] {
      if (!tiles.empty()) {
        Result<std::string> png = thumbnail_png(crop, tiles);
        if (!png.ok()) {
          return error_reply(png.status());
        }
        if (thumbnails->size() >= kMostThumbnails && !thumbnails->contains(job)) {
          thumbnails->erase(thumbnails->begin());
        }
        (*thumbnails)[job] = {version, std::move(*png)};
      }
      const auto made = thumbnails->find(job);
      return made != thumbnails->end() ? ApiReply{200, "image/png", made->second.png}
                                       : error_reply(unavailable("the thumbnail is gone: try again"));
    });
  });
}

}  // namespace lightmill
