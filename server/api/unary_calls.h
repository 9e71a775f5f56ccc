// Unary gRPC methods. Each is an entry in the table of operations.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "server/api/call_threads.h"
#include "server/operations/operation.h"

namespace lightmill {

/// Answers one call of the operation, after access control has admitted it.
grpc::ServerUnaryReactor* answer_unary(Runtime& runtime, CallThreads& threads, const Operation& operation,
                                       grpc::CallbackServerContext& context, const grpc::ByteBuffer& request,
                                       grpc::ByteBuffer* reply);

/// Base of a generated service. It handles all unary methods, so only streams remain. Thread-safe.
template <class Service>
class UnaryCalls : public Service::CallbackService {
 public:
  UnaryCalls(Runtime& runtime, CallThreads& threads) {
    using Handler = grpc::internal::CallbackUnaryHandler<grpc::ByteBuffer, grpc::ByteBuffer>;
    const auto* const service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(Service::service_full_name());
    for (const Operation& operation : operations()) {
      if (operation.rpc.service == service->full_name() && !operation.traits.http_only) {
        this->MarkMethodRawCallback(
            service->FindMethodByName(std::string(operation.rpc.method))->index(),
            new Handler([&runtime, &threads, &operation](grpc::CallbackServerContext* context,
                                                         const grpc::ByteBuffer* request, grpc::ByteBuffer* reply) {
              return answer_unary(runtime, threads, operation, *context, *request, reply);
            }));
      }
    }
  }
};

}  // namespace lightmill
