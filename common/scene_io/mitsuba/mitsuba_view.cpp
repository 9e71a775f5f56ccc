#include "common/scene_io/mitsuba/mitsuba_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/film/tile_grid.h"
#include "common/scene_io/statement_reader.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kMaxOffset = 1;  ///< of the principal point, in sides of the film

void read_rfilter(const MitsubaObject& from, PixelFilter& out, Notices& notices) {
  if (from.type == "box") {
    out = {FilterKind::box, 0.5};
  } else if (from.type == "tent") {
    out = {FilterKind::tent, from.number("radius", 1, 1e-3, kMaxFilterRadius)};
  } else if (from.type == "gaussian") {
    out = {FilterKind::gaussian, 3 * from.number("stddev", 0.5, 1e-3, kMaxFilterRadius / 3)};
  } else if (from.type == "mitchell" || from.type == "catmullrom" || from.type == "lanczos") {
    notices.once(
        fmt::format("the pixel filter \"{}\" is rendered as Blackman-Harris with a radius of 1.5 pixels", from.type));
    from.ignore({"A", "B", "C", "lobes"});
  } else {
    from.fail(from.place.error("unknown rfilter \"{}\"", from.type));
  }
}

Status read_hdrfilm(const MitsubaObject& from, FilmSettings& out, Notices& notices, Faults& faults) {
  if (from.type != "hdrfilm") {
    return from.place.error("films of the type \"{}\" cannot be rendered", from.type);
  }
  out.width = static_cast<int>(from.whole("width", 768, 1, kMaxFilmSide));
  out.height = static_cast<int>(from.whole("height", 576, 1, kMaxFilmSide));
  const std::int64_t x = from.whole("crop_offset_x", 0, 0, out.width),
                     y = from.whole("crop_offset_y", 0, 0, out.height);
  const std::int64_t width = from.whole("crop_width", out.width, 1, out.width),
                     height = from.whole("crop_height", out.height, 1, out.height);
  if (x != 0 || y != 0 || width != out.width || height != out.height) {
    notices.once(fmt::format("the whole film is rendered: --crop {},{},{},{} renders the scene's crop window", x, y,
                             width, height));
  }
  from.ignore({"file_format", "pixel_format", "component_format", "sample_border", "banner", "compensate", "fps"});
  out.filter = {FilterKind::gaussian, 1.5};
  for (const MitsubaObject* filter : from.nested("rfilter")) {
    read_rfilter(*filter, out.filter, notices);
    LM_RETURN_IF_ERROR(filter->finish(faults));
  }
  return from.finish(faults);
}

/// Half of the film's height at distance 1.
double half_height(const MitsubaObject& from, double aspect) {
  double fov = from.number("fov", 45, 1e-3, 179.999);
  std::string axis = from.text("fov_axis", "x");
  if (from.has("fov") && from.has("focal_length")) {
    from.fail("focal_length", "cannot be given together with fov");
  }
  if (!from.has("fov")) {
    std::string text = from.text("focal_length", "50mm");
    text.erase(text.ends_with("mm") ? text.size() - 2 : text.size());
    const std::optional<double> length = parse_number(text);
    if (!length || !(*length >= 1e-3 && *length <= 1e6)) {
      from.fail("focal_length", "a length such as \"50mm\" is expected");
    }
    fov = 2 * std::atan(std::hypot(36.0, 24.0) / (2 * length.value_or(50))) * kDegrees;  // of a 35 mm film
    axis = "diagonal";
  }
  const double half = std::tan(fov / 2 / kDegrees);
  if (axis == "x" || (axis == "smaller" && aspect <= 1) || (axis == "larger" && aspect > 1)) {
    return half / aspect;
  }
  if (axis == "diagonal") {
    return half / std::hypot(1.0, aspect);
  }
  if (axis != "y" && axis != "smaller" && axis != "larger") {
    from.fail("fov_axis", "x, y, diagonal, smaller or larger is expected");
  }
  return half;
}

void read_lens(const MitsubaObject& from, MitsubaView& out) {
  const bool lens = from.type == "thinlens";
  if (!lens && from.type != "perspective") {
    return from.fail(from.place.error("sensors of the type \"{}\" cannot be rendered", from.type));
  }
  const Transform to_world = from.transform("to_world");
  const std::optional<double> scale = similarity_scale(to_world);
  if (!scale || std::abs(*scale - 1) > 1e-3 || determinant(to_world) < 0) {
    return from.fail("to_world", "only moves and turns of a camera can be rendered");
  }
  Camera& camera = out.camera.camera;
  camera = camera_along_z(to_world);
  const double aspect = static_cast<double>(out.film.width) / out.film.height;
  out.camera.aspect = aspect;
  camera.vertical_fov_degrees = std::clamp(2 * std::atan(half_height(from, aspect)) * kDegrees, 1e-6, 179.9999);
  camera.lens_radius = lens ? from.number("aperture_radius", 0, 0, 1e6) : 0;
  const double focus = from.number("focus_distance", 1e4, 1e-6, kMaxCoordinate);
  camera.focus_distance = camera.lens_radius > 0 ? focus : 0;
  // In widths to the right, and in heights downwards.
  camera.shift_x = aspect * from.number("principal_point_offset_x", 0, -kMaxOffset, kMaxOffset);
  camera.shift_y = -from.number("principal_point_offset_y", 0, -kMaxOffset, kMaxOffset);
  from.ignore({"near_clip", "far_clip", "shutter_open", "shutter_close"});
}

}  // namespace

Result<MitsubaView> read_mitsuba_view(const MitsubaObject& sensor, Notices& notices, Faults& faults) {
  MitsubaView out;
  out.film = {768, 576, {FilterKind::gaussian, 1.5}};
  out.camera.name = utf8_text(sensor.label());
  const std::vector<const MitsubaObject*> films = sensor.nested("film"), samplers = sensor.nested("sampler");
  if (films.size() > 1 || samplers.size() > 1) {
    return sensor.place.error("{}: at most one film and one sampler are possible, got {} and {}", sensor.what(),
                              films.size(), samplers.size());
  }
  for (const MitsubaObject* film : films) {
    LM_RETURN_IF_ERROR(read_hdrfilm(*film, out.film, notices, faults));
  }
  for (const MitsubaObject* sampler : samplers) {
    const std::int64_t samples = sampler->whole("sample_count", 4, 1, std::int64_t{1} << 40);
    notices.left_out(fmt::format("the sampler's {} samples per pixel (the job's samples are used)", samples));
  }
  read_lens(sensor, out);
  LM_RETURN_IF_ERROR(sensor.finish(faults));
  return out;
}

}  // namespace lightmill
