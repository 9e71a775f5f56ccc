#include "client/cli/coordinator_client.h"

#include <grpc/support/log.h>

#include <algorithm>
#include <map>
#include <thread>

#include "client/cli/coordinators.h"
#include "client/cli/known_jobs.h"
#include "common/base/mutex.h"
#include "common/wire/bytes.h"

namespace lightmill::cli {
namespace {

constexpr Duration kCallTimeout = std::chrono::seconds(30);
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr int kPageSize = 200;
constexpr int kWorkersPage = 1000;  ///< they are short, and may be thousands
constexpr int kSubmitTries = 4;

std::chrono::system_clock::time_point deadline_after(Duration timeout) {
  return std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::system_clock::duration>(timeout);
}

/// The calls that can be cancelled now. Thread-safe.
class RunningCalls {
 public:
  void add(grpc::ClientContext& context) {
    const MutexLock lock(mutex_);
    contexts_[&context] = false;
  }
  void remove(grpc::ClientContext& context) {
    const MutexLock lock(mutex_);
    contexts_.erase(&context);
  }
  void cancel_all() {
    const MutexLock lock(mutex_);
    for (auto& [context, cancelled] : contexts_) {
      context->TryCancel();
      cancelled = true;
    }
  }
  bool is_cancelled(grpc::ClientContext& context) const {
    const MutexLock lock(mutex_);
    return contexts_.at(&context);
  }

 private:
  mutable Mutex mutex_;
  std::map<grpc::ClientContext*, bool> contexts_ LM_GUARDED_BY(mutex_);  ///< whether they were cancelled
};

/// The context of a call, with the caller's token. It can be cancelled while it lives.
class OpenCall {
 public:
  template <class State>
  explicit OpenCall(State& state) : calls_(state.calls) {
    state.coordinators.show_token(context);
    calls_.add(context);
  }
  ~OpenCall() { calls_.remove(context); }
  OpenCall(const OpenCall&) = delete;
  OpenCall& operator=(const OpenCall&) = delete;
  /// A call that ended as cancelled, but not by us, was ended by the coordinator.
  grpc::Status answer(const grpc::Status& end) {
    return end.error_code() == grpc::StatusCode::CANCELLED && !calls_.is_cancelled(context)
               ? grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                              "the farm has closed this call, to make room for another caller or because it stops: "
                              "try again")
               : end;
  }

  grpc::ClientContext context;

 private:
  RunningCalls& calls_;
};

using Stub = v1::RenderService::Stub;
using AccessStub = v1::AccessService::Stub;

template <class Service, class Request, class Response>
using UnaryMethod = grpc::Status (Service::*)(grpc::ClientContext*, const Request&, Response*);

/// One unary call with a deadline.
template <class State, class Service, class Request, class Response>
Result<Response> call(State& state, UnaryMethod<Service, Request, Response> method, const Request& request,
                      Duration timeout = kCallTimeout) {
  Response response;
  LM_RETURN_IF_ERROR(state.coordinators.ask([&](const Stubs& stubs) {
    OpenCall open(state);
    open.context.set_deadline(deadline_after(timeout));
    return (stubs.of<Service>().*method)(&open.context, request, &response);
  }));
  return response;
}

/// Tries again if the connection breaks. The id of the request makes this safe.
template <class State, class Service, class Request, class Response>
Result<Response> call_with_retries(State& state, UnaryMethod<Service, Request, Response> method,
                                   const Request& request) {
  for (int tries = 1;; ++tries) {
    Result<Response> response = call(state, method, request);
    if (response.status().code() != StatusCode::kUnavailable || tries == kSubmitTries) {
      return response;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100) * (1 << tries));
  }
}

/// The job after an operation, if it is the job that the client knows by this number.
template <class State, class Service, class Request>
Result<v1::Job> call_for_job(State& state, UnaryMethod<Service, Request, v1::Job> method, const Request& request) {
  Result<v1::Job> job = call(state, method, request);
  LM_RETURN_IF_ERROR(state.known.about(request.id(), job.status()));
  LM_RETURN_IF_ERROR(state.known.meet(*job));
  return job;
}

/// A request that has only the id of a job.
template <class Request>
Request about_job(std::uint64_t id) {
  Request request;
  request.set_id(id);
  return request;
}

/// An error if the client knows the job, and the farm does not have it any more. Changes ask this first, so that they
/// do not change a job of another farm.
template <class State>
Status check_still_there(State& state, std::uint64_t id) {
  return state.known.has(id) ? call_for_job(state, &Stub::GetJob, about_job<v1::GetJobRequest>(id)).status()
                             : ok_status();
}

template <class State, class Service, class Request>
Result<v1::Job> change_job(State& state, UnaryMethod<Service, Request, v1::Job> method, const Request& request) {
  LM_RETURN_IF_ERROR(check_still_there(state, request.id()));
  return call_for_job(state, method, request);
}

