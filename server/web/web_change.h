// Changes that are asked for over HTTP: done on the farm thread, and written into the farm's log in the same
// transaction.
#pragma once

#include <functional>

#include "server/runtime/records.h"
#include "server/web/farm_reply.h"

namespace lightmill {

/// Does what is asked, says what it was about, and what to answer.
using WebChange = std::function<Result<ApiReply>(FarmLoop::Turn& turn, About& about)>;

/// Makes the change of a call that was admitted, records it, and answers once both are durable.
void make_change(FarmLoop::Turn& turn, const Gate& gate, const Call& call, const FarmReply& back,
                 const WebChange& change);

/// The job as it stands. NOT_FOUND.
Result<ApiReply> job_reply(FarmLoop::Turn& turn, JobId job);

}  // namespace lightmill
