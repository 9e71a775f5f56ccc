// Interface between the tracer and the estimator of a method.
#pragma once

#include "common/methods/tracer/wavefront.h"

namespace lightmill::tracer {

/// Base of all estimators, with default hooks. An estimator hides the hooks that it changes. Calls are resolved at
/// compile time. One estimator renders one sample of a tile. It also has
///
///   using Path, Workspace, Shared      its paths (Path8 or derived from it), the scratch memory of a thread
///                                      (PathWorkspace<Path> or derived, made from Shared), what all threads share
///   Estimator(const CompiledScene&, const Shared&, std::uint64_t sample, std::uint64_t end, Workspace&)
///   F8 emission_weight(in, hits, point, cosine, bounce, lanes)     for paths that hit an emitter
///   F8 environment_weight(in, bounce, lanes)                       for paths that left the scene
///   F8 light_hit_weight(in, light_index, met, bounce)      for paths that met an intersectable light
///   void scatter(tracer, vertex, bsdf, wo, lanes)                  at surfaces whose BSDF has a density
struct EstimatorBase {
  /// Photons bring all light of irradiance meters, so no path starts on one.
  static constexpr bool kPhotonsReachMeters = false;
  /// The estimator has scatter_in_medium(tracer, in, passage, lanes, bounce).
  static constexpr bool kScattersInMedia = false;
  /// Next-event estimation in media. Else photons bring their light.
  static constexpr bool kSamplesLightsInMedia = true;

  /// Colours of textures are averaged over the footprints of paths.
  static constexpr bool kAveragesTextures = true;

  /// A camera ray starts.
  static void start(Path8& /*path*/) {}
  /// A path starts on an irradiance meter.
  template <class Path>
  static void start_on_meter(const CompiledMeter& /*meter*/, Path& /*path*/, typename Path::AtVertex& /*at*/) {}
  /// A path has reached a surface.
  template <class Path>
  static typename Path::AtVertex arrive(const Path& /*in*/, const Surface8& /*surface*/, M8 /*lanes*/) {
    return {};
  }
  /// A delta BSDF has scattered a path. Returns the lanes that continue.
  template <class Path>
  static M8 scatter_delta(const PathVertex8<Path>& /*vertex*/, const BsdfSample8& /*sample*/, Path& /*out*/, M8 lanes) {
    return lanes;
  }
  /// All paths of a bounce are scattered. Their shadow rays come next.
  template <class Tracer>
  static void finish_bounce(Tracer& /*tracer*/) {}
  /// All paths of the sample have ended.
  template <class Tracer>
  static void finish_sample(Tracer& /*tracer*/) {}
};

/// Scratch memory of a thread that traces such paths.
template <class Path>
struct PathWorkspace : WavefrontWorkspace {
  template <class Shared>
  explicit PathWorkspace(const Shared& /*shared*/) {}
  MediaQueue<Path> paths, next;
};

}  // namespace lightmill::tracer
