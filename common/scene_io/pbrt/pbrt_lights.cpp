#include "common/scene_io/pbrt/pbrt_lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/text.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr double kLargestPower = 1e20;

/// The colour of a light, times its scale and a factor.
RgbColor emitted(const PbrtParameters& from, std::string_view name, PbrtSpectra& spectra, double factor) {
  const RgbColor color = spectra.light(from, name).value_or(RgbColor{1, 1, 1});
  const double scale = from.number("scale", 1, 0, kLargestPower) * factor;
  if (!(std::max({color.r, color.g, color.b}) * scale <= kLargestPower)) {
    from.fail(name, fmt::format("the light must be at most {} after all scales", kLargestPower));
    return {};
  }
  const auto times = [&](float x) { return static_cast<float>(x * scale); };
  return {times(color.r), times(color.g), times(color.b)};
}

/// power / `unit` if there is a power, else 1.
double power_factor(const PbrtParameters& from, std::string_view name, double unit) {
  const double power = from.number(name, -1);
  return power > 0 ? power / unit : 1;
}

/// The direction in the scene of a light that shines from `from` to `to`.
Point3d direction_of(const PbrtParameters& from, const Transform& to_scene) {
  const Point3d begin = from.point("from", {0, 0, 0}), end = from.point("to", {0, 0, 1});
  const Point3d out = map_vector(to_scene, difference(end, begin));
  if (!(length(out) > 1e-30)) {
    from.fail("to", "must differ from the point \"from\"");
    return {0, 0, 1};
  }
  return out;
}

Point3d position_of(const PbrtParameters& from, const Transform& to_scene) {
  const Point3d out = map_point(to_scene, from.point("from", {0, 0, 0}));
  if (!std::ranges::all_of(out, [](double x) { return std::abs(x) <= kMaxCoordinate; })) {
    from.fail("from", fmt::format("coordinates must be at most {}", kMaxCoordinate));
    return {};
  }
  return out;
}

SpotLight spot_of(const PbrtParameters& from, const Transform& to_scene, PbrtSpectra& spectra, double exposure) {
  const double cone = from.number("coneangle", 30, kMinCutoffDegrees, 180);
  const double delta = from.number("conedeltaangle", 5, 0, 180);
  const auto cosine = [](double degrees) { return std::cos(degrees * std::numbers::pi / 180); };
  const double inner = std::max(cone - delta, 0.0);
  // The integral of the falloff over directions: half of the ring counts.
  const double solid_angle = 2 * std::numbers::pi * ((1 - cosine(inner)) + (cosine(inner) - cosine(cone)) / 2);
  SpotLight out;
  out.position = position_of(from, to_scene);
  out.direction = direction_of(from, to_scene);
  out.intensity = emitted(from, "I", spectra, exposure * power_factor(from, "power", solid_angle));
  out.cutoff_degrees = cone;
  out.blend = std::clamp(1 - inner / cone, 0.0, 1.0);
  return out;
}

/// The image of an infinite light, in `out`.
void add_sky(const PbrtParameters& from, const Transform& to_scene, FileSource& files, LoadedScene& loaded,
             EnvironmentLight& out) {
  for (const std::string_view other : {"L", "illuminance"}) {
    if (from.has(other)) {
      from.fail(other, "cannot be rendered together with an image");
    }
  }
  out.orientation = orientation_of(to_scene);
  if (!out.orientation) {
    from.fail("filename", "the image is scaled along its axes. Only a turned or mirrored one can be rendered");
  }
  const std::string name = from.text("filename", "");
  Result<SourceFile> file = files(name);
  if (!file.ok()) {
    from.fail("filename", message_of(file.status()));
    return;
  }
  out.has_image = out.equal_area = true;
  out.file = utf8_text(file->name);
  out.asset =
      add_image(std::move(file->bytes),
                {.name = out.file, .place = from.place().text(), .environment = true, .equal_area = true}, loaded);
}

EnvironmentLight infinite_of(const PbrtParameters& from, const Transform& to_scene, PbrtSpectra& spectra,
                             double exposure, FileSource& files, LoadedScene& loaded) {
  if (from.has("portal")) {
    from.fail("portal", "portals cannot be rendered");
  }
  EnvironmentLight out;
  if (from.has("filename")) {
    add_sky(from, to_scene, files, loaded, out);
  }
  out.radiance = emitted(from, "L", spectra, exposure * power_factor(from, "illuminance", std::numbers::pi));
  return out;
}

}  // namespace

Result<std::optional<PbrtAreaLight>> read_pbrt_area_light(const std::string& type, const PbrtParameters& from,
                                                          PbrtSpectra& spectra, double exposure, Faults& faults) {
  if (type != "diffuse") {
    return from.place().error("unknown AreaLightSource \"{}\"", type);
  }
  if (from.has("filename")) {
    from.fail("filename", "images of area lights cannot be rendered");
  }
  PbrtAreaLight out;
  out.radiance = emitted(from, "L", spectra, exposure);
  out.power = std::max(from.number("power", -1, -kLargestPower, kLargestPower), 0.0);
  out.two_sided = from.boolean("twosided", false);
  LM_RETURN_IF_ERROR(from.finish(faults));
  return is_black(out.radiance) ? std::nullopt : std::optional(out);
}

Result<Light> read_pbrt_light(const std::string& type, const PbrtParameters& from, const Transform& to_scene,
                              PbrtSpectra& spectra, double exposure, FileSource& files, LoadedScene& loaded) {
  Light out;
  out.name = fmt::format("{} of line {}", type, from.place().line);
  if (type == "point") {
    const double factor = exposure * power_factor(from, "power", 4 * std::numbers::pi);
    out.kind = PointLight{position_of(from, to_scene), emitted(from, "I", spectra, factor)};
  } else if (type == "spot") {
    out.kind = spot_of(from, to_scene, spectra, exposure);
  } else if (type == "distant") {
    const double factor = exposure * power_factor(from, "illuminance", 1);
    out.kind = DirectionalLight{direction_of(from, to_scene), emitted(from, "L", spectra, factor)};
  } else if (type == "infinite") {
    out.kind = infinite_of(from, to_scene, spectra, exposure, files, loaded);
  } else {
    return from.place().error("lights of the type \"{}\" cannot be rendered", type);
  }
  LM_RETURN_IF_ERROR(from.finish(loaded.faults));
  return out;
}

}  // namespace lightmill
