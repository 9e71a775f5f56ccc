// Calls that change something: done on the farm thread, and written into the farm's log in the same transaction.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <string>

#include "server/api/farm_loop.h"
#include "server/api/gate.h"

namespace lightmill {

/// What a call was about.
struct About {
  std::uint64_t job = 0;  ///< 0: none
  std::string text;       ///< a worker, or a token
};

/// Writes into the log that this was done or, as often as the gate lets it, that it was refused. Other errors are the
/// caller's mistakes, and leave no trace.
void record(FarmLoop::Turn& turn, const Gate& gate, const Call& call, const About& about, const Status& status);

/// The same of what was refused, once the gate has let it; `left_out` as it has said.
void record_refusal(FarmLoop::Turn& turn, const Call& call, const About& about, const Status& status,
                    std::uint64_t left_out);

/// Writes down what the coordinator itself does.
void record_own(FarmLoop::Turn& turn, std::string_view what, std::string about);

/// Whether the caller may do so with this job; a refusal is recorded. NOT_FOUND, PERMISSION_DENIED.
Status check_job_call(FarmLoop::Turn& turn, const Gate& gate, const Call& call, JobId job);

/// Does what is asked, and says what it was about. What it adds to the turn's replies is called before the caller is
/// answered.
using Change = std::function<Status(FarmLoop::Turn& turn, const Call& call, About& about)>;

/// Makes the change if the gate has admitted the call, records it, and answers once both are durable. Of RPCs that are
/// recorded.
grpc::ServerUnaryReactor* run_change(FarmLoop& loop, const Gate& gate, grpc::CallbackServerContext* context,
                                     const Result<Call>& admitted, Change change);

}  // namespace lightmill
