// Our Status as gRPC's: the codes are the same numbers.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "common/base/status.h"

namespace lightmill {

inline grpc::Status to_grpc(const Status& status) {
  return status.ok() ? grpc::Status::OK
                     : grpc::Status(static_cast<grpc::StatusCode>(status.code()), message_of(status));
}

/// What a farm says that has no time now.
inline grpc::Status busy() {
  return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "the farm has too much to do at once: try again");
}

/// A reactor that has answered a unary call with `status`.
inline grpc::ServerUnaryReactor* finished(grpc::CallbackServerContext* context, const Status& status) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(to_grpc(status));
  return reactor;
}

}  // namespace lightmill
