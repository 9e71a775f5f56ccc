#include "worker/rpc/farm_link.h"

#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>

#include <set>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/wire/bytes.h"
#include "lightmill/v1/render_service.grpc.pb.h"
#include "worker/rpc/link_stream.h"

namespace lightmill {
namespace {

/// A packed scene may have 16 MiB.
constexpr int kMaxMessageBytes = 20 << 20;
constexpr auto kDownloadLimit = std::chrono::minutes(10);

std::shared_ptr<grpc::Channel> make_channel(const std::string& address) {
  grpc::ChannelArguments arguments;
  // A dead link is found within some four seconds.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 2'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 2'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // The session decides when to try again, so each attempt is a connection of its own.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 3'000);
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

}  // namespace

struct FarmLink::Connection {
  explicit Connection(const std::string& address)
      : channel(make_channel(address)),
        work(v1::WorkerService::NewStub(channel)),
        render(v1::RenderService::NewStub(channel)) {}
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::WorkerService::Stub> work;
  std::unique_ptr<v1::RenderService::Stub> render;
  std::set<grpc::ClientContext*> downloads;  ///< under way; guarded by the link's mutex
};

FarmLink::FarmLink(std::vector<std::string> servers, LinkHandlers handlers)
    : servers_(std::move(servers)), handlers_(std::move(handlers)) {
  LM_CHECK(!servers_.empty());
  gpr_set_log_function([](gpr_log_func_args* line) { spdlog::debug("grpc: {}", line->message); });
}

FarmLink::~FarmLink() {
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

std::uint64_t FarmLink::open() {
  std::shared_ptr<Connection> connection;
  std::shared_ptr<LinkStream> stream;
  std::uint64_t number = 0;
  {
    const MutexLock lock(mutex_);
    const std::string& address = servers_[streams_ % servers_.size()];
    number = ++streams_;
    closed_ = false;
    connection = connection_ = std::make_shared<Connection>(address);
    stream = stream_ = std::make_shared<LinkStream>(number, address, handlers_);
  }
  stream->start(*connection->work);
  return number;
}

void FarmLink::send(std::shared_ptr<const WorkerMessage> message) {
  std::shared_ptr<LinkStream> stream;
  {
    const MutexLock lock(mutex_);
    stream = stream_;
  }
  if (stream != nullptr) {
    stream->send(std::move(message));
  }
}

void FarmLink::close() {
  std::shared_ptr<LinkStream> stream;
  {
    const MutexLock lock(mutex_);
    closed_ = true;
    stream = stream_;
    if (connection_ != nullptr) {
      for (grpc::ClientContext* download : connection_->downloads) {
        download->TryCancel();
      }
    }
  }
  if (stream != nullptr) {
    stream->close();
  }
}

Result<std::string> FarmLink::download(const Sha256& digest) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kDownloadLimit);
  std::shared_ptr<Connection> connection;
  {
    const MutexLock lock(mutex_);
    if (connection_ == nullptr || closed_) {
      return unavailable("no coordinator is connected");
    }
    connection = connection_;
    connection->downloads.insert(&context);
  }
  v1::DownloadAssetRequest request;
  request.set_digest(digest_bytes(digest));
  const auto reader = connection->render->DownloadAsset(&context, request);
  std::string bytes;
  v1::DownloadAssetResponse response;
  while (reader->Read(&response)) {
    bytes += response.chunk();
  }
  const grpc::Status status = reader->Finish();
  {
    const MutexLock lock(mutex_);
    connection->downloads.erase(&context);
  }
  if (!status.ok()) {
    return make_error(static_cast<StatusCode>(status.error_code()), "asset {}: {}", digest.hex(),
                      status.error_message());
  }
  return bytes;
}

}  // namespace lightmill
