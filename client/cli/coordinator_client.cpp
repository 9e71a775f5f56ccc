#include "client/cli/coordinator_client.h"

#include <grpc/support/log.h>

#include <map>

#include "client/cli/coordinators.h"
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

/// Makes a context cancellable for a scope.
class Registration {
 public:
  Registration(RunningCalls& calls, grpc::ClientContext& context) : calls_(calls), context_(context) {
    calls_.add(context_);
  }
  ~Registration() { calls_.remove(context_); }
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;
  /// A call that ended as cancelled, but not by us, was ended by the coordinator.
  grpc::Status answer(const grpc::Status& end) const {
    return end.error_code() == grpc::StatusCode::CANCELLED && !calls_.is_cancelled(context_)
               ? grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                              "the farm has closed this call, to make room for another caller or because it stops: "
                              "try again")
               : end;
  }

 private:
  RunningCalls& calls_;
  grpc::ClientContext& context_;
};

using Stub = v1::RenderService::Stub;

/// One unary call with a deadline.
template <class State, class Service, class Request, class Response>
Status call(State& state, grpc::Status (Service::*method)(grpc::ClientContext*, const Request&, Response*),
            const Request& request, Response& response, Duration timeout = kCallTimeout) {
  return state.coordinators.ask([&](const Stubs& stubs) {
    grpc::ClientContext context;
    state.coordinators.show_token(context);
    context.set_deadline(deadline_after(timeout));
    const Registration registration(state.calls, context);
    return (stubs.of<Service>().*method)(&context, request, &response);
  });
}

/// The job after an operation whose request has only its id.
template <class State, class Service, class Request>
Result<v1::Job> call_for_job(State& state,
                             grpc::Status (Service::*method)(grpc::ClientContext*, const Request&, v1::Job*),
                             std::uint64_t id) {
  Request request;
  request.set_id(id);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(state, method, request, job));
  return job;
}

}  // namespace

struct CoordinatorClient::State {
  State(const std::string& addresses, CallerTexts caller) : coordinators(addresses, std::move(caller)) {}
  Coordinators coordinators;
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
  v1::ListWorkersResponse response;
  return call(*state_, &Stub::ListWorkers, request, response, timeout);
}

Result<std::vector<Sha256>> CoordinatorClient::find_missing_assets(std::span<const Sha256> digests) {
  v1::FindMissingAssetsRequest request;
  for (const Sha256& digest : digests) {
    request.add_digests(digest_bytes(digest));
  }
  v1::FindMissingAssetsResponse response;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::FindMissingAssets, request, response));
  std::vector<Sha256> missing;
  for (const std::string& bytes : response.missing()) {
    LM_ASSIGN_OR_RETURN(missing.emplace_back(), digest_from_bytes(bytes));
  }
  return missing;
}

Status CoordinatorClient::upload_asset(const Sha256& digest, ByteView bytes,
                                       const std::function<void(std::size_t)>& sent) {
  return state_->coordinators.ask([&](const Stubs& stubs) {
    grpc::ClientContext context;
    state_->coordinators.show_token(context);
    const Registration registration(state_->calls, context);
    v1::UploadAssetResponse response;
    const auto writer = stubs.render->UploadAsset(&context, &response);
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
    return registration.answer(writer->Finish());
  });
}

Result<v1::Job> CoordinatorClient::submit(const v1::SubmitJobRequest& request) {
  v1::Job job;
  Status status;
  for (int i = 0; i < kSubmitTries; ++i) {
    status = call(*state_, &Stub::SubmitJob, request, job);
    if (status.code() != StatusCode::kUnavailable) {
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200) * (1 << i));
  }
  LM_RETURN_IF_ERROR(status);
  return job;
}

Result<v1::Job> CoordinatorClient::get_job(std::uint64_t id) {
  return call_for_job(*state_, &Stub::GetJob, id);
}

Result<ListedJobs> CoordinatorClient::list_jobs(v1::ListJobsRequest request, std::size_t limit) {
  ListedJobs all;
  request.set_page_size(kPageSize);
  while (all.items.size() < limit) {
    v1::ListJobsResponse response;
    LM_RETURN_IF_ERROR(call(*state_, &Stub::ListJobs, request, response));
    for (v1::Job& job : *response.mutable_jobs()) {
      if (all.items.size() < limit) {
        all.items.push_back(std::move(job));
      }
    }
    all.notices.assign(response.notices().begin(), response.notices().end());
    all.total = std::max(all.total, response.total());
    if (response.next_page_token().empty()) {
      break;
    }
    request.set_page_token(response.next_page_token());
  }
  return all;
}

Result<v1::Job> CoordinatorClient::cancel_job(std::uint64_t id) {
  return call_for_job(*state_, &Stub::CancelJob, id);
}

Result<v1::Job> CoordinatorClient::pause_job(std::uint64_t id) {
  return call_for_job(*state_, &Stub::PauseJob, id);
}

Result<v1::Job> CoordinatorClient::resume_job(std::uint64_t id) {
  return call_for_job(*state_, &Stub::ResumeJob, id);
}

Result<v1::Job> CoordinatorClient::extend_job(std::uint64_t id, std::uint64_t samples, double error) {
  v1::ExtendJobRequest request;
  request.set_id(id);
  request.set_samples(samples);
  request.set_error(error);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::ExtendJob, request, job));
  return job;
}

Result<v1::Job> CoordinatorClient::set_priority(std::uint64_t id, std::int32_t priority) {
  v1::SetPriorityRequest request;
  request.set_id(id);
  request.set_priority(priority);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::SetPriority, request, job));
  return job;
}

