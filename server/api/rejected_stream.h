// Stream that ends at once with an error.
#pragma once

#include <grpcpp/support/server_callback.h>

#include "server/api/grpc_status.h"

namespace lightmill {

/// `Reactor` is one of gRPC's stream classes. Deletes itself.
template <class Reactor>
class RejectedStream final : public Reactor {
 public:
  explicit RejectedStream(const Status& why) { this->Finish(to_grpc(why)); }
  void OnDone() override { delete this; }
};

}  // namespace lightmill
