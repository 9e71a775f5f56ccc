// /api/v1: what programs and the page ask for over HTTP, as JSON. docs/web.md shows it; client/web/public/openapi.json
// describes it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "server/web/farm_reply.h"
#include "server/web/film_answers.h"
#include "server/web/job_intake.h"
#include "server/web/job_pictures.h"
#include "server/web/live_messages.h"
#include "server/web/logins.h"
#include "server/web/web_change.h"

namespace lightmill {

struct ApiRequest {
  bool post = false;  ///< else GET
  std::string path;   ///< without the query: /api/v1/…, or kMetricsPath
  std::string query;  ///< without '?'
  LargeBody body;
  std::optional<Call> call;  ///< if it was admitted before its body was taken in
  Result<Identity> caller;
  std::string login;  ///< the secret in the cookie; empty: none
  std::string peer;   ///< ADDRESS:PORT
  CookiePlace cookie;
};

/// What the API works with.
struct ApiParts {
  FarmLoop& loop;
  const Gate& gate;
  const AssetStore& assets;
  Logins& logins;
  PageJobs& page_jobs;
  FarmGreeting greeting;
  OnWebThread on_web_thread;
  OnSideThread on_side_thread;
  std::uint64_t picture_bytes;  ///< WebOptions::file_bytes
};

/// Belongs to the web's thread.
class JsonApi {
 public:
  explicit JsonApi(ApiParts parts);

  /// Asks the gate, then the farm. A large call (find_large_call) has been admitted.
  void handle(ApiRequest request, Reply reply);

 private:
  ApiReply handle_caller(const ApiRequest& request, std::string_view what);
  ApiReply greet(const Result<Identity>& caller) const;
  ApiReply log_in(const ApiRequest& request);
  ApiReply log_out(const ApiRequest& request);
  void list_jobs(const ApiRequest& request, Reply reply);
  void handle_job(const ApiRequest& request, JobId job, std::string_view what, Reply reply);
  void handle_workers(const ApiRequest& request, std::string_view rest, Reply reply);
  void show_metrics(const ApiRequest& request, Reply reply);
  void look_back(const ApiRequest& request, std::string_view path, Reply reply);
  void show(const Call& call, JobId job, std::string_view what, Reply reply);
  void change(const Call& call, WebChange change, Reply reply, std::optional<JobId> with_film_of = std::nullopt);

  FarmLoop& loop_;
  const Gate& gate_;
  Logins& logins_;
  const FarmGreeting greeting_;
  FarmDesk desk_;
  FilmAnswers thumbnails_, meters_;
  JobPictures pictures_;
  JobIntake intake_;
};

}  // namespace lightmill
