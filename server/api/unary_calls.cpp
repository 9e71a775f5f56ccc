#include "server/api/unary_calls.h"

#include <grpcpp/impl/codegen/proto_utils.h>

#include "server/api/grpc_gate.h"
#include "server/api/grpc_status.h"
#include "server/operations/operation_call.h"

namespace lightmill {
namespace {

/// Deletes itself.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  UnaryCall(Runtime& runtime, const Operation& operation, grpc::ByteBuffer* reply)
      : call_(std::make_shared<OperationCall>(runtime, operation)), reply_(reply) {}

  void start(const Gate& gate, grpc::CallbackServerContext& context, grpc::ByteBuffer request) {
    grpc::ProtoBufferReader reader(&request);
    if (!call_->request().ParseFromZeroCopyStream(&reader)) {
      return Finish(to_grpc(invalid_argument("the request is not a {}", call_->request().GetTypeName())));
    }
    Result<Call> call = admit(gate, context, call_->operation().rpc, call_->about());
    if (!call.ok()) {
      return Finish(to_grpc(call.status()));
    }
    call_->start(*std::move(call), [this](const Status& status) { finish(status); });
  }
  void OnCancel() override { call_->cancel(); }
  void OnDone() override { delete this; }

 private:
  void finish(const Status& status) {
    bool own = false;
    const grpc::Status written =
        status.ok() ? grpc::SerializationTraits<WireMessage>::Serialize(call_->reply(), reply_, &own) : to_grpc(status);
    Finish(written);
  }

  const std::shared_ptr<OperationCall> call_;
  grpc::ByteBuffer* const reply_;  ///< owned by gRPC, valid until Finish
};

}  // namespace

grpc::ServerUnaryReactor* answer_unary(Runtime& runtime, const Operation& operation,
                                       grpc::CallbackServerContext& context, const grpc::ByteBuffer& request,
                                       grpc::ByteBuffer* reply) {
  auto* const call = new UnaryCall(runtime, operation, reply);
  call->start(runtime.gate(), context, request);
  return call;
}

}  // namespace lightmill
