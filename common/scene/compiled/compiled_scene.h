// A scene that is ready to be rendered: recentred, indexed, and rescaled if it is very large or small. It has only the
// features of the scene. Immutable and thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "common/geometry/ray.h"
#include "common/lights/emitter_points.h"
#include "common/lights/light_table.h"
#include "common/lights/photon_targets.h"
#include "common/lights/unoccluded_irradiance.h"
#include "common/math/vec.h"
#include "common/sampling/filter_table.h"
#include "common/scene/accel/accel.h"
#include "common/scene/casters.h"
#include "common/scene/compiled/anisotropy_directions.h"
#include "common/scene/compiled/emitter_table.h"
#include "common/scene/compiled/geometry_table.h"
#include "common/scene/compiled/material_table.h"
#include "common/scene/compiled/medium_table.h"
#include "common/scene/compiled/meter_table.h"
#include "common/scene/compiled/normal_maps.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/document.h"

namespace lightmill {

/// The camera's basis. The camera ray through film position (x, y) in pixels has the direction forward + right · (x −
/// center_x) + down · (y − center_y).
struct CameraBasis {
  Vec3 position;             ///< in the recentred frame
  Vec3 forward;              ///< unit
  Vec3 right;                ///< one pixel to the right on the plane at distance 1
  Vec3 down;                 ///< one pixel down
  float pixel;               ///< length of `right`
  float center_x, center_y;  ///< film position of `forward`, in pixels
  // Thin lens:
  Vec3 lens_x{0}, lens_y{0};  ///< from its centre to its edge; zero for a pinhole
  float focus = 1;            ///< distance in focus, along `forward`
  bool has_lens = false;

  /// Rays through film positions x, y, in pixels of the full film, from a pinhole. (0,0) is the upper left corner.
  Ray8 rays(F8 x, F8 y) const {
    const F8 dx = x - F8(center_x), dy = y - F8(center_y);
    const V8 direction = broadcast(forward) + broadcast(right) * dx + broadcast(down) * dy;
    return {broadcast(position), normalize(direction), F8(std::numeric_limits<float>::infinity())};
  }
};

/// Features of the scene. Methods skip what is missing.
struct SceneFeatures {
  bool emissive_surfaces = false;
  bool environment = false;  ///< rays that leave the scene find light
  bool media = false;        ///< paths must know which media they are in
  bool shadow_catchers = false;
  bool opacity = false;      ///< surfaces that rays may pass
  bool normal_maps = false;  ///< some material has a normal map or bump map
  bool mixtures = false;     ///< surfaces need a number that draws a part of their mixture
  bool footprints = false;   ///< some texture averages over footprints
};

/// The places that photons must reach to find all caustics, in the frame.
struct CausticTargets {
  std::vector<BoundingSphere> casters;         ///< around each object with a caster material
  std::vector<std::vector<CasterLobe>> lobes;  ///< of each caster
  std::vector<InfinitePlane> planes;           ///< all planes of the scene
  BoundingSphere scene;                        ///< around all bounded shapes, the camera position and the meters
};

/// Indices of the nine floats of a triangle stay below 2^31, as eight-lane gathers need.
inline constexpr std::uint64_t kMaxSceneTriangles = 200'000'000;

class CompiledScene {
 public:
  /// Returns the encoded bytes of an asset.
  using AssetSource = std::function<Result<std::string>(const Sha256&)>;

  /// Decodes an image file (common/image/read, which few programs link): its bytes and its name.
  using ImageDecoder = std::function<Result<Texels>(ByteView bytes, const std::string& name)>;

  struct Options {
    bool brute_force = false;                          ///< trace rays without a hierarchy
    std::uint64_t max_triangles = kMaxSceneTriangles;  ///< limit of triangles held; instances of a mesh count once
    /// Limit of all decoded images of textures and the environment together. The environment counts with the most
    /// memory that its preparation takes.
    std::uint64_t max_texture_bytes = std::uint64_t{8} << 30;
    /// Limit of the values of all IES profiles, with their symmetries. Below 2^31.
    std::size_t max_ies_values = std::size_t{1} << 26;
  };

