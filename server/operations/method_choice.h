// Which method a job gets, and what is to be said of it: the planner's answer for the scene that was submitted.
#pragma once

#include "common/base/status.h"
#include "common/farm/job.h"
#include "server/store/asset_store.h"

namespace lightmill {

/// `assets` has those of the scene; small meshes among them are looked into. Puts the method that `auto` stands for
/// into the settings, or names those of which a pilot is to pick it (also the only one, where it is to allocate
/// samples); says how it was found and what of the scene's light it misses. INVALID_ARGUMENT if the scene is damaged
/// and something is to be found out about it; else that is left to the worker that reads it.
Result<MethodNotes> settle_method(JobSpec& spec, const AssetStore& assets);

/// Adds the layer `bias` to the film of a job that is to reach an error, if its method gathers photons or a pilot may
/// pick one that does.
void want_bias_layer(JobSpec& spec, const MethodNotes& notes);

}  // namespace lightmill
