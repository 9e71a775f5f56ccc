#include "common/scene_io/pbrt/pbrt_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/film/tile_grid.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

/// The part of the film in pixels that the scene asks for (film.cpp of pbrt): x0, x1, y0, y1.
void say_crop(const PbrtParameters& film, const FilmSettings& size, Notices& notices) {
  const std::vector<double> bounds = film.numbers("pixelbounds", {"integer"});
  const std::vector<double> window = film.numbers("cropwindow", {"float"});
  std::array<double, 4> crop{};
  if (window.size() == 4) {
    const auto edge = [](double share, int pixels) { return std::ceil(std::clamp(share, 0.0, 1.0) * pixels); };
    crop = {edge(std::min(window[0], window[1]), size.width), edge(std::max(window[0], window[1]), size.width),
            edge(std::min(window[2], window[3]), size.height), edge(std::max(window[2], window[3]), size.height)};
  } else if (bounds.size() == 4) {
    crop = {std::clamp<double>(bounds[0], 0, size.width), std::clamp<double>(bounds[1], 0, size.width),
            std::clamp<double>(bounds[2], 0, size.height), std::clamp<double>(bounds[3], 0, size.height)};
  } else {
    if (!window.empty() || !bounds.empty()) {
      film.fail(window.empty() ? "pixelbounds" : "cropwindow", "four numbers are expected");
    }
    return;
  }
  notices.once(fmt::format("the whole film is rendered: --crop {},{},{},{} renders the scene's crop window", crop[0],
                           crop[2], std::max(crop[1] - crop[0], 0.0), std::max(crop[3] - crop[2], 0.0)));
}

void read_film(const PbrtEntity& from, PbrtView& out, Notices& notices) {
  const PbrtParameters& film = from.parameters;
  if (from.type != "rgb" && from.type != "gbuffer" && from.type != "spectral") {
    film.fail(film.place().error("unknown Film \"{}\"", from.type));
  } else if (from.type != "rgb") {
    notices.left_out(fmt::format("the further channels of the film \"{}\" (--layers adds some)", from.type));
  }
  out.film.width = static_cast<int>(film.whole("xresolution", 1280, 1, kMaxFilmSide));
  out.film.height = static_cast<int>(film.whole("yresolution", 720, 1, kMaxFilmSide));
  say_crop(film, out.film, notices);
  out.exposure *= film.number("iso", 100, 0, 1e10) / 100;
  if (const std::string sensor = film.text("sensor", "cie1931"); sensor != "cie1931") {
    notices.left_out(fmt::format("the colours of the sensor \"{}\": it is rendered as \"cie1931\"",
                                 cut_text(printable(sensor), 80)));
  }
  if (film.number("whitebalance", 0) != 0) {
    notices.left_out("the film's white balance");
  }
  if (film.has("maxcomponentvalue") && film.number("maxcomponentvalue", 0) > 0) {
    notices.left_out("the film's largest component: bright samples are not clamped");
  }
  for (const char* unused :
       {"filename", "diagonal", "savefp16", "coordinatesystem", "nbuckets", "lambdamin", "lambdamax"}) {
    film.find(unused);
  }
}

void read_filter(const PbrtEntity& from, PixelFilter& out, Notices& notices) {
  const PbrtParameters& filter = from.parameters;
  struct Known {
    std::string_view name;
    FilterKind kind;
    double radius;
  };
  constexpr std::array<Known, 5> kFilters{{{"box", FilterKind::box, 0.5},
                                           {"gaussian", FilterKind::gaussian, 1.5},
                                           {"triangle", FilterKind::tent, 2},
                                           {"mitchell", FilterKind::blackman_harris, 2},
                                           {"sinc", FilterKind::blackman_harris, 4}}};
  const auto* known = std::ranges::find(kFilters, from.type, &Known::name);
  if (known == kFilters.end()) {
    filter.fail(filter.place().error("unknown PixelFilter \"{}\"", from.type));
    return;
  }
  const double x = filter.number("xradius", known->radius, 1e-3, kMaxFilterRadius);
  const double y = filter.number("yradius", known->radius, 1e-3, kMaxFilterRadius);
  if (known->kind == FilterKind::blackman_harris) {
    notices.once(
        fmt::format("the pixel filter \"{}\" is rendered as Blackman-Harris with a radius of 1.5 pixels", from.type));
    for (const char* unused : {"B", "C", "tau"}) {
      filter.find(unused);
    }
    return;
  }
  if (x != y) {
    notices.once("the pixel filter has its radius in x along y, too");
  }
  out = {known->kind, x};
  if (const double sigma = filter.number("sigma", 0.5, 1e-3, 100);
      known->kind == FilterKind::gaussian && std::abs(sigma - x / 3) > 1e-3) {
    notices.once(fmt::format("the gaussian pixel filter has a sigma of {:.3} pixels, a third of its radius", x / 3));
  }
}

