#include "server/api/scaler_service.h"

#include "server/api/grpc_access.h"
#include "server/api/offer_stream.h"
#include "server/api/rejected_stream.h"

namespace lightmill {
namespace {

using externalscaler::IsActiveResponse;

class ActiveStream final : public OfferStream<IsActiveResponse, DemandSink> {
 public:
  using OfferStream::OfferStream;
  void offer(bool active) override {
    IsActiveResponse response;
    response.set_result(active);
    write(std::move(response), false);
  }
};

}  // namespace

grpc::ServerWriteReactor<IsActiveResponse>* ScalerServiceImpl::StreamIsActive(
    grpc::CallbackServerContext* rpc_context, const externalscaler::ScaledObjectRef* request) {
  Result<Call> call = admit(runtime_.access(), *rpc_context, kStreamIsActive, {}, request->ByteSizeLong());
  if (!call.ok()) {
    return new RejectedStream<grpc::ServerWriteReactor<IsActiveResponse>>(call.status());
  }
  const auto stream = std::make_shared<ActiveStream>(runtime_, *std::move(call), streams_);
  return ActiveStream::start(stream, [stream](FarmLoop::TaskContext& context) { context.demand.add(stream); });
}

}  // namespace lightmill
