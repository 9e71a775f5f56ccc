// A scene ready to be rendered: recentred (and rescaled where it is very large or small), indexed, with only the
// features that are there. Immutable and thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/geometry/ray.h"
#include "common/lights/hard_lights.h"
#include "common/lights/light_table.h"
#include "common/lights/photon_targets.h"
#include "common/lights/unoccluded_irradiance.h"
#include "common/math/vec.h"
#include "common/sampling/filter_table.h"
#include "common/scene/accel/accel.h"
#include "common/scene/casters.h"
#include "common/scene/compiled/emitter_table.h"
#include "common/scene/compiled/geometry_table.h"
#include "common/scene/compiled/material_table.h"
#include "common/scene/compiled/medium_table.h"
#include "common/scene/compiled/meter_table.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"

namespace lightmill {

/// The camera's basis: a primary ray through film position (x, y) in pixels has direction
/// forward + right · ((x − width/2)) + down · ((y − height/2)).
struct CameraBasis {
  Vec3 eye;      ///< in the recentred frame
  Vec3 forward;  ///< unit
  Vec3 right;    ///< one pixel to the right on the plane at distance 1
  Vec3 down;     ///< one pixel down
  // Of a thin lens.
  Vec3 lens_x{0}, lens_y{0};  ///< from its centre to its rim; zero for a pinhole
  float focus = 1;            ///< distance along `forward` of what is sharp
  bool has_lens = false;
};

/// What the scene has; methods skip what it lacks.
struct SceneFeatures {
  bool emissive_surfaces = false;
  bool lights = false;       ///< anything that next-event estimation can sample
  bool environment = false;  ///< light where rays leave the scene
  bool media = false;        ///< paths must know which media they are in
  bool holdouts = false;
};

/// What light must be followed towards to find all caustics, in the frame that is rendered in.
struct CausticPlaces {
  std::vector<BoundingSphere> casters;         ///< around each object whose material is a caster
  std::vector<std::vector<CasterLobe>> lobes;  ///< of each of these
  std::vector<BoundlessPlane> planes;          ///< all of the scene
  BoundingSphere scene;                        ///< around all bounded shapes, the eye and the meters
};

/// Indices of the nine floats of a triangle stay below 2^31, as eight-lane gathers need.
inline constexpr std::uint64_t kMaxSceneTriangles = 200'000'000;

class CompiledScene {
 public:
  /// Gives the encoded bytes of an asset.
  using AssetSource = std::function<Result<std::string>(const Sha256&)>;

  /// Decodes an image file (common/image/read, which few programs link): its bytes and its name.
  using ImageDecoder = std::function<Result<Texels>(ByteView bytes, const std::string& name)>;

  struct Options {
    bool brute_force = false;                          ///< trace rays without a hierarchy
    std::uint64_t max_triangles = kMaxSceneTriangles;  ///< that are held, at most this; instances of a mesh count once
    /// Of decoded images that textures and the environment name, all together; of the latter the most that is held
    /// while it is prepared.
    std::uint64_t max_texture_bytes = std::uint64_t{8} << 30;
    /// Of all IES profiles, with their symmetries; below 2^31.
    std::size_t max_ies_values = std::size_t{1} << 26;
  };

  /// Compiles a valid document. Fails when an asset is missing or damaged; errors name the object.
  /// A scene with images needs a decoder.
  static Result<std::shared_ptr<const CompiledScene>> compile(const Scene& scene, const AssetSource& assets,
                                                              const ImageDecoder& images, const Options& options);
  static Result<std::shared_ptr<const CompiledScene>> compile(const Scene& scene, const AssetSource& assets,
                                                              const ImageDecoder& images = nullptr) {
    return compile(scene, assets, images, Options());
  }

  const Accel& accel() const { return *accel_; }
  const LightTable& lights() const { return lights_; }
  /// The emissive objects that next-event estimation knows, as points.
  const HardLights& hard_lights() const { return hard_lights_; }
  const MaterialTable& materials() const { return materials_; }
  const MediumTable& media() const { return media_; }
  /// Those that the camera is in.
  const Media8& camera_media() const { return camera_media_; }
  /// Those that a point of the frame is in: a ray from it out of the scene leaves what it has not entered before.
  Media8 media_at(const Vec3& point, const Vec3& direction) const;
  const CameraBasis& camera() const { return camera_; }
  const WorldFrame& frame() const { return frame_; }
  const CausticPlaces& caustic_places() const { return caustic_places_; }
  const MeterTable& meters() const { return meters_; }
  /// light_groups_of the document: groups are numbered from 1 in this order, 0 is none.
  const std::vector<std::string>& light_groups() const { return light_groups_; }
  /// What holdouts would get without shadows, at points with these unit normals.
  V8 unoccluded_irradiance(const V8& p, const V8& n, M8 lanes) const { return unoccluded_.at(lights_, p, n, lanes); }
  std::uint32_t environment_group() const { return environment_group_; }
  const FilterTable& filter() const { return *filter_; }
  const SceneFeatures& features() const { return features_; }
  int film_width() const { return film_width_; }
  int film_height() const { return film_height_; }
  /// Rough size in memory.
  std::uint64_t bytes() const { return bytes_; }

  /// Completes hits: unit normals, a point on the surface, the material. Ray directions are unit vectors.
  Surface8 surface(const Ray8& rays, const Hit8& hits) const { return geometry_.surface(rays, hits); }

  /// Which of the lights that next-event estimation samples an emissive hit is.
  EmitterTable::Lights8 emitter(const Hit8& hits, M8 lanes) const {
    return emitters_.lookup(hits.geometry, hits.primitive, lanes);
  }

  /// With which density per solid angle next-event estimation from `from` would have found this hit of an emissive
  /// surface; 0 where it draws no such points.
  F8 light_pdf_solid_angle(const V8& from, const Hit8& hits, F8 cos_light, M8 lanes) const {
    const EmitterTable::Lights8 found = emitters_.lookup(hits.geometry, hits.primitive, lanes);
    return masked(found.sampled, lights_.pdf_solid_angle(from, found.light, hits.distance, cos_light, found.sampled));
  }

 private:
  friend class SceneCompiler;
  CompiledScene() = default;

  std::unique_ptr<Accel> accel_;
  GeometryTable geometry_;
  MaterialTable materials_;
  MediumTable media_;
  Media8 camera_media_;
  LightTable lights_;
  HardLights hard_lights_;
  EmitterTable emitters_;
  UnoccludedIrradiance unoccluded_;
  CameraBasis camera_;
  WorldFrame frame_;
  CausticPlaces caustic_places_;
  MeterTable meters_;
  std::vector<std::string> light_groups_;
  std::uint32_t environment_group_ = 0;
  std::unique_ptr<FilterTable> filter_;
  SceneFeatures features_;
  int film_width_ = 0, film_height_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace lightmill
