// `path`: unidirectional path tracing with next-event estimation and multiple importance sampling.
//
// Breadth-first: a batch of camera rays is traced eight at a time, all hits of a bounce are shaded before the next
// bounce, and what is left is packed together, in order, so that Embree and the shading code always see full lanes.
// Sampling decisions are Sobol' pairs for the first vertices and hashed numbers after; Russian roulette is mild and,
// below sample 256, the light that the first surface scatters is followed along two paths (both are functions of the
// sample index alone).
#pragma once

#include <memory>

#include "common/methods/method.h"
#include "common/methods/path/connection_queue.h"
#include "common/methods/path/sample_plan.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {

/// Other constants are for those who measure what they are worth.
std::unique_ptr<Method> make_path_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                         const path::Constants& constants = {});

/// `caustic`: the same without the paths that start at a light, meet casters (MaterialTable::casters) and then another
/// surface, a receiver. These are the light side's to their end (common/methods/photons): photons that arrive at a
/// receiver are splatted to the pixels that see it directly, and gathered where it is first seen over casters. Which
/// side a path belongs to is decided by its surfaces' materials alone, so that none is counted twice or missed.
/// The scene's media must not scatter.
std::unique_ptr<Method> make_caustic_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                            const MethodSpec& spec);

/// `vcm`: vertex connection and merging (common/methods/vcm/weights.h). Light paths, as many as photons are asked for or
/// as have photons::kMostDeposits vertices, are a pass that all tiles of a sample share. Each vertex of a path from the
/// eye samples a lamp, is connected to the vertices of one light path, and merged with all that end near it; each vertex
/// of a light path is splatted to the pixel that sees it. What scatters in single directions alone is passed. The
/// scene's media must not scatter.
/// `connections_at_once`: that a thread traces together, which no bit depends on; at least 1.
std::unique_ptr<Method> make_vcm_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                        const MethodSpec& spec,
                                        std::uint32_t connections_at_once = path::kConnectionsAtOnce);

/// `ppm`: progressive photon mapping (Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach").
/// Photons from all lights bring all that surfaces receive which are no casters, straight from lamps as well; paths
/// from the eye go over casters, and single directions of gloss and coats, to the first of these, and gather there
/// within a radius that shrinks from pass to pass, one a sample. Lamps are sampled from rough casters alone: so what
/// it shows depends on next-event estimation nowhere else. The scene's media must not scatter.
std::unique_ptr<Method> make_ppm_method(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings,
                                        const MethodSpec& spec);

}  // namespace lightmill
