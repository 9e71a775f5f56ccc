// KEDA's external scaler: tells a cluster that starts and stops workers whenever the farm begins or ends to want some.
#pragma once

#include "externalscaler/externalscaler.grpc.pb.h"
#include "server/api/unary_calls.h"

namespace lightmill {

/// Thread-safe.
class ScalerServiceImpl final : public UnaryCalls<externalscaler::ExternalScaler> {
 public:
  explicit ScalerServiceImpl(Runtime& runtime) : UnaryCalls(runtime), gate_(runtime.gate()), loop_(runtime.loop()) {}
  /// Listeners are told UNAVAILABLE from now on.
  void stop();

  grpc::ServerWriteReactor<externalscaler::IsActiveResponse>* StreamIsActive(
      grpc::CallbackServerContext*, const externalscaler::ScaledObjectRef*) override;

 private:
  const Gate& gate_;
  FarmLoop& loop_;
  std::shared_ptr<class WatchRegistry> streams_ = make_registry();
  static std::shared_ptr<class WatchRegistry> make_registry();
};

}  // namespace lightmill
