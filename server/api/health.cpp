#include "server/api/health.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include "common/base/check.h"
#include "server/api/grpc_access.h"

namespace lightmill {
namespace {

// The port answers everybody, without authentication.
constexpr int kMaxHealthBytes = 1024, kMaxHealthStreams = 8;
constexpr std::size_t kHealthWireBytes = std::size_t{16} << 20;
constexpr int kMaxConnectionAgeMs = 60'000, kLastCallsMs = 1'000;

}  // namespace

HealthPort::HealthPort() : others_(std::make_unique<grpc::CallbackGenericService>()) {}

Result<std::unique_ptr<HealthPort>> HealthPort::open(const std::string& listen, std::size_t connections) {
  LM_ASSIGN_OR_RETURN(std::unique_ptr<Listener> listener, Listener::open(listen, "--health", connections));
  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  leave_out_reflection(builder);
  builder.SetMaxReceiveMessageSize(kMaxHealthBytes);
  builder.SetResourceQuota(grpc::ResourceQuota("health").Resize(kHealthWireBytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxHealthStreams);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, kMaxConnectionAgeMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, kLastCallsMs);
  auto health = std::unique_ptr<HealthPort>(new HealthPort());
  Listener::Take take = serve_sockets(builder, grpc::InsecureServerCredentials());
  // gRPC does not start a server that has only health checks.
  builder.RegisterCallbackGenericService(health->others_.get());
  health->server_ = builder.BuildAndStart();
  LM_CHECK(health->server_ != nullptr);
  health->set_ready(false);
  health->server_->GetHealthCheckService()->SetServingStatus(kLive, true);
  health->listener_ = std::move(listener);
  health->listener_->start(std::move(take));
  return health;
}

HealthPort::~HealthPort() {
  if (listener_ != nullptr) {
    listener_->stop();
    server_->Shutdown(std::chrono::system_clock::now());
  }
}

int HealthPort::port() const {
  return listener_->port();
}

void HealthPort::set_ready(bool ready) {
  server_->GetHealthCheckService()->SetServingStatus("", ready);
}

void Readiness::start(grpc::HealthCheckServiceInterface* service) {
  const MutexLock lock(mutex_);
  service_ = service;
  serving_ = true;
  tell();
}

void Readiness::set_storing(bool storing) {
  const MutexLock lock(mutex_);
  storing_ = storing;
  tell();
}

void Readiness::set_answering(bool answering) {
  const MutexLock lock(mutex_);
  answering_ = answering;
  tell();
}

void Readiness::set_moving(bool moving) {
  const MutexLock lock(mutex_);
  moving_ = moving;
  tell();
}

void Readiness::stop() {
  const MutexLock lock(mutex_);
  serving_ = false;
  tell();
  service_ = nullptr;
}

void Readiness::tell() {
  const bool ready = serving_ && storing_ && answering_ && moving_;
  if (service_ != nullptr) {
    service_->SetServingStatus(ready);
  }
  on_change_(ready);
}

}  // namespace lightmill
