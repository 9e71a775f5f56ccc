// `path`: see path_estimator.h.
#include "common/methods/factories.h"

#include "common/methods/path/path_estimator.h"
#include "common/methods/tracer/tracer_method.h"

namespace lightmill {

std::unique_ptr<Method> make_path_method(ScenePointer scene, const MethodSettings& settings,
                                         const tracer::Constants& constants) {
  return std::make_unique<tracer::TracerMethod<path::PathEstimator>>(
      std::move(scene), settings, std::make_unique<const path::PathEstimator::Shared>(), constants);
}

}  // namespace lightmill
