#include "common/farm/film_rules.h"

namespace lightmill {

Status check_crop(const RenderSettings& settings) {
  if (settings.width < 1 || settings.width > kMaxFilmSide || settings.height < 1 || settings.height > kMaxFilmSide) {
    return invalid_argument("settings: a film has 1 to {} pixels on a side, got {}x{}", kMaxFilmSide, settings.width,
                            settings.height);
  }
  const PixelRect& crop = settings.crop;
  const bool crop_fits = crop.x >= 0 && crop.y >= 0 && crop.width > 0 && crop.height > 0 &&
                         crop.width <= settings.width - crop.x && crop.height <= settings.height - crop.y;
  if (!crop_fits) {
    return invalid_argument("settings.crop: {},{} {}x{} does not lie within {}x{} pixels", crop.x, crop.y, crop.width,
                            crop.height, settings.width, settings.height);
  }
  return settings.meters <= kMaxMeters
             ? ok_status()
             : invalid_argument("settings.meters: at most {}, got {}", kMaxMeters, settings.meters);
}

Status check_film(const RenderSettings& settings) {
  LM_RETURN_IF_ERROR(check_crop(settings));
  return with_context(check_layers(settings.layers), "settings.layers");
}

}  // namespace lightmill
