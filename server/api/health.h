// Health checks (grpc.health.v1): on the coordinator's port, and on a separate port.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/base/mutex.h"
#include "common/base/status.h"

namespace grpc {
class CallbackGenericService;
class HealthCheckServiceInterface;
class Server;
}  // namespace grpc

namespace lightmill {

class Listener;

/// Port for probes without a certificate, such as those of Kubernetes. It is not encrypted, admits everyone, and serves
/// nothing else. The service "" is SERVING while the coordinator is ready. "live" is SERVING while the program runs,
/// also for a standby coordinator. Thread-safe.
class HealthPort {
 public:
  static constexpr const char* kLive = "live";

  /// `listen` is HOST:PORT; port 0 takes a free one. `connections` is their limit. Starts as not ready. UNAVAILABLE if
  /// the address cannot be bound.
  static Result<std::unique_ptr<HealthPort>> open(const std::string& listen, std::size_t connections);
  ~HealthPort();
  HealthPort(const HealthPort&) = delete;
  HealthPort& operator=(const HealthPort&) = delete;

  int port() const;
  void set_ready(bool ready);

 private:
  HealthPort();
  std::unique_ptr<grpc::CallbackGenericService> others_;  ///< refuses all other calls
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Listener> listener_;
};

/// Whether a coordinator accepts jobs: it serves, can store its state, its port answers, and its farm thread makes
/// progress. Thread-safe.
class Readiness {
 public:
  explicit Readiness(std::function<void(bool)> on_change) : on_change_(std::move(on_change)) {}
  /// The coordinator is ready from now until stop(). `service` reports the same.
  void start(grpc::HealthCheckServiceInterface* service);
  void set_storing(bool storing);
  void set_answering(bool answering);
  void set_moving(bool moving);
  void stop();

 private:
  void tell() LM_REQUIRES(mutex_);

  const std::function<void(bool)> on_change_;
  Mutex mutex_;
  grpc::HealthCheckServiceInterface* service_ LM_GUARDED_BY(mutex_) = nullptr;
  bool serving_ LM_GUARDED_BY(mutex_) = false;
  bool storing_ LM_GUARDED_BY(mutex_) = true;
  bool answering_ LM_GUARDED_BY(mutex_) = true;
  bool moving_ LM_GUARDED_BY(mutex_) = true;
};

}  // namespace lightmill
