// /api/v1: what programs and the page ask for over HTTP, as JSON. docs/web.md shows it; client/web/public/openapi.json
// describes it.
#pragma once

#include <functional>
#include <string>

#include "server/web/farm_reply.h"
#include "server/web/job_pictures.h"
#include "server/web/live_messages.h"
#include "server/web/logins.h"
#include "server/web/thumbnails.h"

namespace lightmill {

struct ApiRequest {
  bool post = false;  ///< else GET
  std::string path;   ///< without the query: /api/v1/…
  std::string query;  ///< without '?'
  std::string body;
  Result<Identity> caller;
  std::string login;  ///< the secret in the cookie; empty: none
  std::string peer;   ///< ADDRESS:PORT
  CookiePlace cookie;
};

/// Belongs to the web's thread.
class JsonApi {
 public:
  JsonApi(FarmLoop& loop, const Gate& gate, Logins& logins, FarmGreeting greeting, OnWebThread on_web_thread);

  /// Asks the gate, then the farm.
  void handle(const ApiRequest& request, Reply reply);

 private:
  ApiReply greet(const Result<Identity>& caller) const;
  ApiReply log_in(const ApiRequest& request);
  ApiReply log_out(const ApiRequest& request);
  void handle_jobs(const ApiRequest& request, Reply reply);
  void handle_job(const ApiRequest& request, JobId job, std::string_view what, Reply reply);
  void handle_workers(const ApiRequest& request, std::string_view rest, Reply reply);
  void show(const Call& call, JobId job, std::string_view what, Reply reply);
  using JobTask = std::function<Status(FarmLoop::Turn&)>;
  void change_job(const Call& call, JobId job, JobTask change, Reply reply);
  void change_worker(const Call& call, const std::string& name,
                     Status (Coordinator::*change)(const std::string&, Time, Step&), Reply reply);

  const Gate& gate_;
  Logins& logins_;
  const FarmGreeting greeting_;
  FarmDesk desk_;
  Thumbnails thumbnails_;
  JobPictures pictures_;
};

}  // namespace lightmill
