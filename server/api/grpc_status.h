// Conversion of Status to gRPC's Status. The codes are the same numbers. Texts are printable and short, because they may
// quote what a caller sent, and gRPC sends them as a header.
#pragma once

#include <grpcpp/support/status.h>

#include "common/base/status.h"
#include "common/base/text.h"

namespace lightmill {

inline constexpr std::size_t kMaxStatusBytes = 2000;

inline grpc::Status to_grpc(const Status& status) {
  return status.ok() ? grpc::Status::OK
                     : grpc::Status(static_cast<grpc::StatusCode>(status.code()),
                                    cut_text(printable(message_of(status), true), kMaxStatusBytes));
}

}  // namespace lightmill
