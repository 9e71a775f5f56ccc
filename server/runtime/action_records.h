// Entries of the action log: actions and refusals of calls.
#pragma once

#include <string>

#include "server/runtime/access_control.h"
#include "server/runtime/farm_loop.h"

namespace lightmill {

/// Records an action that succeeded, unless an earlier call had done it. Records a refusal if the log's limits allow
/// the entry. Other errors are mistakes of the caller, and are not recorded.
void record(FarmLoop::TaskContext& context, const AccessControl& access, const Call& call, const CallSubject& about,
            const Status& status);

/// Records a refusal that the log's limits allow. `suppressed`: from AccessControl::may_record_refusal.
void record_refusal(FarmLoop::TaskContext& context, const Call& call, const CallSubject& about, const Status& status,
                    const SuppressedRefusals& suppressed);

/// Records a login on the page, or a refused one.
void record_login(FarmLoop::TaskContext& context, const AccessControl& access, const Identity& caller,
                  const std::string& peer, const Status& status);

/// Records an action of the coordinator itself.
void record_own(FarmLoop::TaskContext& context, std::string_view what, std::string about);

/// Whether the caller may make this call for this job. Records a refusal. NOT_FOUND, PERMISSION_DENIED.
Status check_job_call(FarmLoop::TaskContext& context, const AccessControl& access, const Call& call, JobId job);

}  // namespace lightmill
