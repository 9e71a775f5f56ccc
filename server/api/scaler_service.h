// KEDA's external scaler: tells a cluster when the farm begins or ceases to need workers.
#pragma once

#include "externalscaler/externalscaler.grpc.pb.h"
#include "server/api/unary_calls.h"
#include "server/api/watch_registry.h"

namespace lightmill {

/// Thread-safe.
class ScalerServiceImpl final : public UnaryCalls<externalscaler::ExternalScaler> {
 public:
  ScalerServiceImpl(Runtime& runtime, CallResources& shared);
  /// From now on, listeners get UNAVAILABLE.
  void stop() { streams_->stop(); }

 private:
  const std::shared_ptr<WatchRegistry> streams_ = std::make_shared<WatchRegistry>();
};

}  // namespace lightmill
