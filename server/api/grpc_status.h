// Conversion of Status to gRPC's Status. The codes are the same numbers.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/status.h"

namespace lightmill {

inline grpc::Status to_grpc(const Status& status) {
  return status.ok() ? grpc::Status::OK
                     : grpc::Status(static_cast<grpc::StatusCode>(status.code()), message_of(status));
}

}  // namespace lightmill
