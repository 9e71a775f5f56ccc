// Entries of the action log: actions and refusals of calls.
#pragma once

#include <string>

#include "server/runtime/farm_loop.h"
#include "server/runtime/gate.h"

namespace lightmill {

/// Records an action that succeeded, unless an earlier call had done it. Records a refusal if the gate's limits allow
/// the entry. Other errors are mistakes of the caller, and are not recorded.
void record(FarmLoop::TaskContext& context, const Gate& gate, const Call& call, const CallSubject& about,
            const Status& status);

/// Records a refusal that the gate's limits allow. `suppressed`: from Gate::may_record_refusal.
void record_refusal(FarmLoop::TaskContext& context, const Call& call, const CallSubject& about, const Status& status,
                    const SuppressedRefusals& suppressed);

/// Records a login on the page, or a refused one.
void record_login(FarmLoop::TaskContext& context, const Gate& gate, const Identity& caller, const std::string& peer,
                  const Status& status);

/// Records an action of the coordinator itself.
void record_own(FarmLoop::TaskContext& context, std::string_view what, std::string about);

/// Whether the caller may make this call for this job. Records a refusal. NOT_FOUND, PERMISSION_DENIED.
Status check_job_call(FarmLoop::TaskContext& context, const Gate& gate, const Call& call, JobId job);

}  // namespace lightmill
