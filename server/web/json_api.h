// The JSON API under /api/v1/, for the page and for programs. docs/reference/http-api.md explains it, and
// client/web/public/openapi.json describes it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "server/operations/operation.h"
#include "server/web/byte_budget.h"
#include "server/web/farm_requests.h"
#include "server/web/film_reply_cache.h"
#include "server/web/http_authenticator.h"
#include "server/web/http_route.h"
#include "server/web/job_pictures.h"
#include "server/web/live_messages.h"
#include "server/web/page_jobs.h"

namespace lightmill {

/// The operation for a POST to this path, if its body may be large. Such a call is admitted before its body is read.
/// Otherwise null.
const Operation* find_large_operation(std::string_view path);

struct LargeBody {
  std::string text;
  ByteBudget::Reservation reservation;  ///< null: the body is small
};

struct ApiRequest {
  bool post = false;  ///< otherwise GET
  std::string path;   ///< without the query: /api/v1/…, or kMetricsPath
  std::string query;  ///< without '?'
  LargeBody body;
  std::optional<Call> call;  ///< if it was admitted before its body was read
  Result<Identity> caller;
  std::string login;  ///< the secret in the cookie; empty: none
  std::string peer;   ///< ADDRESS:PORT
  CookieScope cookie;
};

/// Runs a slow function on another thread. Drops it when the web server ends. Thread-safe.
using OnSideThread = std::function<void(std::function<void()>)>;

/// Parts of the coordinator that the API uses.
struct ApiParts {
  Runtime& runtime;
  HttpAuthenticator& authenticator;
  PageJobs& page_jobs;
  FarmGreeting greeting;
  OnWebThread on_web_thread;
  OnSideThread on_side_thread;
  std::uint64_t picture_bytes;  ///< WebOptions::file_bytes
};

/// Used on the web thread.
class JsonApi {
 public:
  /// Memory limit of large replies until they are read. One caller gets at most half.
  static constexpr std::uint64_t kMaxAnswerBytes = std::uint64_t{256} << 20;
  explicit JsonApi(ApiParts parts);

  /// Admits the call, then asks the farm. A call with a large body is admitted already.
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
  const AccessControl& access_;
  HttpAuthenticator& authenticator_;
  PageJobs& page_jobs_;
  const FarmGreeting greeting_;
  const OnSideThread on_side_thread_;
  FarmRequests farm_requests_;
  FilmReplyCache thumbnails_, meters_;
  JobPictures pictures_;
  /// For replies. Bodies have their own budget, so a slow reader does not block senders. Used on the farm thread.
  const std::shared_ptr<CallersBudget> budget_ = std::make_shared<CallersBudget>(kMaxAnswerBytes);
};

}  // namespace lightmill
