// The client's side of lightmill.v1.RenderService: one farm, blocking calls, errors as values.
//
// cancel_calls may come from another thread. A coordinator that cannot be reached gives UNAVAILABLE with its address.
// It gives FAILED_PRECONDITION where the cause is known and waiting does not help (certificates). Errors of the
// coordinator itself keep their code and message. A job that the client has seen is ABORTED once another farm answers,
// or the farm does not have it any more (KnownJobs).
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/security/caller.h"
#include "lightmill/v1/access_service.pb.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill::cli {

template <class T>
struct Listed {
  std::vector<T> items;
  std::vector<std::string> notices;  ///< facts about the farm that every user should know
};

struct ListedJobs : Listed<v1::Job> {
  std::uint64_t total = 0;  ///< number of matching jobs, beyond the limit too
};

struct ListedWorkers : Listed<v1::Worker> {
  std::uint32_t wanted = 0;  ///< the number of workers that the farm could use now
};

class CoordinatorClient {
 public:
  /// `address`: HOST:PORT of the coordinator, or of several, with commas. One of them is active, and calls go to the
  /// one that answers. Connects lazily, so this does not fail.
  explicit CoordinatorClient(std::string address, CallerTexts caller = {});
  ~CoordinatorClient();
  CoordinatorClient(const CoordinatorClient&) = delete;
  CoordinatorClient& operator=(const CoordinatorClient&) = delete;

  const std::string& address() const { return address_; }

  /// Whether a Lightmill coordinator answers within `timeout`.
  Status probe(Duration timeout);

  Result<std::vector<Sha256>> find_missing_assets(std::span<const Sha256> digests);
  /// Calls `sent` after each chunk with the bytes sent so far.
  Status upload_asset(const Sha256& digest, ByteView bytes, const std::function<void(std::size_t)>& sent);

  /// Retries if the connection breaks. The request id makes this safe.
  Result<v1::Job> submit(const v1::SubmitJobRequest& request);
  Result<v1::Job> get_job(std::uint64_t id);
  /// The jobs that the request selects, newest first, at most `limit`.
  Result<ListedJobs> list_jobs(v1::ListJobsRequest request, std::size_t limit);
  Result<v1::Job> cancel_job(std::uint64_t id);
  Result<v1::Job> pause_job(std::uint64_t id);
  Result<v1::Job> resume_job(std::uint64_t id);
  /// 0 keeps a limit.
  Result<v1::Job> extend_job(std::uint64_t id, std::uint64_t samples, double error);
  Result<v1::Job> set_priority(std::uint64_t id, std::int32_t priority);
  /// `cancel`: cancels the job first, if it has not ended.
  Status delete_job(std::uint64_t id, bool cancel = false);

  /// One stream of a job's changes. Returns OK when the job has ended. `stop` is asked once the call can be cancelled,
  /// so that an earlier cancel_calls is not lost.
  Status watch(std::uint64_t id, bool tiles, const std::function<bool()>& stop,
               const std::function<void(const v1::WatchJobResponse&)>& changed);

  /// Receives the header first, then every tile. An error of `part` ends the call and is returned.
  Status get_film(std::uint64_t id, const std::function<Status(const v1::GetFilmResponse&)>& part);

  Result<ListedWorkers> list_workers();
  Result<v1::Worker> drain_worker(const std::string& name);
  Result<v1::Worker> quarantine_worker(const v1::QuarantineWorkerRequest& request);
  Status release_worker(const std::string& name);

  /// Retries if the connection breaks. The same request makes only one token.
  Result<v1::Token> create_token(const v1::CreateTokenRequest& request);
  Result<std::vector<v1::Token>> list_tokens();
  Result<v1::RevokeTokenResponse> revoke_token(const v1::RevokeTokenRequest& request);

  /// The action log, newest first, at most `limit`. Reads all pages that `request` selects.
  Result<std::vector<v1::Action>> list_actions(v1::ListActionsRequest request, std::size_t limit);

  /// Cancels the calls in progress.
  void cancel_calls();

 private:
  struct State;
  std::string address_;
  std::unique_ptr<State> state_;
};

}  // namespace lightmill::cli
