#include "common/scene_io/scene_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "common/math/vec.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/mesh.h"

namespace lightmill {
namespace {

constexpr int kPoints = 256;
constexpr double kMinShare = 0.01;  ///< of the irradiance under a white sky

bool emits(const Light& light) {
  return std::visit(Overloaded{[](const PointLight& l) { return !is_black(l.intensity); },
                               [](const DirectionalLight& l) { return !is_black(l.irradiance); },
                               [](const SpotLight& l) { return !is_black(l.intensity); },
                               [](const CosinePowerLight& l) { return !is_black(l.intensity); },
                               [](const DiskLight& l) { return !is_black(l.radiance); },
                               [](const IesLight& l) { return l.scale > 0; },
                               [](const EnvironmentLight& l) { return !is_black(l.radiance); }},
                    light.kind);
}

bool emits_evenly(const Material& material) {
  return !is_black(material.emission) && material.emission.texture == kNoTexture;
}

bool can_be_lit(const Material& material) {
  const auto* const diffuse = std::get_if<DiffuseMaterial>(&material.kind);
  return !emits_evenly(material) && !(diffuse != nullptr && is_black(diffuse->reflectance));
}

double radiance(const Material& material) {
  const RgbColor& c = material.emission.rgb;
  return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
}

using Corners = std::array<Vec3d, 3>;
Corners corners_of(const Mesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {to_vec(mesh.positions[a]), to_vec(mesh.positions[b]), to_vec(mesh.positions[c])};
}
/// Twice the area, along the normal.
Vec3d area_vector(const Corners& p) {
  return glm::cross(p[1] - p[0], p[2] - p[0]);
}

/// A point on a surface.
struct SurfacePoint {
  Vec3d position{0}, normal{0};
  double weight = 0;  ///< the weight of all surfaces, by the number of points
  const Material* material = nullptr;
};

/// Chooses points on the objects of a scene.
class Surfaces {
 public:
  explicit Surfaces(const LoadedScene& loaded) : loaded_(loaded) {
    for (const Object& object : loaded.scene.objects) {
      const auto [found, added] = areas_.try_emplace(asset_of(object));
      if (added) {
        const Mesh mesh = mesh_of(found->first);
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
          found->second += glm::length(area_vector(corners_of(mesh, i)));
        }
      }
    }
  }

  /// Points on the objects with a positive weight per area, in proportion to it. The areas of objects that are scaled
  /// differently along their axes are approximations.
  template <class Weight>
  std::vector<SurfacePoint> points(const Weight& weight_per_area) const {
    std::vector<double> until;  // the weight of all objects so far
    double total = 0;
    for (const Object& object : loaded_.scene.objects) {
      const double scale = std::cbrt(std::abs(Affine(object.transform).determinant()));
      total += weight_per_area(material_of(object)) * areas_.at(asset_of(object)) / 2 * scale * scale;
      until.push_back(total);
    }
    std::vector<SurfacePoint> out;
    if (!(total > 0)) {
      return out;
    }
    std::map<Sha256, std::vector<Wanted>> wanted;
    for (int i = 0; i < kPoints; ++i) {
      const double at = total * (i + 0.5) / kPoints;
      const auto object = static_cast<std::size_t>(std::ranges::upper_bound(until, at) - until.begin());
      const double before = object == 0 ? 0 : until[object - 1];
      wanted[asset_of(loaded_.scene.objects[object])].push_back({(at - before) / (until[object] - before), object, i});
    }
    for (auto& [asset, list] : wanted) {
      add_points(asset, list, total / kPoints, out);
    }
    return out;
  }

 private:
  /// A point on the part of an object's area that begins after this share of it.
  struct Wanted {
    double share;
    std::size_t object;
    int index;
  };

  static const Sha256& asset_of(const Object& object) { return std::get<MeshShape>(object.shape).asset; }
  const Material& material_of(const Object& object) const { return loaded_.scene.materials[object.material]; }
  Mesh mesh_of(const Sha256& asset) const {
    Result<Mesh> mesh = decode_mesh(as_byte_view(loaded_.assets.at(asset)));
    LM_CHECK(mesh.ok(), "{}", message_of(mesh.status()));
    return *std::move(mesh);
  }

  void add_points(const Sha256& asset, std::vector<Wanted>& list, double weight, std::vector<SurfacePoint>& out) const {
    std::ranges::sort(list, {}, &Wanted::share);
    const Mesh mesh = mesh_of(asset);
    std::size_t triangle = 0;
    double until = glm::length(area_vector(corners_of(mesh, 0)));
    for (const Wanted& one : list) {
      while (until <= one.share * areas_.at(asset) && triangle + 1 < mesh.triangles.size()) {
        until += glm::length(area_vector(corners_of(mesh, ++triangle)));
      }
      const Object& object = loaded_.scene.objects[one.object];
      const Affine map(object.transform);
      Corners p = corners_of(mesh, triangle);
      for (Vec3d& corner : p) {
        corner = map(corner);
      }
      // The R2 sequence (Roberts 2018), folded into the triangle.
      double u = std::fmod(0.7548776662466927 * (one.index + 1), 1),
             v = std::fmod(0.5698402909980532 * (one.index + 1), 1);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      const Vec3d normal = area_vector(p) * (map.mirrors() ? -1.0 : 1.0);
      if (const double length = glm::length(normal); length > 0) {
        out.push_back({p[0] + u * (p[1] - p[0]) + v * (p[2] - p[0]), normal / length, weight, &material_of(object)});
      }
    }
  }

  const LoadedScene& loaded_;
  std::map<Sha256, double> areas_;  ///< twice the area of each mesh
};

}  // namespace

bool emits_light(const Scene& scene) {
  return std::ranges::any_of(scene.lights, [](const Light& light) { return emits(light); }) ||
         std::ranges::any_of(
             scene.objects, [&](const Object& object) { return !is_black(scene.materials[object.material].emission); });
}

bool is_lit(const LoadedScene& loaded) {
  if (std::ranges::any_of(loaded.scene.lights, [](const Light& light) { return emits(light); })) {
    return true;
  }
  if (!emits_light(loaded.scene)) {
    return false;
  }
  const Surfaces surfaces(loaded);
  const std::vector<SurfacePoint> lit = surfaces.points([](const Material& m) { return can_be_lit(m) ? 1.0 : 0.0; });
  const std::vector<SurfacePoint> emitters =
      surfaces.points([](const Material& m) { return emits_evenly(m) ? radiance(m) : 0.0; });
  double sum = 0;  // of irradiance / pi
  for (const SurfacePoint& from : emitters) {
    const double area = from.weight / radiance(*from.material);
    for (const SurfacePoint& to : lit) {
      const Vec3d way = to.position - from.position;
      const double square = glm::dot(way, way);
      const double leaves = glm::dot(from.normal, way), arrives = -glm::dot(to.normal, way);
      // Light does not leave the back of one surface for the back of another one.
      if (square > 0 && (leaves > 0 || (from.material->two_sided_emission && arrives > 0))) {
        // The form factor of a disc on its axis, times both cosines.
        sum += from.weight * std::abs(leaves * arrives) / square / (std::numbers::pi * square + area);
      }
    }
  }
  return lit.empty() || sum >= kMinShare * static_cast<double>(lit.size());
}

}  // namespace lightmill