  /// Compiles a valid document. Fails if an asset is missing or damaged. Errors name the object. A scene with images
  /// needs a decoder.
  static Result<std::shared_ptr<const CompiledScene>> compile(const Scene& scene, const AssetSource& assets,
                                                              const ImageDecoder& images, const Options& options);
  static Result<std::shared_ptr<const CompiledScene>> compile(const Scene& scene, const AssetSource& assets,
                                                              const ImageDecoder& images = nullptr) {
    return compile(scene, assets, images, Options());
  }

  const Accel& accel() const { return *accel_; }
  const LightTable& lights() const { return lights_; }
  /// The emissive objects that next-event estimation samples, as points.
  const EmitterPoints& emitter_points() const { return emitter_points_; }
  const MaterialTable& materials() const { return materials_; }
  const MediumTable& media() const { return media_; }
  /// The media around the camera.
  const Media8& camera_media() const { return camera_media_; }
  /// The media around a point of the frame. They are the media that a ray from the point along `direction` leaves
  /// without having entered them.
  Media8 media_at(const Vec3& point, const Vec3& direction) const;
  const CameraBasis& camera() const { return camera_; }
  const WorldFrame& frame() const { return frame_; }
  const CausticTargets& caustic_targets() const { return caustic_targets_; }
  const MeterTable& meters() const { return meters_; }
  /// light_groups_of the document. Groups have the numbers from 1 in this order. 0 is none.
  const std::vector<std::string>& light_groups() const { return light_groups_; }
  /// The irradiance of shadow catchers without shadows, at points with these unit normals.
  V8 unoccluded_irradiance(const V8& p, const V8& n, M8 lanes) const { return unoccluded_.at(lights_, p, n, lanes); }
  std::uint32_t environment_group() const { return environment_group_; }
  const FilterTable& filter() const { return *filter_; }
  const SceneFeatures& features() const { return features_; }
  int film_width() const { return film_width_; }
  int film_height() const { return film_height_; }
  /// Approximate size in memory.
  std::uint64_t bytes() const { return bytes_; }

  /// Surfaces at the hits: unit normals, a point on the surface, the material. Ray directions must be unit vectors.
  /// `drawn_by`: in scenes with mixtures, a random number in [0, 1) that draws the part. Without it, surfaces have the
  /// material of their object, which has the emission, opacity and inside, but not always a BSDF.
  Surface8 surface(const Ray8& rays, const Hit8& hits, const std::optional<F8>& drawn_by = std::nullopt) const {
    Surface8 out = geometry_.surface(rays, hits);
    if (drawn_by) {
      out.material = materials_.drawn(out, hits.hit, *drawn_by);
    }
    if (out.mapped.any()) {
      normal_maps_.apply(geometry_, materials_.textures(), hits, out);
    }
    if (out.directed.any()) {
      anisotropy_directions_.find(geometry_, hits, out);
    }
    return out;
  }

  /// See GeometryTable.
  F8 coordinates_per_length(const Hit8& hits) const { return geometry_.coordinates_per_length(hits, hits.hit); }

  /// The hits that rays may pass, because of the surface's opacity.
  M8 may_pass(const Hit8& hits, M8 lanes) const {
    return materials_.may_pass(geometry_.material(hits.geometry, lanes), lanes);
  }

  /// The sampled light of each emissive hit.
  EmitterTable::Lights8 emitter(const Hit8& hits, M8 lanes) const {
    return emitters_.lookup(hits.geometry, hits.primitive, lanes);
  }

  /// The density per solid angle with which next-event estimation from `from` samples the point of this emissive hit. 0
  /// if it does not sample this surface.
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
  NormalMaps normal_maps_;
  AnisotropyDirections anisotropy_directions_;
  MediumTable media_;
  Media8 camera_media_;
  LightTable lights_;
  EmitterPoints emitter_points_;
  EmitterTable emitters_;
  UnoccludedIrradiance unoccluded_;
  CameraBasis camera_;
  WorldFrame frame_;
  CausticTargets caustic_targets_;
  MeterTable meters_;
  std::vector<std::string> light_groups_;
  std::uint32_t environment_group_ = 0;
  std::unique_ptr<FilterTable> filter_;
  SceneFeatures features_;
  int film_width_ = 0, film_height_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace lightmill
