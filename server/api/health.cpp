#include "server/api/health.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include "server/api/grpc_gate.h"
#include "server/api/listen_problem.h"

namespace lightmill {

HealthPort::HealthPort() : others_(std::make_unique<grpc::CallbackGenericService>()) {}

Result<std::unique_ptr<HealthPort>> HealthPort::open(const std::string& listen) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  leave_out_reflection(builder);
  auto health = std::unique_ptr<HealthPort>(new HealthPort());
  builder.AddListeningPort(listen, grpc::InsecureServerCredentials(), &health->port_);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // gRPC starts no server that has health checks alone.
  builder.RegisterCallbackGenericService(health->others_.get());
  health->server_ = builder.BuildAndStart();
  if (health->server_ == nullptr || health->port_ == 0) {
    return unavailable("cannot listen on {}: {}", listen, listen_problem(listen, "--health"));
  }
  health->set_ready(false);
  health->server_->GetHealthCheckService()->SetServingStatus(kLive, true);
  return health;
}

HealthPort::~HealthPort() {
  if (server_ != nullptr) {
    server_->Shutdown(std::chrono::system_clock::now());
  }
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

void Readiness::stop() {
  const MutexLock lock(mutex_);
  serving_ = false;
  tell();
  service_ = nullptr;
}

void Readiness::tell() {
  const bool ready = serving_ && storing_;
  if (service_ != nullptr) {
    service_->SetServingStatus(ready);
  }
  on_change_(ready);
}

}  // namespace lightmill