/// Gives each page to `take`, until it returns false.
template <class State, class Service, class Request, class Response, class Take>
Status read_pages(State& state, UnaryMethod<Service, Request, Response> method, Request request, const Take& take) {
  for (;;) {
    LM_ASSIGN_OR_RETURN(Response page, call(state, method, request));
    request.set_page_token(page.next_page_token());
    if (!take(page) || request.page_token().empty()) {
      return ok_status();
    }
  }
}

}  // namespace

struct CoordinatorClient::State {
  State(const std::string& addresses, CallerTexts caller)
      : coordinators(addresses, std::move(caller)), known(addresses) {}
  Coordinators coordinators;
  KnownJobs known;
  RunningCalls calls;
};

CoordinatorClient::CoordinatorClient(std::string address, CallerTexts caller)
    : address_(std::move(address)), state_(std::make_unique<State>(address_, std::move(caller))) {
  gpr_set_log_function([](gpr_log_func_args*) {});  // gRPC's own log is off, because errors have what matters
}

CoordinatorClient::~CoordinatorClient() = default;

void CoordinatorClient::cancel_calls() {
  state_->calls.cancel_all();
}

Status CoordinatorClient::probe(Duration timeout) {
  v1::ListWorkersRequest request;
  request.set_page_size(1);
  return call(*state_, &Stub::ListWorkers, request, timeout).status();
}

Result<std::vector<Sha256>> CoordinatorClient::find_missing_assets(std::span<const Sha256> digests) {
  v1::FindMissingAssetsRequest request;
  for (const Sha256& digest : digests) {
    request.add_digests(digest_bytes(digest));
  }
  LM_ASSIGN_OR_RETURN(const v1::FindMissingAssetsResponse response, call(*state_, &Stub::FindMissingAssets, request));
  std::vector<Sha256> missing;
  for (const std::string& bytes : response.missing()) {
    LM_ASSIGN_OR_RETURN(missing.emplace_back(), digest_from_bytes(bytes));
  }
  return missing;
}

Status CoordinatorClient::upload_asset(const Sha256& digest, ByteView bytes,
                                       const std::function<void(std::size_t)>& sent) {
  return state_->coordinators.ask([&](const Stubs& stubs) {
    OpenCall open(*state_);
    v1::UploadAssetResponse response;
    const auto writer = stubs.render->UploadAsset(&open.context, &response);
    v1::UploadAssetRequest request;
    request.set_digest(digest_bytes(digest));
    std::size_t done = 0;
    do {
      const ByteView chunk = bytes.subspan(done, std::min(kChunkBytes, bytes.size() - done));
      request.set_chunk(chunk.data(), chunk.size());
      if (!writer->Write(request)) {
        break;  // Finish says why
      }
      request.clear_digest();
      done += chunk.size();
      sent(done);
    } while (done < bytes.size());
    writer->WritesDone();
    return open.answer(writer->Finish());
  });
}

Result<v1::Job> CoordinatorClient::submit(const v1::SubmitJobRequest& request) {
  Result<v1::Job> job = call_with_retries(*state_, &Stub::SubmitJob, request);
  if (job.ok()) {
    LM_RETURN_IF_ERROR(state_->known.meet(*job));
  }
  return job;
}

Result<v1::Job> CoordinatorClient::get_job(std::uint64_t id) {
  return call_for_job(*state_, &Stub::GetJob, about_job<v1::GetJobRequest>(id));
}

Result<ListedJobs> CoordinatorClient::list_jobs(v1::ListJobsRequest request, std::size_t limit) {
  ListedJobs all;
  request.set_page_size(kPageSize);
  LM_RETURN_IF_ERROR(read_pages(*state_, &Stub::ListJobs, std::move(request), [&](v1::ListJobsResponse& page) {
    for (v1::Job& job : *page.mutable_jobs()) {
      if (all.items.size() < limit) {
        all.items.push_back(std::move(job));
      }
    }
    all.notices.assign(page.notices().begin(), page.notices().end());
    all.total = std::max(all.total, page.total());
    return all.items.size() < limit;
  }));
  return all;
}

Result<v1::Job> CoordinatorClient::cancel_job(std::uint64_t id) {
  return change_job(*state_, &Stub::CancelJob, about_job<v1::CancelJobRequest>(id));
}

Result<v1::Job> CoordinatorClient::pause_job(std::uint64_t id) {
  return change_job(*state_, &Stub::PauseJob, about_job<v1::PauseJobRequest>(id));
}

Result<v1::Job> CoordinatorClient::resume_job(std::uint64_t id) {
  return change_job(*state_, &Stub::ResumeJob, about_job<v1::ResumeJobRequest>(id));
}

Result<v1::Job> CoordinatorClient::extend_job(std::uint64_t id, std::uint64_t samples, double error) {
  v1::ExtendJobRequest request;
  request.set_id(id);
  request.set_samples(samples);
  request.set_error(error);
  return change_job(*state_, &Stub::ExtendJob, request);
}

Result<v1::Job> CoordinatorClient::set_priority(std::uint64_t id, std::int32_t priority) {
  v1::SetPriorityRequest request;
  request.set_id(id);
  request.set_priority(priority);
  return change_job(*state_, &Stub::SetPriority, request);
}

