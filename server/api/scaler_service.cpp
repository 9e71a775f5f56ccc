#include "server/api/scaler_service.h"

#include "server/api/grpc_access.h"
#include "server/api/offer_stream.h"
#include "server/api/rejected_stream.h"

namespace lightmill {
namespace {

using externalscaler::ExternalScaler;
using externalscaler::IsActiveResponse;
using externalscaler::ScaledObjectRef;

class ActiveStream final : public OfferStream<ScaledObjectRef, IsActiveResponse, DemandSink>,
                           public std::enable_shared_from_this<ActiveStream> {
 public:
  using OfferStream::OfferStream;
  void offer(bool active) override {
    IsActiveResponse response;
    response.set_result(active);
    write(std::move(response), false);
  }

 private:
  void request_read() override {
    serve([stream = shared_from_this()](FarmLoop::TaskContext& context) { context.demand.add(stream); });
  }
};

}  // namespace

ScalerServiceImpl::ScalerServiceImpl(Runtime& runtime, CallResources& shared) : UnaryCalls(runtime, shared) {
  MarkMethodStreamed(
      method_index(ExternalScaler::service_full_name(), "StreamIsActive"),
      new RequestCallHandler<ScaledObjectRef, IsActiveResponse>(
          [this, &runtime, &shared](
              grpc::CallbackServerContext* context) -> grpc::ServerBidiReactor<ScaledObjectRef, IsActiveResponse>* {
            Result<Call> call = admit(runtime.access(), *context, kStreamIsActive);
            if (!call.ok()) {
              return new RejectedStream<grpc::ServerBidiReactor<ScaledObjectRef, IsActiveResponse>>(call.status());
            }
            return ActiveStream::start(std::make_shared<ActiveStream>(runtime, *std::move(call), streams_),
                                       shared.reads);
          }));
}

}  // namespace lightmill
