#include "worker/rpc/coordinator_link.h"

#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <set>

#include "common/base/check.h"
#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/security/connection_problem.h"
#include "common/wire/bytes.h"
#include "lightmill/v1/access_service.grpc.pb.h"
#include "lightmill/v1/render_service.grpc.pb.h"
#include "worker/rpc/link_stream.h"

namespace lightmill {
namespace {

/// A packed scene can have 16 MiB.
constexpr int kMaxMessageBytes = 20 << 20;
constexpr std::chrono::seconds kTransferLimit = std::chrono::minutes(10), kEnrolmentLimit(30);
constexpr std::size_t kChunkBytes = std::size_t{256} << 10;

/// `quickly`: there is another coordinator to try if this one does not answer.
std::shared_ptr<grpc::Channel> make_channel(const std::string& address, const TlsTexts& tls, bool quickly) {
  grpc::ChannelArguments arguments;
  // Detects a dead link within about 20 s. A coordinator with thousands of workers may take seconds to answer. It must
  // not lose them all for this, because each would send all its results again.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 5'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 15'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // The session decides when to reconnect, so each attempt has its own connection.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // Time limit to connect: a very busy machine takes seconds to answer.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, quickly ? 3'000 : 10'000);
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  return grpc::CreateCustomChannel(address,
                                   tls.given() ? grpc::SslCredentials({tls.authority, tls.key, tls.certificate})
                                               : grpc::InsecureChannelCredentials(),
                                   arguments);
}

/// Whether gRPC says that it has no connection, and did not lose one.
bool is_unreachable(std::string_view grpc_message) {
  return grpc_message.starts_with("failed to connect to all addresses") ||
         grpc_message.starts_with("DNS resolution failed");
}

}  // namespace

struct CoordinatorLink::Connection {
  Connection(const std::string& address, CallerTexts texts, bool quickly)
      : caller(std::move(texts)),
        channel(make_channel(address, caller.tls, quickly)),
        work(v1::WorkerService::NewStub(channel)),
        render(v1::RenderService::NewStub(channel)),
        access(v1::AccessService::NewStub(channel)) {}
  void show_token(grpc::ClientContext& context) const {
    if (!caller.token.empty()) {
      context.AddMetadata("authorization", caller.authorization());
    }
  }
  const CallerTexts caller;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::WorkerService::Stub> work;
  std::unique_ptr<v1::RenderService::Stub> render;
  std::unique_ptr<v1::AccessService::Stub> access;
  std::set<grpc::ClientContext*> calls;  ///< in progress; guarded by the link's mutex
};

CoordinatorLink::CoordinatorLink(CoordinatorAddress farm, LinkHandlers handlers)
    : farm_(std::move(farm)), handlers_(std::move(handlers)), stream_handlers_(watching_refusals(handlers_)) {
  LM_CHECK(!farm_.servers.empty());
  gpr_set_log_function([](gpr_log_func_args* line) { spdlog::debug("grpc: {}", line->message); });
}

/// Notices when the farm refuses the worker's own token, which is useless then.
LinkHandlers CoordinatorLink::watching_refusals(LinkHandlers handlers) {
  handlers.disconnected = [this, tell = std::move(handlers.disconnected)](
                              std::uint64_t stream, const std::string& address, const Status& status) {
    if (status.code() == StatusCode::kUnauthenticated) {
      const MutexLock lock(mutex_);
      token_refused_ = true;
    }
    tell(stream, address, status);
  };
  return handlers;
}

CoordinatorLink::~CoordinatorLink() {
  close();  // also ends an enrolment
  if (enrolling_.joinable()) {
    enrolling_.join();
  }
  std::shared_ptr<LinkStream> stream;
  {
    const MutexLock lock(mutex_);
    stream = stream_;
  }
  if (stream != nullptr) {
    stream->cancel();
    stream->wait();
  }
}

Result<CallerTexts> CoordinatorLink::read_caller() const {
  CallerFiles files = farm_.caller;
  if (farm_.enrolment && farm_.enrolment->state->has_token()) {
    files.token_file = farm_.enrolment->state->token_file();
    files.token_option = "--state";
  }
  return lightmill::read_caller(files, farm_.servers, system_clock().unix_milliseconds() / 1000);
}

std::uint64_t CoordinatorLink::open() {
  std::uint64_t number = 0;
  std::string server;
  std::shared_ptr<LinkStream> earlier;
  {
    const MutexLock lock(mutex_);
    server = farm_.servers[streams_ % farm_.servers.size()];
    number = ++streams_;
    closed_ = false;
    connection_.reset();
    earlier = std::move(stream_);
  }
  if (earlier != nullptr) {
    earlier->wait();
  }
  if (!has_to_enrol()) {
    open_stream(number, server);
    return number;
  }
  enrolling_ = std::jthread([this, number, server] {
    const Status enrolled = enrol(server);
    {
      const MutexLock lock(mutex_);
      token_refused_ = false;  // after a failure too: the farm that knows this token may come back
    }
    if (enrolled.ok()) {
      open_stream(number, server);
    } else {
      handlers_.disconnected(number, server, enrolled);
    }
  });
  return number;
}

std::shared_ptr<CoordinatorLink::Connection> CoordinatorLink::connect(const std::string& server,
                                                                      CallerTexts caller) const {
  return std::make_shared<Connection>(server, std::move(caller), farm_.servers.size() > 1);
}

void CoordinatorLink::open_stream(std::uint64_t number, const std::string& server) {
  Result<CallerTexts> caller = read_caller();
  if (!caller.ok()) {
    handlers_.disconnected(number, server, caller.status());
    return;
  }
  const auto stream = std::make_shared<LinkStream>(number, server, stream_handlers_);
  const auto connection = connect(server, *std::move(caller));
  connection->show_token(stream->context());
  bool closed = false;
  {
    const MutexLock lock(mutex_);
    closed = closed_;  // while the worker enrolled
    if (!closed) {
      connection_ = connection;
      stream_ = stream;
    }
  }
  if (closed) {
    handlers_.disconnected(number, server, make_error(StatusCode::kCancelled, "the worker leaves"));
    return;
  }
  stream->start(*connection->work);
}

bool CoordinatorLink::has_to_enrol() {
  const MutexLock lock(mutex_);
  return farm_.enrolment && (token_refused_ || !farm_.enrolment->state->has_token());
}

bool CoordinatorLink::enrols_next() {
  const MutexLock lock(mutex_);
  return farm_.enrolment && token_refused_;
}

/// Gets a token for this worker, and stores it.
Status CoordinatorLink::enrol(const std::string& server) {
  const EnrolmentFiles& enrolment = *farm_.enrolment;
  CallerFiles files = farm_.caller;
  files.token_file = enrolment.file;
  files.token_option = kEnrolFileOption;
  LM_ASSIGN_OR_RETURN(CallerTexts caller,
                      lightmill::read_caller(files, farm_.servers, system_clock().unix_milliseconds() / 1000));
  LM_ASSIGN_OR_RETURN(const NewToken asked, enrolment.state->pending_token());
  {
    const MutexLock lock(mutex_);
    connection_ = connect(server, std::move(caller));
  }
  v1::EnrolRequest request;
  request.set_id(asked.id);
  request.set_sha256(digest_bytes(asked.hash));
  request.set_host(enrolment.host);
  v1::Token token;
  const Status status = call(kEnrolmentLimit, [&](const Connection& connection, grpc::ClientContext& context) {
    return connection.access->Enrol(&context, request, &token);
  });
  if (!status.ok()) {
    return with_context(status, fmt::format("enrolment with {} {}", kEnrolFileOption, enrolment.file));
  }
  LM_RETURN_IF_ERROR(enrolment.state->commit_pending_token());
  spdlog::info("enrolled at {} as '{}': the token {}, valid until {}, is in {}", server, token.name(), token.id(),
               date_text(token.until_unix_s()), enrolment.state->token_file().string());
  return ok_status();
}

std::string CoordinatorLink::explain(const std::string& server, const Status& failure) const {
  const Result<CallerTexts> caller = read_caller();
  if (failure.code() == StatusCode::kUnavailable && caller.ok()) {
    if (std::optional<std::string> problem = connection_problem(server, caller->tls)) {
      return *std::move(problem);
    }
  }
  const std::string message = message_of(failure);
  if (is_unreachable(message)) {
    return std::string(cause_of_silence(message));
  }
  return message.empty() ? "it closed the stream" : message;
}

void CoordinatorLink::send(std::shared_ptr<const WorkerMessage> message) {
  std::shared_ptr<LinkStream> stream;
  {
    const MutexLock lock(mutex_);
    stream = stream_;
  }
  if (stream != nullptr) {
    stream->send(std::move(message));
  }
}

void CoordinatorLink::close() {
  std::shared_ptr<LinkStream> stream;
  {
    const MutexLock lock(mutex_);
    closed_ = true;
    stream = stream_;
    if (connection_ != nullptr) {
      for (grpc::ClientContext* call : connection_->calls) {
        call->TryCancel();
      }
    }
  }
  if (stream != nullptr) {
    stream->close();
  }
}

template <class Run>
Status CoordinatorLink::call(std::chrono::seconds limit, const Run& run) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + limit);
  std::shared_ptr<Connection> connection;
  {
    const MutexLock lock(mutex_);
    if (connection_ == nullptr || closed_) {
      return unavailable("no coordinator is connected");
    }
    connection = connection_;
    connection->calls.insert(&context);
  }
  connection->show_token(context);
  const grpc::Status status = run(*connection, context);
  {
    const MutexLock lock(mutex_);
    connection->calls.erase(&context);
  }
  if (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED) {  // the coordinator is busy; the job is fine
    return unavailable("{}", status.error_message());
  }
  return status.ok() ? ok_status()
                     : make_error(static_cast<StatusCode>(status.error_code()), "{}", status.error_message());
}

