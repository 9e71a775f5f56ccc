#include "common/methods/method.h"

#include "common/base/check.h"
#include "common/methods/factories.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {

Result<std::unique_ptr<Method>> make_method(std::shared_ptr<const CompiledScene> scene,
                                            const MethodSettings& settings) {
  LM_ASSIGN_OR_RETURN(const MethodSpec spec, parse_method(settings.name));
  LM_RETURN_IF_ERROR(check_method_layers(spec.name, settings.layers));
  LM_RETURN_IF_ERROR(check_max_bounces(spec.name, settings.max_bounces));
  LM_RETURN_IF_ERROR(check_light_groups(settings.layers, scene->light_groups()));
  if (spec.name == "path") {
    return make_path_method(std::move(scene), settings);
  }
  LM_RETURN_IF_ERROR(check_method_media(spec.name, scene->features().media && scene->media().scatters()));
  if (spec.name == "caustic") {
    return make_caustic_method(std::move(scene), settings, spec);
  }
  if (spec.name == "ppm") {
    return make_ppm_method(std::move(scene), settings, spec);
  }
  if (spec.name == "vcm") {
    return make_vcm_method(std::move(scene), settings, spec);
  }
  if (spec.name == "photon-map") {
    return make_photon_map_method(std::move(scene), settings, spec);
  }
  if (spec.name == "preview") {
    return make_preview_method(std::move(scene), settings);
  }
  if (spec.name == "ao") {
    return make_ao_method(std::move(scene), settings, spec);
  }
  if (spec.name == "raycast") {
    return make_raycast_method(std::move(scene), settings, spec);
  }
  if (spec.name == "whitted") {
    return make_whitted_method(std::move(scene), settings, spec);
  }
  if (spec.name == kAutoMethod) {
    return invalid_argument("auto cannot render: choose a method for it first");
  }
  LM_CHECK(false, "a method that is listed can be made: {}", spec.name);
}

}  // namespace lightmill
