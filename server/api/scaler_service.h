// KEDA's external scaler: tells a cluster when the farm begins or ceases to need workers.
#pragma once

#include "externalscaler/externalscaler.grpc.pb.h"
#include "server/api/unary_calls.h"
#include "server/api/watch_registry.h"

namespace lightmill {

/// Thread-safe.
class ScalerServiceImpl final : public UnaryCalls<externalscaler::ExternalScaler> {
 public:
  ScalerServiceImpl(Runtime& runtime, CallThreads& threads) : UnaryCalls(runtime, threads), runtime_(runtime) {}
  /// From now on, listeners get UNAVAILABLE.
  void stop() { streams_->stop(); }

  grpc::ServerWriteReactor<externalscaler::IsActiveResponse>* StreamIsActive(
      grpc::CallbackServerContext*, const externalscaler::ScaledObjectRef*) override;

 private:
  Runtime& runtime_;
  const std::shared_ptr<WatchRegistry> streams_ = std::make_shared<WatchRegistry>();
};

}  // namespace lightmill