Result<std::string> CoordinatorLink::download(const Sha256& digest) {
  std::string bytes;
  const Status status = call(kTransferLimit, [&](const Connection& connection, grpc::ClientContext& context) {
    v1::DownloadAssetRequest request;
    request.set_digest(digest_bytes(digest));
    const auto reader = connection.render->DownloadAsset(&context, request);
    v1::DownloadAssetResponse response;
    while (reader->Read(&response)) {
      bytes += response.chunk();
    }
    return reader->Finish();
  });
  if (status.code() == StatusCode::kNotFound) {  // it existed at submission, and a client may send it again
    return unavailable("asset {} is not in the farm's store: submit a job with the same file again", digest.hex());
  }
  return status.ok() ? Result<std::string>(std::move(bytes)) : with_context(status, "asset " + digest.hex());
}

Result<std::vector<Sha256>> CoordinatorLink::missing(std::span<const Sha256> digests) {
  v1::FindMissingAssetsRequest request;
  for (const Sha256& digest : digests) {
    request.add_digests(digest_bytes(digest));
  }
  v1::FindMissingAssetsResponse response;
  LM_RETURN_IF_ERROR(call(kTransferLimit, [&](const Connection& connection, grpc::ClientContext& context) {
    return connection.render->FindMissingAssets(&context, request, &response);
  }));
  std::vector<Sha256> out;
  for (const std::string& bytes : response.missing()) {
    LM_ASSIGN_OR_RETURN(out.emplace_back(), digest_from_bytes(bytes));
  }
  return out;
}

Status CoordinatorLink::upload(const Sha256& digest, ByteView bytes) {
  return call(kTransferLimit, [&](const Connection& connection, grpc::ClientContext& context) {
    v1::UploadAssetResponse response;
    const auto writer = connection.render->UploadAsset(&context, &response);
    v1::UploadAssetRequest request;
    request.set_digest(digest_bytes(digest));
    std::size_t sent = 0;
    do {
      const ByteView chunk = bytes.subspan(sent, std::min(kChunkBytes, bytes.size() - sent));
      request.set_chunk(chunk.data(), chunk.size());
      if (!writer->Write(request)) {
        break;  // Finish() returns the reason
      }
      request.clear_digest();
      sent += chunk.size();
    } while (sent < bytes.size());
    writer->WritesDone();
    return writer->Finish();
  });
}

}  // namespace lightmill
