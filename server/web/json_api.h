// /api/v1: what programs and the page ask for over HTTP, as JSON. docs/web.md shows it; client/web/public/openapi.json
// describes it.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/access/rights.h"
#include "server/api/farm_loop.h"
#include "server/web/job_feed.h"
#include "server/web/live_messages.h"

namespace lightmill {

struct ApiRequest {
  bool post = false;  ///< else GET
  std::string path;   ///< without the query: /api/v1/…
  std::string query;  ///< without '?'
  std::string body;
  Identity caller;
  std::string peer;  ///< ADDRESS:PORT
};

struct ApiReply {
  unsigned status = 200;
  std::string content_type;
  std::string body;
};

/// {"error": {"code": "NOT_FOUND", "message": "…"}} with the HTTP status that belongs to the code.
ApiReply error_reply(const Status& status);

/// Called once, on the web's thread.
using Reply = std::function<void(ApiReply)>;

/// Takes an answer from any thread to the reply that waits for it, if that still does.
class FarmReply {
 public:
  using Waiting = std::map<std::uint64_t, Reply>;
  FarmReply(OnWebThread on_web_thread, const std::shared_ptr<Waiting>& waiting, std::uint64_t id)
      : on_web_thread_(std::move(on_web_thread)), waiting_(waiting), id_(id) {}
  void operator()(ApiReply answer) const {
    compute([answer = std::move(answer)] { return answer; });
  }
  /// The answer is worked out on the web's thread.
  void compute(std::function<ApiReply()> answer) const;

 private:
  OnWebThread on_web_thread_;
  std::weak_ptr<Waiting> waiting_;  ///< belongs to the web's thread
  std::uint64_t id_;
};

/// Belongs to the web's thread.
class JsonApi {
 public:
  JsonApi(FarmLoop& loop, FarmGreeting greeting, OnWebThread on_web_thread);

  /// Asks the rights, then the farm.
  void handle(const ApiRequest& request, Reply reply);

 private:
  using FarmTask = std::function<void(FarmLoop::Turn&, const FarmReply&)>;
  void on_farm(Reply reply, FarmTask task);
  void handle_jobs(const ApiRequest& request, Reply reply);
  void handle_job(const ApiRequest& request, JobId job, std::string_view what, Reply reply);
  void handle_workers(const ApiRequest& request, std::string_view rest, Reply reply);
  void change_worker(const ApiRequest& request, const std::string& name, Rpc rpc,
                     Status (Coordinator::*change)(const std::string&, Time, Step&), Reply reply);
  void change_job(const ApiRequest& request, JobId job, Rpc rpc, std::function<Status(FarmLoop::Turn&)> change,
                  Reply reply);
  void send_thumbnail(const ApiRequest& request, JobId job, Reply reply);

  struct Thumbnail {
    std::uint64_t film_version = 0;
    std::string png;
  };
  FarmLoop& loop_;
  const FarmGreeting greeting_;
  const OnWebThread on_web_thread_;
  const std::shared_ptr<FarmReply::Waiting> waiting_ = std::make_shared<FarmReply::Waiting>();
  std::uint64_t next_id_ = 1;
  const std::shared_ptr<std::map<JobId, Thumbnail>> thumbnails_ = std::make_shared<std::map<JobId, Thumbnail>>();
};

}  // namespace lightmill
