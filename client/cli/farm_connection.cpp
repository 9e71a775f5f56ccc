#include "client/cli/farm_connection.h"

#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>

#include <atomic>

#include "common/base/mutex.h"
#include "common/security/connection_problem.h"
#include "common/wire/bytes.h"
#include "lightmill/v1/render_service.grpc.pb.h"

namespace lightmill::cli {
namespace {

constexpr Duration kCallTimeout = std::chrono::seconds(30);
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr int kMaxMessageBytes = 64 << 20;  // a watcher may get many tiles at once
constexpr int kPageSize = 200;
constexpr int kSubmitTries = 4;

std::chrono::system_clock::time_point deadline_after(Duration timeout) {
  return std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::system_clock::duration>(timeout);
}

std::shared_ptr<grpc::ChannelCredentials> credentials_of(const TlsTexts& tls) {
  return tls.given() ? grpc::SslCredentials({tls.authority, tls.key, tls.certificate})
                     : grpc::InsecureChannelCredentials();
}

/// `quickly`: there is somebody else to ask when a coordinator falls silent.
std::shared_ptr<grpc::Channel> make_channel(const std::string& address, const TlsTexts& tls, bool quickly) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 3'000);  // how long a connection may take to come about
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, quickly ? 3'000 : 20'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, quickly ? 3'000 : 10'000);
  return grpc::CreateCustomChannel(address, credentials_of(tls), arguments);
}

/// The calls that can be cancelled now. Thread-safe.
class RunningCalls {
 public:
  void add(grpc::ClientContext& context) {
    const MutexLock lock(mutex_);
    contexts_.insert(&context);
  }
  void remove(grpc::ClientContext& context) {
    const MutexLock lock(mutex_);
    contexts_.erase(&context);
  }
  void cancel_all() {
    const MutexLock lock(mutex_);
    for (grpc::ClientContext* context : contexts_) {
      context->TryCancel();
    }
  }

 private:
  Mutex mutex_;
  std::set<grpc::ClientContext*> contexts_ LM_GUARDED_BY(mutex_);
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

 private:
  RunningCalls& calls_;
  grpc::ClientContext& context_;
};

/// Whether that is no coordinator's answer: their own words begin so; others are gRPC's about its insides.
bool is_silence(const grpc::Status& status) {
  return (status.error_code() == grpc::StatusCode::UNAVAILABLE ||
          status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) &&
         !status.error_message().starts_with("the coordinator ") && !status.error_message().starts_with("the farm ");
}

/// Of an answer of the coordinator at `address`.
Status to_status(const grpc::Status& status, const std::string& address) {
  if (status.ok()) {
    return ok_status();
  }
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
    return unavailable("what answers at {} is not a Lightmill coordinator of this version: {}", address,
                       status.error_message());
  }
  return make_error(static_cast<StatusCode>(status.error_code()), "{}", status.error_message());
}

using Stub = v1::RenderService::Stub;

/// The coordinators of the farm, of which one answers.
class Coordinators {
 public:
  Coordinators(const std::string& addresses, FarmAccess access) : all_(addresses), access_(std::move(access)) {
    const bool several = addresses.find(',') != std::string::npos;
    for (std::size_t at = 0; at <= addresses.size();) {
      const std::size_t end = std::min(addresses.find(',', at), addresses.size());
      addresses_.push_back(addresses.substr(at, end - at));
      stubs_.push_back(v1::RenderService::NewStub(make_channel(addresses_.back(), access_.tls, several)));
      at = end + 1;
    }
  }

  /// Calls the one that answered last, and while there is no answer each of the others once. One that breaks off after
  /// `begun` is set counts as an answer.
  template <class Call>
  Status ask(const Call& call, const bool& begun = kNever) {
    Status status;
    bool some_may_come = false;
    for (std::size_t i = 0; i < stubs_.size(); ++i) {
      const std::size_t index = current_ % stubs_.size();
      const grpc::Status answer = call(*stubs_[index]);
      const bool silent = is_silence(answer);
      status = silent ? silence_of(index) : to_status(answer, all_);
      if (!silent && status.code() != StatusCode::kUnavailable) {
        return status;
      }
      some_may_come = some_may_come || status.code() == StatusCode::kUnavailable;
      std::size_t expected = index;  // another thread may have gone on already
      current_.compare_exchange_strong(expected, (index + 1) % stubs_.size());
      if (begun) {
        break;
      }
    }
    // What is wrong with one of them is the last word only if all are so: the others may still come to work.
    return some_may_come && status.code() != StatusCode::kUnavailable ? unavailable("{}", message_of(status)) : status;
  }

 private:
  /// Why a coordinator does not answer.
  Status silence_of(std::size_t index) const {
    const std::optional<std::string> problem = connection_problem(addresses_[index], access_.tls);
    return problem ? failed_precondition("cannot reach the farm at {}: {}", addresses_[index], *problem)
                   : unavailable("cannot reach the farm at {}", all_);
  }

  static constexpr bool kNever = false;
  const std::string all_;
  const FarmAccess access_;
  std::vector<std::string> addresses_;
  std::vector<std::unique_ptr<Stub>> stubs_;
  std::atomic<std::size_t> current_ = 0;
};

/// One unary call with a deadline.
template <class State, class Request, class Response>
Status call(State& state, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
            const Request& request, Response& response, Duration timeout = kCallTimeout) {
  return state.coordinators.ask([&](Stub& stub) {
    grpc::ClientContext context;
    context.set_deadline(deadline_after(timeout));
    const Registration registration(state.calls, context);
    return (stub.*method)(&context, request, &response);
  });
}

}  // namespace

