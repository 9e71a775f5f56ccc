// Hooks of an estimator: what the tracer asks of a method that traces camera paths.
#pragma once

#include "common/methods/tracer/wavefront.h"

namespace lightmill::tracer {

/// Base of all estimators, with the hooks of one that needs nothing special. An estimator hides the hooks that it does
/// otherwise; calls are resolved at compile time. It is made for one sample of a tile, and also has
///
///   using Path, Workspace, Shared      its paths (Path8 or derived from it), the scratch memory of a thread
///                                      (PathWorkspace<Path> or derived, made from Shared), what all threads share
///   Estimator(const CompiledScene&, const Shared&, std::uint64_t sample, std::uint64_t end, Workspace&)
///   F8 emission_weight(in, hits, point, cosine, bounce, lanes)     of a path that has hit an emitter
///   F8 environment_weight(in, bounce, lanes)                       of one that has left the scene
///   void scatter(tracer, vertex, bsdf, wo, lanes)                  at a surface whose BSDF has a density
struct EstimatorBase {
  /// Photons bring all light that an irradiance meter receives: no path starts on it.
  static constexpr bool kPhotonsReachMeters = false;
  /// There is scatter_in_medium(tracer, in, point, lanes, bounce).
  static constexpr bool kScattersInMedia = false;

  /// A camera ray starts.
  static void start(Path8& /*path*/) {}
  /// A path starts on an irradiance meter.
  template <class Path>
  static void start_on_meter(const MeterPlace& /*meter*/, Path& /*path*/, typename Path::AtVertex& /*at*/) {}
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
  /// All paths of a bounce have been scattered; their shadow rays come next.
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
