#include "common/scene_io/mitsuba/mitsuba_lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/text.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

Point3d origin_of_emitter(const MitsubaObject& from, const Transform& to_scene) {
  const Point3d out = map_point(to_scene, {0, 0, 0});
  if (!std::ranges::all_of(out, [](double x) { return std::abs(x) <= kMaxCoordinate; })) {
    from.fail(from.place.error("{}: coordinates must be at most {}", from.what(), kMaxCoordinate));
    return {};
  }
  return out;
}

/// +z of the emitter.
Point3d axis_of_emitter(const MitsubaObject& from, const Transform& to_scene) {
  const Point3d out = map_vector(to_scene, {0, 0, 1});
  if (!(length(out) > 1e-30 && length(out) < 1e30)) {
    from.fail(from.place.error("{}: the direction must not be zero", from.what()));
    return {0, 0, 1};
  }
  return normalize(out);
}

EnvironmentLight envmap_emitter(const MitsubaObject& from, FileSource& files, LoadedScene& loaded) {
  EnvironmentLight out;
  const auto scale = static_cast<float>(from.number("scale", 1, 0, 1e20));
  out.radiance = {scale, scale, scale};
  from.ignore({"mis_compensation"});
  out.rotation_degrees = -90;  // the centre of the image is at +z, where ours is at +x
  if (from.has("to_world")) {
    out.orientation = orientation_of(from.transform("to_world"));
    if (!out.orientation) {
      from.fail("to_world", "only a turned or mirrored image can be rendered");
    }
  }
  const std::string written = from.text("filename", "");
  Result<SourceFile> file = written.empty() ? Result<SourceFile>(not_found("no file is named")) : files(written);
  if (!file.ok()) {
    from.fail("filename", message_of(file.status()));
    return out;
  }
  out.file = utf8_text(file->name);
  out.asset =
      add_image(std::move(file->bytes), {.name = out.file, .place = from.place.text(), .environment = true}, loaded);
  out.has_image = true;
  return out;
}

SpotLight spot_emitter(const MitsubaObject& from, const Transform& to_scene, MitsubaTextures& textures,
                       Notices& notices) {
  SpotLight out;
  out.position = origin_of_emitter(from, to_scene);
  out.direction = axis_of_emitter(from, to_scene);
  out.intensity = textures.plain_light(from, "intensity");
  out.cutoff_degrees = from.number("cutoff_angle", 20, kMinCutoffDegrees, 180);
  const double beam = from.number("beam_width", out.cutoff_degrees * 0.75, 0, 180);
  out.blend = std::clamp(1 - beam / out.cutoff_degrees, 0.0, 1.0);
  if (out.blend > 0) {
    notices.once("spots fall off smoothly between beam_width and cutoff_angle, not linearly");
  }
  return out;
}

}  // namespace

Result<Light> read_mitsuba_light(const MitsubaObject& from, MitsubaTextures& textures, FileSource& files,
                                 LoadedScene& loaded, Notices& notices) {
  Light out;
  out.name = scene_name(from.label());
  const Transform to_scene = from.transform("to_world");
  if (from.type == "point") {
    const Transform at = from.has("position") ? translation(from.point("position", {})) : to_scene;
    out.kind = PointLight{origin_of_emitter(from, at), textures.plain_light(from, "intensity")};
  } else if (from.type == "spot") {
    out.kind = spot_emitter(from, to_scene, textures, notices);
  } else if (from.type == "directional") {
    const Point3d given = from.point("direction", {0, 0, 1});
    const Transform along{{{0, 0, given[0], 0}, {0, 0, given[1], 0}, {0, 0, given[2], 0}}};
    out.kind = DirectionalLight{axis_of_emitter(from, from.has("direction") ? along : to_scene),
                                textures.plain_light(from, "irradiance")};
  } else if (from.type == "constant") {
    EnvironmentLight sky;
    sky.radiance = textures.plain_light(from, "radiance");
    out.kind = sky;
  } else if (from.type == "envmap") {
    out.kind = envmap_emitter(from, files, loaded);
  } else {
    return from.place.error("emitters of the type \"{}\" cannot be rendered{}", from.type,
                            from.type == "area" ? " outside of a shape" : "");
  }
  for (const std::string_view other : {"position", "direction"}) {
    if (from.has(other) && from.has("to_world")) {
      from.fail(other, "cannot be given together with to_world");
    }
  }
  LM_RETURN_IF_ERROR(from.finish(loaded.faults));
  return out;
}

}  // namespace lightmill
