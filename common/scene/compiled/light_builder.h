// The builder of a scene's light table, from its lights and its emissive shapes.
#pragma once

#include <array>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "common/image/texels.h"
#include "common/lights/emitter_points.h"
#include "common/lights/light_table.h"
#include "common/scene/compiled/emitter_table.h"
#include "common/scene/compiled/scene_images.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"
#include "common/scene/mesh.h"

namespace lightmill {

/// Takes geometries in the order of Accel's indices, then the scene's lights. Then it returns the tables.
class LightBuilder {
 public:
  LightBuilder(const Scene& scene, const WorldFrame& frame)
      : scene_(scene), frame_(frame), group_names_(light_groups_of(scene)) {}

  // One call per geometry. Geometries that are not `sampled` are only counted: they do not emit, or only rays find
  // them.
  void add_sphere(std::uint32_t material, const Vec3& center, float radius, bool inward, bool sampled);
  /// `positions` are the mesh's, in the frame.
  void add_mesh(std::uint32_t material, const std::vector<std::array<float, 3>>& positions, const Mesh& mesh,
                bool sampled);
  void add_other();

  /// Adds the scene's lights, after the geometries. Errors name them. Also fails if a power has no surface.
  /// `max_ies_values` is for all profiles together.
  Status add_lights(const CompiledScene::AssetSource& assets, const CompiledScene::ImageDecoder& images,
                    ImageBudget& budget, std::size_t max_ies_values);

  struct Tables {
    LightTable lights;
    EmitterPoints emitter_points;
    EmitterTable emitters;
    std::uint32_t environment_group = 0;
    std::vector<Vec3> radiance;  ///< of each material, along the normal; zero if it does not emit
  };
  /// `textures` are the scene's.
  Tables finish(const TextureSet& textures);

 private:
  /// The facets or the sphere of a geometry's primitives. None if it is not sampled.
  struct Geometry {
    bool sphere = false;
    bool repeated = false;  ///< a sphere in the place of an earlier one
    std::vector<std::uint32_t> primitives;
    std::size_t first_facet = 0, end_facet = 0;
  };
  void note_group(LightKind kind, const std::string& group, bool hidden = false);
  void add_light(const Light& light);
  void add_disk(const DiskLight& disk, const Light& light);
  Status add_ies(const IesLight& light, const std::string& group, const std::string& where,
                 const CompiledScene::AssetSource& assets, std::size_t max_values);
  Status add_image(const EnvironmentLight& light, const std::string& group, const std::string& where,
                   const CompiledScene::AssetSource& assets, const CompiledScene::ImageDecoder& images,
                   ImageBudget& budget);
  Status check_areas() const;
  FacetSums sums_of(const Geometry& geometry) const;
  EmitterPoints emitter_points() const;
  Vec3 to_frame(const Point3d& p) const;
  float sphere_radius(double radius) const;
  std::vector<Vec3> radiance_of_materials() const;

  const Scene& scene_;
  const WorldFrame& frame_;
  LightTable lights_;
  std::vector<std::string> group_names_;
  std::map<LightKind, std::vector<std::uint32_t>> groups_;  ///< of the lights of each kind, in their order
  std::vector<std::pair<LightKind, std::size_t>> hidden_;   ///< from the camera: kind, and number within the kind
  std::map<Sha256, std::size_t> profiles_;
  std::map<std::uint32_t, double> area_;  ///< by material: area of all emissive surfaces, in scene units

  // Emissive shapes without their radiance, which may depend on the total area. If several are in one place, the first
  // is the light: rays see no more brightness there.
  struct Facet {
    std::uint32_t material;
    EmissiveFacet shape;
  };
  struct Sphere {
    std::uint32_t material;
    EmissiveSphere shape;
  };
  std::vector<Facet> facets_;
  std::vector<Sphere> spheres_;
  struct Place {
    std::uint32_t number = 0;           ///< of the facet or sphere in this place
    std::set<std::uint32_t> materials;  ///< of all shapes in this place
  };
  bool stand_at(Place& place, std::size_t number, std::uint32_t material, double area);
  std::map<std::array<float, 12>, Place> facet_places_;  ///< by corners
  std::map<std::tuple<float, float, float, float, bool>, Place> sphere_places_;
  std::vector<bool> closed_parts_;  ///< by EmissiveFacet::part
  std::vector<Geometry> geometries_;
};

}  // namespace lightmill