struct FarmConnection::State {
  State(const std::string& addresses, FarmAccess access) : coordinators(addresses, std::move(access)) {}
  Coordinators coordinators;
  RunningCalls calls;
};

FarmConnection::FarmConnection(std::string address, FarmAccess access)
    : address_(std::move(address)), state_(std::make_unique<State>(address_, std::move(access))) {
  gpr_set_log_function([](gpr_log_func_args*) {});  // what matters of it is told by errors
}

FarmConnection::~FarmConnection() = default;

void FarmConnection::cancel_calls() {
  state_->calls.cancel_all();
}

Status FarmConnection::probe(Duration timeout) {
  v1::ListWorkersRequest request;
  request.set_page_size(1);
  v1::ListWorkersResponse response;
  return call(*state_, &Stub::ListWorkers, request, response, timeout);
}

Result<std::vector<Sha256>> FarmConnection::find_missing_assets(std::span<const Sha256> digests) {
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

Status FarmConnection::upload_asset(const Sha256& digest, ByteView bytes,
                                    const std::function<void(std::size_t)>& sent) {
  return state_->coordinators.ask([&](Stub& stub) {
    grpc::ClientContext context;
    const Registration registration(state_->calls, context);
    v1::UploadAssetResponse response;
    const auto writer = stub.UploadAsset(&context, &response);
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
    return writer->Finish();
  });
}

Result<v1::Job> FarmConnection::submit(const v1::SubmitJobRequest& request) {
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

Result<v1::Job> FarmConnection::get_job(std::uint64_t id) {
  v1::GetJobRequest request;
  request.set_id(id);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::GetJob, request, job));
  return job;
}

Result<Listed<v1::Job>> FarmConnection::list_jobs(std::size_t limit) {
  Listed<v1::Job> all;
  v1::ListJobsRequest request;
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
    if (response.next_page_token().empty()) {
      break;
    }
    request.set_page_token(response.next_page_token());
  }
  return all;
}

Result<v1::Job> FarmConnection::cancel_job(std::uint64_t id) {
  v1::CancelJobRequest request;
  request.set_id(id);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::CancelJob, request, job));
  return job;
}

Result<v1::Job> FarmConnection::pause_job(std::uint64_t id) {
  v1::PauseJobRequest request;
  request.set_id(id);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::PauseJob, request, job));
  return job;
}

Result<v1::Job> FarmConnection::resume_job(std::uint64_t id) {
  v1::ResumeJobRequest request;
  request.set_id(id);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::ResumeJob, request, job));
  return job;
}

Result<v1::Job> FarmConnection::extend_job(std::uint64_t id, std::uint64_t samples, double error) {
  v1::ExtendJobRequest request;
  request.set_id(id);
  request.set_samples(samples);
  request.set_error(error);
  v1::Job job;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::ExtendJob, request, job));
  return job;
}

Status FarmConnection::delete_job(std::uint64_t id) {
  v1::DeleteJobRequest request;
  request.set_id(id);
  v1::DeleteJobResponse response;
  return call(*state_, &Stub::DeleteJob, request, response);
}

Status FarmConnection::watch(std::uint64_t id, bool tiles, const std::function<bool()>& stop,
                             const std::function<void(const v1::WatchJobResponse&)>& changed) {
  bool begun = false;
  const auto watch_one = [&](Stub& stub) {
    grpc::ClientContext context;
    const Registration registration(state_->calls, context);
    if (stop()) {
      return grpc::Status(grpc::StatusCode::CANCELLED, "interrupted");
    }
    v1::WatchJobRequest request;
    request.set_id(id);
    request.set_tiles(tiles);
    const auto reader = stub.WatchJob(&context, request);
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

Status FarmConnection::get_film(std::uint64_t id, const std::function<Status(const v1::GetFilmResponse&)>& part) {
  Status failed = ok_status();
  bool begun = false;
  const auto get_from = [&](Stub& stub) {
    grpc::ClientContext context;
    const Registration registration(state_->calls, context);
    v1::GetFilmRequest request;
    request.set_id(id);
    const auto reader = stub.GetFilm(&context, request);
    v1::GetFilmResponse response;
    while (failed.ok() && reader->Read(&response)) {
      begun = true;
      failed = part(response);
    }
    if (!failed.ok()) {
      context.TryCancel();
    }
    return reader->Finish();
  };
  const Status status = state_->coordinators.ask(get_from, begun);
  return failed.ok() ? status : failed;
}

Result<Listed<v1::Worker>> FarmConnection::list_workers() {
  Listed<v1::Worker> all;
  v1::ListWorkersRequest request;
  request.set_page_size(kPageSize);
  for (;;) {
    v1::ListWorkersResponse response;
    LM_RETURN_IF_ERROR(call(*state_, &Stub::ListWorkers, request, response));
    for (v1::Worker& worker : *response.mutable_workers()) {
      all.items.push_back(std::move(worker));
    }
    all.notices.assign(response.notices().begin(), response.notices().end());
    if (response.next_page_token().empty()) {
      return all;
    }
    request.set_page_token(response.next_page_token());
  }
}

Result<v1::Worker> FarmConnection::drain_worker(const std::string& name) {
  v1::DrainWorkerRequest request;
  request.set_name(name);
  v1::Worker worker;
  LM_RETURN_IF_ERROR(call(*state_, &Stub::DrainWorker, request, worker));
  return worker;
}

}  // namespace lightmill::cli
