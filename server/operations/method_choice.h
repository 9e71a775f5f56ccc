// Method choice: what the planner chooses for a submitted scene, with its reasons.
#pragma once

#include "common/base/status.h"
#include "common/farm/job.h"
#include "server/store/asset_store.h"

namespace lightmill {

/// Replaces `auto` in the settings by a method, or names the candidates of a pilot. For an adaptive job, a single
/// candidate too gets a pilot, which allocates samples. The notes have the reasons, and the light of the scene that the
/// method misses. `assets` has the assets of the scene; reads small meshes of them. INVALID_ARGUMENT if the scene is
/// damaged and the choice needs it. Else the worker that reads the scene reports the damage.
Result<MethodNotes> settle_method(JobSpec& spec, const AssetStore& assets);

/// Adds the layer `bias` to the film of a job with an error goal, if a method that it may get gathers photons.
void add_bias_layer(JobSpec& spec, const MethodNotes& notes);

}  // namespace lightmill
