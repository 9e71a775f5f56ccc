// Unary gRPC methods. Each is an entry in the table of operations.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include "server/api/call_resources.h"
#include "server/api/request_call.h"
#include "server/operations/operation.h"

namespace lightmill {

/// Answers one call of the operation, after access control has admitted it.
grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* answer_unary(Runtime& runtime, CallResources& shared,
                                                                          const Operation& operation,
                                                                          grpc::CallbackServerContext& context);

/// Base of a generated service. It handles all unary methods, so only streams remain. Thread-safe.
template <class Service>
class UnaryCalls : public Service::CallbackService {
 public:
  UnaryCalls(Runtime& runtime, CallResources& shared) {
    for (const Operation& operation : operations()) {
      if (operation.rpc.service == Service::service_full_name() && !operation.traits.http_only) {
        this->MarkMethodStreamed(method_index(Service::service_full_name(), std::string(operation.rpc.method)),
                                 new RequestCallHandler<grpc::ByteBuffer, grpc::ByteBuffer>(
                                     [&runtime, &shared, &operation](grpc::CallbackServerContext* context) {
                                       return answer_unary(runtime, shared, operation, *context);
                                     }));
      }
    }
  }
};

}  // namespace lightmill
