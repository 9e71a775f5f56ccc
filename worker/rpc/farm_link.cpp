#include "worker/rpc/farm_link.h"

#include <grpcpp/grpcpp.h>

#include "common/base/check.h"
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
};

FarmLink::FarmLink(std::vector<std::string> servers, LinkHandlers handlers)
    : servers_(std::move(servers)), handlers_(std::move(handlers)) {
  LM_CHECK(!servers_.empty());
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
    stream = stream_;
  }
  if (stream != nullptr) {
    stream->close();
  }
}

Result<std::string> FarmLink::download(const Sha256& digest) {
  std::shared_ptr<Connection> connection;
  {
    const MutexLock lock(mutex_);
    connection = connection_;
  }
  if (connection == nullptr) {
    return unavailable("no coordinator is connected");
  }
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kDownloadLimit);
  v1::DownloadAssetRequest request;
  request.set_digest(digest_bytes(digest));
  const auto reader = connection->render->DownloadAsset(&context, request);
  std::string bytes;
  v1::DownloadAssetResponse response;
  while (reader->Read(&response)) {
    bytes += response.chunk();
  }
  if (const grpc::Status status = reader->Finish(); !status.ok()) {
    return make_error(static_cast<StatusCode>(status.error_code()), "asset {}: {}", digest.hex(),
                      status.error_message());
  }
  return bytes;
}

}  // namespace lightmill
