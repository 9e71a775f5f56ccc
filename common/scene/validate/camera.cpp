#include "common/scene/validate/parts.h"

#include "common/film/tile_grid.h"

namespace lightmill {

Status check_film(const FilmSettings& film) {
  for (const auto& [side, pixels] : {std::pair{"width", film.width}, {"height", film.height}}) {
    if (!is_film_side(pixels)) {
      return invalid_argument("film.{}: must be 1 to {}, got {}", side, kMaxFilmSide, pixels);
    }
  }
  if (!(film.filter.radius_pixels > 0 && film.filter.radius_pixels <= kMaxFilterRadius)) {
    return invalid_argument("film.filter.radius_pixels: must be in (0, {}], got {}", kMaxFilterRadius,
                            film.filter.radius_pixels);
  }
  return ok_status();
}

Status validate(const Camera& camera) {
  LM_RETURN_IF_ERROR(check_point("camera.eye", camera.eye));
  LM_RETURN_IF_ERROR(check_point("camera.look_at", camera.look_at));
  LM_RETURN_IF_ERROR(check_point("camera.up", camera.up));
  if (!(camera.vertical_fov_degrees > 0 && camera.vertical_fov_degrees < 180)) {
    return invalid_argument("camera.vertical_fov_degrees: must be in (0, 180), got {}", camera.vertical_fov_degrees);
  }
  for (const auto& [field, value] :
       {std::pair{"lens_radius", camera.lens_radius}, {"focus_distance", camera.focus_distance}}) {
    if (!(value >= 0 && value <= kMaxCoordinate)) {
      return invalid_argument("camera.{}: must be from 0 to {}, got {}", field, kMaxCoordinate, value);
    }
  }
  for (const auto& [field, value] : {std::pair{"shift_x", camera.shift_x}, {"shift_y", camera.shift_y}}) {
    if (!(std::abs(value) <= kMaxShift)) {
      return invalid_argument("camera.{}: must be from {} to {}, got {}", field, -kMaxShift, kMaxShift, value);
    }
  }
  const Point3d ahead = difference(camera.look_at, camera.eye);
  const Point3d& up = camera.up;
  if (!(length(ahead) > 0)) {
    return invalid_argument("camera.look_at: must differ from camera.eye, both are ({}, {}, {})", camera.eye[0],
                            camera.eye[1], camera.eye[2]);
  }
  if (!(length(up) > 0)) {
    return invalid_argument("camera.up: must not be zero");
  }
  if (are_parallel(ahead, up)) {
    return invalid_argument("camera.up: must not be parallel to the direction from eye to look_at, got ({}, {}, {})",
                            up[0], up[1], up[2]);
  }
  return ok_status();
}

}  // namespace lightmill
