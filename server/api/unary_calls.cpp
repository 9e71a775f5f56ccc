#include "server/api/unary_calls.h"

#include <grpcpp/impl/codegen/proto_utils.h>

#include "server/api/grpc_access.h"
#include "server/api/grpc_status.h"
#include "server/operations/operation_call.h"

namespace lightmill {
namespace {

/// Deletes itself.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  UnaryCall(Runtime& runtime, const Operation& operation, grpc::ByteBuffer* reply)
      : call_(std::make_shared<OperationCall>(runtime, operation)), reply_(reply) {}

  void start(const AccessControl& access, CallThreads& threads, grpc::CallbackServerContext& context,
             grpc::ByteBuffer request) {
    const std::uint64_t most_bytes = call_->operation().traits.most_body_bytes;
    const bool large = most_bytes > 0;
    const std::uint64_t bytes = request.Length();
    const Status read = large ? ok_status() : parse(request, kSmallRequestBytes);
    // The refusal of a small request says what it names.
    Result<Call> call = admit(access, context, call_->operation().rpc, call_->about(), large ? 0 : bytes);
    if (!call.ok() || !read.ok()) {
      access.taken(peer_of(context), large ? bytes : 0, 0);
      return Finish(to_grpc(call.ok() ? read : call.status()));
    }
    if (!large) {
      return begin(*std::move(call));
    }
    boost::asio::post(threads.requests, [this, most_bytes, bytes, &access, call = *std::move(call),
                                         request = std::move(request)]() mutable {
      const Status parsed = parse(request, most_bytes);
      request.Clear();
      access.taken(call.peer, bytes, 0);
      parsed.ok() ? begin(std::move(call)) : Finish(to_grpc(parsed));
    });
  }
  void OnCancel() override { call_->cancel(); }
  void OnDone() override { delete this; }

 private:
  void begin(Call call) {
    call_->start(std::move(call), [this](const Status& status) { finish(status); });
  }
  Status parse(grpc::ByteBuffer& request, std::uint64_t most_bytes) {
    WireMessage& parsed = call_->request();
    if (request.Length() > most_bytes) {
      return invalid_argument("the request has {} bytes, a {} has at most {}", request.Length(), parsed.GetTypeName(),
                              most_bytes);
    }
    grpc::ProtoBufferReader reader(&request);
    return parsed.ParseFromZeroCopyStream(&reader) ? ok_status()
                                                   : invalid_argument("the request is not a {}", parsed.GetTypeName());
  }

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

grpc::ServerUnaryReactor* answer_unary(Runtime& runtime, CallThreads& threads, const Operation& operation,
                                       grpc::CallbackServerContext& context, const grpc::ByteBuffer& request,
                                       grpc::ByteBuffer* reply) {
  auto* const call = new UnaryCall(runtime, operation, reply);
  call->start(runtime.access(), threads, context, request);
  return call;
}

}  // namespace lightmill
