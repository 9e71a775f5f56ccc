// Calls that change something: done on the farm thread, and written into the farm's log in the same transaction.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <functional>

#include "server/api/grpc_gate.h"
#include "server/runtime/records.h"

namespace lightmill {

/// Does what is asked, and says what it was about. What it adds to the turn's replies is called before the caller is
/// answered.
using Change = std::function<Status(FarmLoop::Turn& turn, const Call& call, About& about)>;

/// Makes the change if the gate has admitted the call, records it, and answers once both are durable. Of RPCs that are
/// recorded. If `with_film_of` is given, this job's film is in memory when the change is made.
grpc::ServerUnaryReactor* run_change(FarmLoop& loop, const Gate& gate, grpc::CallbackServerContext* context,
                                     const Result<Call>& admitted, Change change,
                                     std::optional<JobId> with_film_of = std::nullopt);

}  // namespace lightmill
