// /api/v1: what programs and the page ask for over HTTP, as JSON. docs/reference/http-api.md shows it;
// client/web/public/openapi.json describes it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "server/operations/operation.h"
#include "server/web/byte_budget.h"
#include "server/web/farm_reply.h"
#include "server/web/film_answers.h"
#include "server/web/http_route.h"
#include "server/web/job_pictures.h"
#include "server/web/live_messages.h"
#include "server/web/logins.h"
#include "server/web/page_jobs.h"

namespace lightmill {

/// The operation that is asked for by POST at this path, if its bodies may be large: whether the call may be made is
/// asked before its body is taken in. Else null.
const Operation* find_large_operation(std::string_view path);

struct LargeBody {
  std::string text;
  ByteBudget::Place place;  ///< null: it is small
};

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

/// Runs something on a thread for what takes its time; drops it when the web ends. Thread-safe.
using OnSideThread = std::function<void(std::function<void()>)>;

/// What the API works with.
struct ApiParts {
  Runtime& runtime;
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
  /// What large answers may hold together until they are read; those of one caller half.
  static constexpr std::uint64_t kMostAnswerBytes = std::uint64_t{256} << 20;
  explicit JsonApi(ApiParts parts);

  /// Asks the gate, then the farm. A call with a large body has been admitted.
  void handle(ApiRequest request, Reply reply);

 private:
  ApiReply handle_caller(const ApiRequest& request, std::string_view what);
  ApiReply greet(const Result<Identity>& caller) const;
  ApiReply log_in(const ApiRequest& request);
  ApiReply log_out(const ApiRequest& request);
  bool show_film(const ApiRequest& request, std::string_view path, Reply& reply);
  void show_metrics(const ApiRequest& request, Reply reply);
  void run(const HttpRoute& route, ApiRequest request, Reply reply);

  Runtime& runtime_;
  const Gate& gate_;
  Logins& logins_;
  PageJobs& page_jobs_;
  const FarmGreeting greeting_;
  const OnSideThread on_side_thread_;
  FarmDesk desk_;
  FilmAnswers thumbnails_, meters_;
  JobPictures pictures_;
  /// Of answers; bodies have one of their own, so that who reads slowly holds up nobody who sends. The farm thread's
  /// own.
  const std::shared_ptr<CallersBudget> budget_ = std::make_shared<CallersBudget>(kMostAnswerBytes);
};

}  // namespace lightmill