Status CoordinatorClient::delete_job(std::uint64_t id, bool cancel) {
  v1::DeleteJobRequest request;
  request.set_id(id);
  request.set_cancel(cancel);
  v1::DeleteJobResponse response;
  return call(*state_, &Stub::DeleteJob, request, response);
}

Status CoordinatorClient::watch(std::uint64_t id, bool tiles, const std::function<bool()>& stop,
                                const std::function<void(const v1::WatchJobResponse&)>& changed) {
  bool begun = false;
  const auto watch_one = [&](const Stubs& stubs) {
    grpc::ClientContext context;
    state_->coordinators.show_token(context);
    const Registration registration(state_->calls, context);
    if (stop()) {
      return grpc::Status(grpc::StatusCode::CANCELLED, "interrupted");
    }
    v1::WatchJobRequest request;
    request.set_id(id);
    request.set_tiles(tiles);
    const auto reader = stubs.render->WatchJob(&context, request);
    v1::WatchJobResponse response;
    while (reader->Read(&response)) {
      begun = true;
      changed(response);
      response.Clear();
    }
    return reader->Finish();
  };
  return state_->coordinators.ask(watch_one, begun);
}

Status CoordinatorClient::get_film(std::uint64_t id, const std::function<Status(const v1::GetFilmResponse&)>& part) {
  Status failed = ok_status();
  bool begun = false;
  const auto get_from = [&](const Stubs& stubs) {
    grpc::ClientContext context;
    state_->coordinators.show_token(context);
    const Registration registration(state_->calls, context);
    v1::GetFilmRequest request;
    request.set_id(id);
    const auto reader = stubs.render->GetFilm(&context, request);
    v1::GetFilmResponse response;
    while (failed.ok() && reader->Read(&response)) {
      begun = true;
      failed = part(response);
    }
    if (!failed.ok()) {
      context.TryCancel();
    }
    return registration.answer(reader->Finish());
  };
  const Status status = state_->coordinators.ask(get_from, begun);
  return failed.ok() ? status : failed;
}

Result<ListedWorkers> CoordinatorClient::list_workers() {
  ListedWorkers all;
  v1::ListWorkersRequest request;
  request.set_page_size(kWorkersPage);
  for (;;) {
    v1::ListWorkersResponse response;
    LM_RETURN_IF_ERROR(call(*state_, &Stub::ListWorkers, request, response));
    for (v1::Worker& worker : *response.mutable_workers()) {
      all.items.push_back(std::move(worker));
    }
    all.notices.assign(response.notices().begin(), response.notices().end());
    all.wanted = response.wanted_workers();
    if (response.next_page_token().empty()) {
      return all;
    }
    request.set_page_token(response.next_page_token());
  }
}

Result<v1::Worker> CoordinatorClient::drain_worker(const std::string& name) {
  v1::DrainWorkerRequest request;
  request.set_name(name);
  v1::Worker worker;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::DrainWorker, request, worker));
  return worker;
}

Result<v1::Worker> CoordinatorClient::quarantine_worker(const v1::QuarantineWorkerRequest& request) {
  v1::Worker worker;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::QuarantineWorker, request, worker));
  return worker;
}

Status CoordinatorClient::release_worker(const std::string& name) {
  v1::ReleaseWorkerRequest request;
  request.set_name(name);
  v1::ReleaseWorkerResponse response;
  return call(*state_, &Stub::ReleaseWorker, request, response);
}

Result<v1::Token> CoordinatorClient::create_token(const v1::CreateTokenRequest& request) {
  v1::Token token;
  Status status;
  for (int i = 0; i < kSubmitTries; ++i) {
    status = call(*state_, &v1::AccessService::Stub::CreateToken, request, token);
    if (status.code() != StatusCode::kUnavailable) {
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200) * (1 << i));
  }
  LM_RETURN_IF_ERROR(status);
  return token;
}

Result<std::vector<v1::Token>> CoordinatorClient::list_tokens() {
  std::vector<v1::Token> tokens;
  v1::ListTokensRequest request;
  request.set_page_size(kPageSize);
  for (;;) {
    v1::ListTokensResponse response;
    LM_RETURN_IF_ERROR(call(*state_, &v1::AccessService::Stub::ListTokens, request, response));
    tokens.insert(tokens.end(), response.tokens().begin(), response.tokens().end());
    if (response.next_page_token().empty()) {
      return tokens;
    }
    request.set_page_token(response.next_page_token());
  }
}

Result<v1::RevokeTokenResponse> CoordinatorClient::revoke_token(const v1::RevokeTokenRequest& request) {
  v1::RevokeTokenResponse response;
  LM_RETURN_IF_ERROR(call(*state_, &v1::AccessService::Stub::RevokeToken, request, response));
  return response;
}

Result<std::vector<v1::Action>> CoordinatorClient::list_actions(v1::ListActionsRequest request, std::size_t limit) {
  std::vector<v1::Action> actions;
  while (actions.size() < limit) {
    request.set_page_size(static_cast<int>(std::min<std::size_t>(limit - actions.size(), kPageSize)));
    v1::ListActionsResponse response;
    LM_RETURN_IF_ERROR(call(*state_, &v1::AccessService::Stub::ListActions, request, response));
    actions.insert(actions.end(), response.actions().begin(), response.actions().end());
    if (response.next_page_token().empty()) {
      break;
    }
    request.set_page_token(response.next_page_token());
  }
  return actions;
}

}  // namespace lightmill::cli