Status CoordinatorClient::delete_job(std::uint64_t id, bool cancel) {
  LM_RETURN_IF_ERROR(check_still_there(*state_, id));
  v1::DeleteJobRequest request;
  request.set_id(id);
  request.set_cancel(cancel);
  return call(*state_, &Stub::DeleteJob, request).status();
}

Status CoordinatorClient::watch(std::uint64_t id, bool tiles, const std::function<bool()>& stop,
                                const std::function<void(const v1::WatchJobResponse&)>& changed) {
  Status failed = ok_status();
  bool begun = false;
  const auto watch_one = [&](const Stubs& stubs) {
    OpenCall open(*state_);
    if (stop()) {
      return grpc::Status(grpc::StatusCode::CANCELLED, "interrupted");
    }
    v1::WatchJobRequest request;
    request.set_id(id);
    request.set_tiles(tiles);
    const auto reader = stubs.render->WatchJob(&open.context, request);
    v1::WatchJobResponse response;
    while (failed.ok() && reader->Read(&response)) {
      begun = true;
      failed = state_->known.meet(response.job());
      if (failed.ok()) {
        changed(response);
      }
      response.Clear();
    }
    if (!failed.ok()) {
      open.context.TryCancel();
    }
    return reader->Finish();
  };
  const Status status = state_->known.about(id, state_->coordinators.ask(watch_one, begun));
  return failed.ok() ? status : failed;
}

Status CoordinatorClient::get_film(std::uint64_t id, const std::function<Status(const v1::GetFilmResponse&)>& part) {
  Status failed = ok_status();
  bool begun = false;
  const auto get_from = [&](const Stubs& stubs) {
    OpenCall open(*state_);
    v1::GetFilmRequest request;
    request.set_id(id);
    const auto reader = stubs.render->GetFilm(&open.context, request);
    v1::GetFilmResponse response;
    while (failed.ok() && reader->Read(&response)) {
      begun = true;
      failed = response.has_header() ? state_->known.meet(response.header().job()) : ok_status();
      failed = failed.ok() ? part(response) : failed;
    }
    if (!failed.ok()) {
      open.context.TryCancel();
    }
    return open.answer(reader->Finish());
  };
  const Status status = state_->known.about(id, state_->coordinators.ask(get_from, begun));
  return failed.ok() ? status : failed;
}

Result<ListedWorkers> CoordinatorClient::list_workers() {
  ListedWorkers all;
  v1::ListWorkersRequest request;
  request.set_page_size(kWorkersPage);
  LM_RETURN_IF_ERROR(read_pages(*state_, &Stub::ListWorkers, request, [&](v1::ListWorkersResponse& page) {
    for (v1::Worker& worker : *page.mutable_workers()) {
      all.items.push_back(std::move(worker));
    }
    all.notices.assign(page.notices().begin(), page.notices().end());
    all.wanted = page.wanted_workers();
    return true;
  }));
  return all;
}

Result<v1::Worker> CoordinatorClient::drain_worker(const std::string& name) {
  v1::DrainWorkerRequest request;
  request.set_name(name);
  return call(*state_, &Stub::DrainWorker, request);
}

Result<v1::Worker> CoordinatorClient::quarantine_worker(const v1::QuarantineWorkerRequest& request) {
  return call(*state_, &Stub::QuarantineWorker, request);
}

Status CoordinatorClient::release_worker(const std::string& name) {
  v1::ReleaseWorkerRequest request;
  request.set_name(name);
  return call(*state_, &Stub::ReleaseWorker, request).status();
}

Result<v1::Token> CoordinatorClient::create_token(const v1::CreateTokenRequest& request) {
  return call_with_retries(*state_, &AccessStub::CreateToken, request);
}

Result<std::vector<v1::Token>> CoordinatorClient::list_tokens() {
  std::vector<v1::Token> tokens;
  v1::ListTokensRequest request;
  request.set_page_size(kPageSize);
  LM_RETURN_IF_ERROR(read_pages(*state_, &AccessStub::ListTokens, request, [&](const v1::ListTokensResponse& page) {
    tokens.insert(tokens.end(), page.tokens().begin(), page.tokens().end());
    return true;
  }));
  return tokens;
}

Result<v1::RevokeTokenResponse> CoordinatorClient::revoke_token(const v1::RevokeTokenRequest& request) {
  return call(*state_, &AccessStub::RevokeToken, request);
}

Result<std::vector<v1::Action>> CoordinatorClient::list_actions(v1::ListActionsRequest request, std::size_t limit) {
  std::vector<v1::Action> actions;
  request.set_page_size(static_cast<int>(std::min<std::size_t>(limit, kPageSize)));
  const auto take = [&](const v1::ListActionsResponse& page) {
    actions.insert(actions.end(), page.actions().begin(), page.actions().end());
    return actions.size() < limit;
  };
  LM_RETURN_IF_ERROR(read_pages(*state_, &AccessStub::ListActions, std::move(request), take));
  actions.resize(std::min(actions.size(), limit));
  return actions;
}

}  // namespace lightmill::cli
