// The farm's log of what was done and refused, as those who answer calls write it.
#pragma once

#include <string>

#include "server/runtime/farm_loop.h"
#include "server/runtime/gate.h"

namespace lightmill {

/// Writes into the log that this was done, unless it had been before, or, as often as the gate lets it, that it was
/// refused. Other errors are the caller's mistakes, and leave no trace.
void record(FarmLoop::Turn& turn, const Gate& gate, const Call& call, const About& about, const Status& status);

/// The same of what was refused, once the gate has let it; `unwritten` as it has said.
void record_refusal(FarmLoop::Turn& turn, const Call& call, const About& about, const Status& status,
                    const Unwritten& unwritten);

/// The same of who logs in on the page, or tries to.
void record_login(FarmLoop::Turn& turn, const Gate& gate, const Identity& caller, const std::string& peer,
                  const Status& status);

/// Writes down what the coordinator itself does.
void record_own(FarmLoop::Turn& turn, std::string_view what, std::string about);

/// RESOURCE_EXHAUSTED while the farm can store nothing: what is asked for then would wait, and its caller with it.
Status check_store(const FarmLoop::Turn& turn);

/// What a farm says that has no time now. RESOURCE_EXHAUSTED.
inline Status busy() {
  return resource_exhausted("the farm has too much to do at once: try again");
}

/// Whether the caller may do so with this job; a refusal is recorded. NOT_FOUND, PERMISSION_DENIED.
Status check_job_call(FarmLoop::Turn& turn, const Gate& gate, const Call& call, JobId job);

}  // namespace lightmill
