#include "server/api/api_server.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include "common/base/log.h"
#include "lightmill/v1/access_service.grpc.pb.h"
#include "server/api/grpc_access.h"
#include "server/api/grpc_log.h"
#include "server/api/health.h"
#include "server/api/render_service.h"
#include "server/api/scaler_service.h"
#include "server/api/worker_streams.h"
#include "server/listen/listener.h"
#include "server/listen/self_check.h"
#include "server/runtime/farm_watchdog.h"

namespace lightmill {
namespace {

/// A packed scene can have 16 MiB. Other messages are small.
constexpr int kMaxMessageBytes = 20 << 20;
/// Bytes of a connection before its first call is admitted. gRPC keeps a whole request until then, and a long header.
constexpr std::uint64_t kMaxUnknownBytes = 4 << 20;
/// Bytes of a connection that belong to requests that are not complete: two of the longest, and some first windows. More
/// if there is much memory for messages.
constexpr std::uint64_t kMaxUnreadBytes = 48 << 20;

UnreadBytes::Limits unread_limits(std::uint64_t wire_bytes) {
  return {std::max(kMaxUnreadBytes, wire_bytes / 16), std::max(kMaxUnreadBytes, wire_bytes / 4),
          std::max(2 * kMaxUnreadBytes, wire_bytes / 2)};
}
/// Concurrent streams of one connection. More wait.
constexpr int kMaxConnectionStreams = 1'000;
/// Time for running calls when the server stops.
constexpr auto kStopTimeout = std::chrono::seconds(2);

/// Detects dead links within half a minute. Clients may ping more often. A worker with a gigabyte of results in transit
/// takes seconds to answer, and is not dead.
void set_keepalive(grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 500);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
}

/// "SERVICE/METHOD" of all registered methods, except health and reflection.
std::vector<std::string> registered_methods() {
  std::vector<std::string> methods;
  for (const std::string name :
       {v1::RenderService::service_full_name(), v1::WorkerService::service_full_name(),
        v1::AccessService::service_full_name(), externalscaler::ExternalScaler::service_full_name()}) {
    const auto* const service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; i < service->method_count(); ++i) {
      methods.push_back(fmt::format("{}/{}", name, service->method(i)->name()));
    }
  }
  return methods;
}

}  // namespace

/// In the order of construction. Each member uses only those above it, and gRPC's threads stop first. The runtime keeps
/// the functions that it calls.
struct ApiServer::Parts {
  Parts(Runtime& runtime, const ApiOptions& options)
      : loop(runtime.loop()),
        workers(std::make_shared<WorkerStreams>(runtime)),
        access(runtime, threads),
        scaler(runtime, threads),
        renders(runtime, threads),
        readiness(std::make_shared<Readiness>(options.on_ready)) {}
  FarmLoop& loop;
  CallThreads threads;
  const std::shared_ptr<WorkerStreams> workers;
  UnaryCalls<v1::AccessService> access;
  ScalerServiceImpl scaler;
  RenderServiceImpl renders;
  const std::shared_ptr<Readiness> readiness;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<SelfCheck> self_check;
  std::unique_ptr<FarmWatchdog> watchdog;
};

Result<std::unique_ptr<ApiServer>> ApiServer::start(Runtime& runtime, const ApiOptions& options) {
  LM_RETURN_IF_ERROR(check_rpcs(served_rpcs(), registered_methods()));
  auto parts = std::make_unique<Parts>(runtime, options);
  LM_ASSIGN_OR_RETURN(parts->listener, Listener::open(options.listen, "--listen", options.connections));

  parts->listener->limit_unknown({kMaxUnknownBytes, options.wire_bytes / 4});
  parts->listener->limit_unread(unread_limits(options.wire_bytes));
  redirect_grpc_log();
  grpc::EnableDefaultHealthCheckService(true);
  static std::once_flag reflection_once;
  std::call_once(reflection_once, [] { grpc::reflection::InitProtoReflectionServerBuilderPlugin(); });
  grpc::ServerBuilder builder;
  if (runtime.access().authenticates()) {
    leave_out_reflection(builder);
  }
  Listener::Take take = serve_sockets(builder, server_credentials(options.tls));
  builder.RegisterService(parts->workers.get());
  builder.RegisterService(&parts->renders);
  builder.RegisterService(&parts->access);
  builder.RegisterService(&parts->scaler);
  builder.SetMaxReceiveMessageSize(kMaxMessageBytes);
  builder.SetResourceQuota(grpc::ResourceQuota("lightmill").Resize(options.wire_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxConnectionStreams);
  // gRPC's own threads serve only reflection.
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 1);
  set_keepalive(builder);
  runtime.access().set_on_identified(
      [listener = parts->listener.get()](const std::string& peer, const Identity& caller) {
        return listener->set_caller(peer, caller);
      });
  runtime.access().set_on_taken(
      [listener = parts->listener.get()](const std::string& peer, std::uint64_t bytes, std::uint64_t overhead) {
        listener->taken(peer, bytes, overhead);
      });
  runtime.loop().set_handlers({[workers = parts->workers](Outgoing message) { workers->send(std::move(message)); },
                               [workers = parts->workers](SessionId session) { workers->disconnect(session); },
                               [readiness = parts->readiness](bool storing) { readiness->set_storing(storing); }});
  parts->server = builder.BuildAndStart();
  if (parts->server == nullptr) {
    return internal_error("gRPC does not start. Its log says why (--log-level debug)");
  }
  parts->listener->start(std::move(take));
  parts->readiness->start(parts->server->GetHealthCheckService());
  parts->self_check = std::make_unique<SelfCheck>(
      *parts->listener, options.tls.given(), system_clock(),
      [readiness = parts->readiness](bool answering) { readiness->set_answering(answering); }, options.on_fatal);
  parts->watchdog = std::make_unique<FarmWatchdog>(
      parts->loop, [readiness = parts->readiness](bool moving) { readiness->set_moving(moving); });
  return std::unique_ptr<ApiServer>(new ApiServer(std::move(parts)));
}

ApiServer::ApiServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

ApiServer::~ApiServer() {
  parts_->watchdog.reset();
  parts_->self_check.reset();
  parts_->readiness->stop();
  parts_->loop.stop_waiting();
  parts_->renders.stop();
  parts_->scaler.stop();
  parts_->workers->stop();
  parts_->listener->stop();
  parts_->server->Shutdown(std::chrono::system_clock::now() + kStopTimeout);
}

int ApiServer::port() const {
  return parts_->listener->port();
}

}  // namespace lightmill
