#include "tests/atlas/cases/light_over_mirror.h"

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/light_scenes.h"

namespace lightmill::test {

AtlasCase LightOverMirror::made() const {
  const auto irradiance = [](const Vec3d& from, const Vec3d& at) {
    const Vec3d way = at - from;
    return kPiDouble * way.x / std::pow(glm::dot(way, way), 1.5);
  };
  const Vec3d image(0, -1, 0);
  const auto radiance = [&](const Vec3d& way) {
    const Vec3d met = view.eye + way * ((1 - view.eye.x) / way.x);
    const Vec3d at(met.x, std::abs(met.y), met.z);
    const double seen = met.y < 0 ? reflectance(-way.y / glm::length(way)) : 1.0;
    const double thrown =
        reflected(image, at) ? reflectance((at.y + 1) / glm::length(at - image)) * irradiance(image, at) : 0.0;
    return seen / kPiDouble * (irradiance({0, 1, 0}, at) + thrown);
  };
  const auto placed = [&](const Vec3d& p) {
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", p.x * scale + offset.x, p.y * scale + offset.y,
                       p.z * scale + offset.z);
  };
  std::string materials = diffuse("wall", 1) + also(named("mirror", mirror_material));
  std::string objects = plane_shape("wall", placed({1, 0, 0}), "[-1, 0, 0]") +
                        also(mirror.empty() ? plane_shape("mirror", placed({0, 0, 0}), "[0, 1, 0]") : mirror);
  std::string lights;
  if (radius > 0) {
    const std::string radiance = gray(1 / (radius * radius));
    materials += also(textured ? fmt::format(R"({{"name": "lamp", "diffuse": {{"reflectance": {}}},
                                      "emission": {{"texture": "white", {}}})",
                                             gray(0), radiance.substr(1))
                               : diffuse("lamp", 0, 1 / (radius * radius)));
    objects += also(sphere("lamp", placed({0, 1, 0}), radius * scale));
  } else {
    lights = fmt::format(R"({{"point": {{"position": {}, "intensity": {}}}}})", placed({0, 1, 0}),
                         gray(kPiDouble * scale * scale));
  }
  const AtlasView there{view.eye * scale + offset, view.look_at * scale + offset, view.fov_degrees, view.size};
  std::string text = document(there.text(), view.fov_degrees, view.size, materials, objects, lights);
  std::map<std::string, std::string> its = files;
  if (textured) {
    text.insert(text.find("\"materials\""), R"("textures": [{"name": "white", "file": "white.exr"}], )");
    its["white.exr"] = one_pixel(1, 1, 0, 0, 1, 1);
  }
  return {.subject = subject,
          .name = name,
          .document = text,
          .files = its,
          .exact = view.mean_of(radiance, steps),
          .tolerance = 1e-3,
          .gathered = 2e-3,
          .max_bounces = bounces};
}

}  // namespace lightmill::test
