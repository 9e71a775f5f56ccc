#include "server/api/unary_calls.h"

#include <grpcpp/impl/codegen/proto_utils.h>

#include "server/api/grpc_access.h"
#include "server/api/grpc_status.h"
#include "server/operations/operation_call.h"

namespace lightmill {
namespace {

/// Deletes itself.
class UnaryCall final : public RequestCall<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  UnaryCall(Runtime& runtime, CallResources& shared, const Operation& operation, grpc::CallbackServerContext& context)
      : access_(runtime.access()),
        shared_(shared),
        context_(context),
        caller_(caller_of(access_, context)),
        call_(std::make_shared<OperationCall>(runtime, operation)) {
    if (caller_.identity.ok()) {
      read_request(shared.reads, holder_of(*caller_.identity, caller_.peer));
    } else {
      Finish(to_grpc(admit(access_, caller_, context, operation.rpc).status()));
    }
  }
  void OnDone() override { delete this; }

 private:
  void request_read() override {
    const std::uint64_t most_bytes = call_->operation().traits.most_body_bytes;
    const bool large = most_bytes > 0;
    const Status read = large ? ok_status() : parse(kSmallRequestBytes);
    // The refusal of a small request says what it names.
    Result<Call> call = admit(access_, caller_, context_, call_->operation().rpc, call_->about());
    if (!call.ok() || !read.ok()) {
      return fail(call.ok() ? read : call.status());
    }
    if (!large) {
      return begin(*std::move(call));
    }
    boost::asio::post(shared_.requests, [this, most_bytes, call = *std::move(call)]() mutable {
      const Status parsed = parse(most_bytes);
      parsed.ok() ? begin(std::move(call)) : fail(parsed);
    });
  }
  void fail(const Status& status) override { Finish(to_grpc(status)); }
  void client_left() override { call_->cancel(); }

  void begin(Call call) {
    call_->start(std::move(call), [this](const Status& status) { finish(status); });
  }
  /// Parses the request, and frees its bytes.
  Status parse(std::uint64_t most_bytes) {
    WireMessage& parsed = call_->request();
    if (request().Length() > most_bytes) {
      return invalid_argument("the request has {} bytes, a {} has at most {}", request().Length(), parsed.GetTypeName(),
                              most_bytes);
    }
    grpc::ProtoBufferReader reader(&request());
    const bool ok = parsed.ParseFromZeroCopyStream(&reader);
    request().Clear();
    return ok ? ok_status() : invalid_argument("the request is not a {}", parsed.GetTypeName());
  }

  void finish(const Status& status) {
    bool own = false;
    const grpc::Status written = status.ok()
                                     ? grpc::SerializationTraits<WireMessage>::Serialize(call_->reply(), &reply_, &own)
                                     : to_grpc(status);
    written.ok() ? StartWriteAndFinish(&reply_, {}, written) : Finish(written);
  }

  const AccessControl& access_;
  CallResources& shared_;
  grpc::CallbackServerContext& context_;
  const Caller caller_;
  const std::shared_ptr<OperationCall> call_;
  grpc::ByteBuffer reply_;
};

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* answer_unary(Runtime& runtime, CallResources& shared,
                                                                          const Operation& operation,
                                                                          grpc::CallbackServerContext& context) {
  return new UnaryCall(runtime, shared, operation, context);
}

}  // namespace lightmill
