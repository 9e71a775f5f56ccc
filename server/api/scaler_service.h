// KEDA's external scaler: tells a cluster that starts and stops workers how many the farm could use.
#pragma once

#include "externalscaler/externalscaler.grpc.pb.h"
#include "server/runtime/runtime.h"

namespace lightmill {

/// Thread-safe.
class ScalerServiceImpl final : public externalscaler::ExternalScaler::CallbackService {
 public:
  explicit ScalerServiceImpl(Runtime& runtime) : gate_(runtime.gate()), loop_(runtime.loop()) {}
  /// Listeners are told UNAVAILABLE from now on.
  void stop();

  using Context = grpc::CallbackServerContext;
  using Unary = grpc::ServerUnaryReactor;
  using Ref = externalscaler::ScaledObjectRef;

  Unary* IsActive(Context*, const Ref*, externalscaler::IsActiveResponse*) override;
  grpc::ServerWriteReactor<externalscaler::IsActiveResponse>* StreamIsActive(Context*, const Ref*) override;
  Unary* GetMetricSpec(Context*, const Ref*, externalscaler::GetMetricSpecResponse*) override;
  Unary* GetMetrics(Context*, const externalscaler::GetMetricsRequest*, externalscaler::GetMetricsResponse*) override;

 private:
  Unary* with_wanted(Context* context, Rpc rpc, std::function<void(std::uint32_t wanted)> reply);

  const Gate& gate_;
  FarmLoop& loop_;
  std::shared_ptr<class WatchRegistry> streams_ = make_registry();
  static std::shared_ptr<class WatchRegistry> make_registry();
};

}  // namespace lightmill
