// Factories of all methods, for make_method, and for tests and benchmarks that set more than MethodSettings.
#pragma once

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"
#include "common/methods/tracer/sample_plan.h"

namespace lightmill {

using ScenePointer = std::shared_ptr<const CompiledScene>;

std::unique_ptr<Method> make_ao_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec);
std::unique_ptr<Method> make_preview_method(ScenePointer scene, const MethodSettings& settings);
std::unique_ptr<Method> make_raycast_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec);
std::unique_ptr<Method> make_whitted_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec);

std::unique_ptr<Method> make_path_method(ScenePointer scene, const MethodSettings& settings,
                                         const tracer::Constants& constants = {});

// Methods with photons require a scene whose media do not scatter.
std::unique_ptr<Method> make_caustic_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec);
std::unique_ptr<Method> make_ppm_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec);
std::unique_ptr<Method> make_photon_map_method(ScenePointer scene, const MethodSettings& settings,
                                               const MethodSpec& spec);

namespace vcm {
/// Connections that a thread traces together. They take 3.3 MiB, and almost no lane is idle.
inline constexpr std::uint32_t kConnectionsAtOnce = 65536;
}  // namespace vcm
/// `connections_at_once`: at least 1. It changes no bit.
std::unique_ptr<Method> make_vcm_method(ScenePointer scene, const MethodSettings& settings, const MethodSpec& spec,
                                        std::uint32_t connections_at_once = vcm::kConnectionsAtOnce);

}  // namespace lightmill