/// Sets the field of view. pbrt's is along the shorter axis of the film, or rather from -1 to 1 of the screen window.
void read_field_of_view(const PbrtParameters& camera, PbrtView& out) {
  const double aspect = static_cast<double>(out.film.width) / out.film.height;
  const double fov = camera.number("fov", 90, 1e-3, 179.999);
  const double frame = camera.number("frameaspectratio", aspect, 1e-3, 1e3);
  std::vector<double> window = camera.numbers("screenwindow", {"float"});
  if (!window.empty() && window.size() != 4) {
    camera.fail("screenwindow", "four numbers are expected");
    return;
  }
  if (window.empty()) {
    window = frame > 1 ? std::vector<double>{-frame, frame, -1, 1} : std::vector<double>{-1, 1, -1 / frame, 1 / frame};
  }
  const double width = window[1] - window[0], height = window[3] - window[2];
  const double tolerance = 1e-3 * std::max(std::abs(width), std::abs(height));
  if (!(width > 0 && height > 0) || std::abs(width - height * aspect) > tolerance * std::max(aspect, 1.0)) {
    camera.fail(camera.has("screenwindow") ? "screenwindow" : "frameaspectratio",
                "only square pixels can be rendered: the film's aspect ratio is expected");
  } else {
    out.camera.shift_x = (window[0] + window[1]) / 2 / height;
    out.camera.shift_y = (window[2] + window[3]) / 2 / height;
  }
  const double half = std::tan(fov / 2 * std::numbers::pi / 180) * std::abs(height) / 2;
  out.camera.vertical_fov_degrees = std::clamp(2 * std::atan(half) * 180 / std::numbers::pi, 1e-6, 179.9999);
}

void read_camera(const PbrtEntity& from, const Transform& camera_from_world, PbrtView& out) {
  const PbrtParameters& camera = from.parameters;
  const std::optional<Transform> to_world = inverse(camera_from_world);
  const std::optional<double> scale = to_world ? similarity_scale(*to_world) : std::nullopt;
  if (!scale) {
    camera.fail(
        camera.place().error("the camera's transform must be a similarity: it can move, turn, mirror and scale"));
    return;
  }
  if (from.type != "perspective") {
    camera.fail(camera.place().error("only the camera \"perspective\" can be rendered, got \"{}\"", from.type));
    return;
  }
  if (determinant(*to_world) > 0) {
    out.world_to_scene = kMirrorX;
  }
  const Transform to_scene = compose(out.world_to_scene, *to_world);
  out.camera = camera_along_z(to_scene);
  read_field_of_view(camera, out);
  out.camera.lens_radius = camera.number("lensradius", 0, 0, 1e6) * *scale;
  const double focus = camera.number("focaldistance", 1e6, 1e-6, 1e30) * *scale;
  out.camera.focus_distance = out.camera.lens_radius > 0 ? std::min(focus, kMaxCoordinate) : 0;
  const double open = camera.number("shutteropen", 0), close = camera.number("shutterclose", 1);
  if (!(close > open)) {
    camera.fail("shutterclose", "must be after shutteropen");
  }
  out.exposure *= close - open;
}

}  // namespace

Result<PbrtView> read_pbrt_view(const PbrtOptions& options, const SourcePlace& end, Notices& notices, Faults& faults) {
  const auto entity = [&](const std::optional<PbrtEntity>& given, const char* type, const char* what) {
    return given ? *given : PbrtEntity{type, PbrtParameters({}, end, what)};
  };
  const PbrtEntity film = entity(options.film, "rgb", "Film"),
                   filter = entity(options.filter, "gaussian", "PixelFilter"),
                   camera = entity(options.camera, "perspective", "Camera");
  PbrtView out;
  read_film(film, out, notices);
  LM_RETURN_IF_ERROR(film.parameters.finish(faults));
  read_filter(filter, out.film.filter, notices);
  LM_RETURN_IF_ERROR(filter.parameters.finish(faults));
  read_camera(camera, options.camera_from_world, out);
  LM_RETURN_IF_ERROR(camera.parameters.finish(faults));
  return out;
}

}  // namespace lightmill
