#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/check.h"
#include "common/math/transcendental.h"
#include "common/scene/casters.h"
#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/learn_light_visibility.h"
#include "common/scene/compiled/light_builder.h"
#include "common/scene/compiled/mesh_sources.h"
#include "common/scene/compiled/scene_images.h"
#include "common/scene/compiled/world_frame.h"
#include "common/scene/validate/validate.h"

namespace lightmill {
namespace {

CameraBasis camera_basis(const Camera& camera, const FilmSettings& film, const WorldFrame& frame) {
  const Vec3d forward = glm::normalize(near_one(to_vec(camera.look_at) - to_vec(camera.eye)));
  const Vec3d right = glm::normalize(glm::cross(forward, near_one(to_vec(camera.up))));
  const Vec3d down = glm::cross(forward, right);
  const double half_height = tan_fixed(camera.vertical_fov_degrees * kPiDouble / 360.0);
  const double pixel = 2.0 * half_height / film.height;
  CameraBasis basis{Vec3(frame.to_frame(to_vec(camera.eye))),
                    Vec3(forward),
                    Vec3(right * pixel),
                    Vec3(down * pixel),
                    static_cast<float>(pixel),
                    static_cast<float>(0.5 * film.width - camera.shift_x * film.height),
                    static_cast<float>(0.5 * film.height + camera.shift_y * film.height)};
  if (camera.lens_radius > 0) {
    const double focus =
        camera.focus_distance > 0 ? camera.focus_distance : glm::length(to_vec(camera.look_at) - to_vec(camera.eye));
    basis.has_lens = true;
    basis.lens_x = Vec3(right * (camera.lens_radius * frame.scale()));
    basis.lens_y = Vec3(down * (camera.lens_radius * frame.scale()));
    basis.focus = static_cast<float>(focus * frame.scale());
  }
  return basis;
}

FilterTable filter_table(const PixelFilter& filter) {
  const double radius = filter.radius_pixels;
  switch (filter.kind) {
    case FilterKind::box:
      return FilterTable(radius, [](double) { return 1.0; });
    case FilterKind::tent:
      return FilterTable(radius, [=](double x) { return 1.0 - x / radius; });
    case FilterKind::gaussian:
      return FilterTable(radius, [=](double x) { return exp_fixed(-4.5 * (x / radius) * (x / radius)); });
    case FilterKind::blackman_harris:
      // Harris 1978, four-term window of −92 dB, centred.
      return FilterTable(radius, [=](double x) {
        const double t = kPiDouble * (x / radius + 1.0);
        return 0.35875 - 0.48829 * cos_fixed(t) + 0.14128 * cos_fixed(2 * t) - 0.01168 * cos_fixed(3 * t);
      });
  }
  LM_CHECK(false, "unknown filter kind");
}

}  // namespace

/// Builder of a CompiledScene. Owns the data that is needed only during the build.
class SceneCompiler {
 public:
  explicit SceneCompiler(const Scene& scene) : scene_(scene), out_(new CompiledScene()) {}

  Result<std::shared_ptr<const CompiledScene>> run(const CompiledScene::AssetSource& assets,
                                                   const CompiledScene::ImageDecoder& images,
                                                   const CompiledScene::Options& options) {
    LM_RETURN_IF_ERROR(validate(scene_));
    LM_ASSIGN_OR_RETURN(meshes_, load_meshes(scene_, assets, options.max_triangles));
    find_bounds();
    ImageBudget budget(options.max_texture_bytes);
    LM_ASSIGN_OR_RETURN(TextureSet textures, load_textures(scene_, assets, images, budget));
    const std::uint64_t texture_bytes = textures.bytes();
    out_->light_groups_ = light_groups_of(scene_);
    out_->accel_ = std::make_unique<Accel>(options.brute_force   ? Accel::Kind::brute_force
                                           : needs_robust_rays() ? Accel::Kind::robust
                                                                 : Accel::Kind::fast);
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      compile_object(i);
    }
    LM_RETURN_IF_ERROR(light_builder_.add_lights(assets, images, budget, options.max_ies_values));
    finish_lights(std::move(textures));
    LM_RETURN_IF_ERROR(out_->accel_->commit());
    out_->frame_ = frame_;
    out_->meters_ = compile_meters(scene_, meshes_, maps_, bounds_, frame_);
    out_->camera_ = camera_basis(scene_.camera, scene_.film, frame_);
    if (needs_media(scene_, bounds_)) {
      out_->features_.media = true;
      out_->media_ = MediumTable(scene_, frame_.scale());
      out_->camera_media_ = out_->media_at(out_->camera_.position, out_->camera_.forward);
      for (CompiledMeter& meter : out_->meters_) {
        meter.media = out_->media_at(meter.middle(), meter.direction);
      }
    }
    out_->caustic_targets_ = caustic_targets();
    out_->film_width_ = scene_.film.width;
    out_->film_height_ = scene_.film.height;
    // Light crosses media and sheets, which shadow rays alone do not show.
    if (out_->lights_.needs_choice() && !out_->features_.media && std::ranges::none_of(scene_.materials, is_sheet)) {
      out_->lights_.set_visibility(learn_light_visibility(*out_));
    }
    out_->filter_ = std::make_unique<FilterTable>(filter_table(scene_.film.filter));
    out_->bytes_ = texture_bytes + meshes_.triangles_held * 190 + out_->geometry_.bytes() + out_->lights_.bytes() +
                   out_->emitter_points_.bytes() + out_->emitters_.bytes() + 65536;
    return std::shared_ptr<const CompiledScene>(std::move(out_));
  }

 private:
  void find_bounds() {
    Bounds scene;
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      Bounds& bounds = bounds_.emplace_back();
      const Affine& map = maps_.emplace_back(scene_.objects[i].transform);
      if (const auto* sphere = std::get_if<SphereShape>(&scene_.objects[i].shape)) {
        const Vec3d radius(sphere->radius * map.similarity_scale());
        bounds.add(map(to_vec(sphere->center)) - radius);
        bounds.add(map(to_vec(sphere->center)) + radius);
      } else if (const auto* plane = std::get_if<PlaneShape>(&scene_.objects[i].shape)) {
        bounds.add(map(to_vec(plane->point)));
      } else {
        bounds = meshes_.instanced[i] ? bounds_of(box_of(*meshes_.of_object[i]), map)
                                      : bounds_of(*meshes_.of_object[i], map);
      }
      scene.add(bounds.low);
      scene.add(bounds.high);
      if (tangent_use(scene_.objects[i].material).any()) {
        meshes_with_tangents_.insert(meshes_.of_object[i]);
      }
    }
    frame_ = WorldFrame(scene);
  }

  BoundingSphere sphere_around(const Bounds& bounds) const {
    return {frame_.to_frame((bounds.low + bounds.high) * 0.5), glm::length(bounds.size()) * 0.5 * frame_.scale()};
  }

  CausticTargets caustic_targets() const {
    CausticTargets targets;
    Bounds all;
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      const Object& object = scene_.objects[i];
      BoundingSphere around = sphere_around(bounds_[i]);
      all.add(bounds_[i].low);
      all.add(bounds_[i].high);
      if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
        around.radius = sphere->radius * maps_[i].similarity_scale() * frame_.scale();
      } else if (const auto* plane = std::get_if<PlaneShape>(&object.shape)) {
        const Vec3d normal = maps_[i].normal_matrix() * near_one(to_vec(plane->normal));
        targets.planes.push_back({around.center, glm::normalize(near_one(normal))});
        around.radius = std::numeric_limits<double>::infinity();
      }
      if (const Material& material = scene_.materials[object.material]; is_caster(material)) {
        targets.casters.push_back(around);
        targets.lobes.push_back(caster_lobes(material));
      }
    }
    all.add(to_vec(scene_.camera.eye));
    for (const Meter& meter : scene_.meters) {
      add_meter(meter, all);
    }
    targets.scene = sphere_around(all);
    return targets;
  }

  static void add_meter(const Meter& meter, Bounds& bounds) {
    if (const Patch* patch = patch_of(meter)) {
      const Vec3d corner = to_vec(patch->corner), edge1 = to_vec(patch->edge1), edge2 = to_vec(patch->edge2);
      for (const Vec3d& p : {corner, corner + edge1, corner + edge2, corner + edge1 + edge2}) {
        bounds.add(p);
      }
    } else if (const auto* point = std::get_if<IrradianceMeter>(&meter.kind)) {
      bounds.add(to_vec(point->point));
    } else {
      bounds.add(to_vec(std::get<RadianceMeter>(meter.kind).point));
    }
  }

  /// The mesh's bounds in its own coordinates. Each is computed once.
  const Bounds& box_of(const Mesh& mesh) {
    const auto [found, added] = boxes_.try_emplace(&mesh);
    if (added) {
      found->second = bounds_of(mesh, Affine());
    }
    return found->second;
  }

  /// Fast rays miss the edge between two triangles about once in 10^7, which shows with many triangles. They are also
  /// inexact if coordinates are much larger than the geometry. Such scenes need the slower, exact rays.
  bool needs_robust_rays() const {
    double smallest = frame_.extent();
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      if (!std::holds_alternative<PlaneShape>(scene_.objects[i].shape)) {
        smallest = std::min(smallest, glm::length(bounds_[i].size()));
      }
    }
    return meshes_.triangles_seen > 1000 || frame_.extent() > 1e3 * smallest;
  }

  void compile_object(std::size_t i) {
    const Object& object = scene_.objects[i];
    if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
      compile_sphere(i, *sphere, maps_[i]);
    } else if (const auto* plane = std::get_if<PlaneShape>(&object.shape)) {
      compile_plane(object, *plane, maps_[i]);
    } else if (meshes_.instanced[i]) {
      compile_instance(i);
    } else {
      const Mesh& mesh = *meshes_.of_object[i];
      compile_mesh(i, maps_[i].identity ? mesh : transformed(mesh, maps_[i]));
    }
  }

  /// Whether next-event estimation samples the object. Emissive planes, spheres with an emission texture, and surfaces
  /// whose opacity varies, are found only by scattered rays.
  bool is_sampled(std::size_t i) const {
    const Object& object = scene_.objects[i];
    const Material& material = scene_.materials[object.material];
    const TexturedColor& emission = material.emission;
    return !is_black(emission) && !std::holds_alternative<PlaneShape>(object.shape) && opacity_of(i).value_or(0) > 0 &&
           (emission.texture == kNoTexture || !std::holds_alternative<SphereShape>(object.shape));
  }

  /// The opacity of an object. Nothing if it varies over the surface.
  std::optional<double> opacity_of(std::size_t i) const {
    const Opacity& opacity = scene_.materials[scene_.objects[i].material].opacity;
    const bool varies = opacity.mode != Opacity::Mode::opaque && meshes_.of_object[i] != nullptr &&
                        std::ranges::any_of(meshes_.of_object[i]->colors, [](const auto& c) { return c[3] < 1; });
    return varies ? std::nullopt : uniform_opacity(opacity);
  }

  TangentUse tangent_use(std::uint32_t material) const {
    return {has_mapped_normals(scene_.materials[material]), is_anisotropic(scene_.materials[material])};
  }

  void compile_sphere(std::size_t i, const SphereShape& sphere, const Affine& map) {
    const Object& object = scene_.objects[i];
    const Vec3 center(frame_.to_frame(map(to_vec(sphere.center))));
    const auto radius = static_cast<float>(sphere.radius * map.similarity_scale() * frame_.scale());
    out_->geometry_.add_sphere(object.material, center, radius, sphere.normal_inward);
    out_->accel_->add_sphere(center, radius);
    light_builder_.add_sphere(object.material, center, radius, sphere.normal_inward, is_sampled(i));
  }

  void compile_plane(const Object& object, const PlaneShape& plane, const Affine& map) {
    const Vec3 point(frame_.to_frame(map(to_vec(plane.point))));
    const Vec3d normal = glm::normalize(near_one(map.normal_matrix() * near_one(to_vec(plane.normal))));
    out_->geometry_.add_plane(object.material, point, static_cast<float>(1 / frame_.scale()), !scene_.textures.empty(),
                              tangent_use(object.material));
    out_->accel_->add_plane(point, Vec3(normal));
    light_builder_.add_other();
  }

  std::vector<std::array<float, 3>> frame_positions(const Mesh& mesh) const {
    std::vector<std::array<float, 3>> positions;
    positions.reserve(mesh.positions.size());
    for (const auto& p : mesh.positions) {
      const Vec3 q(frame_.to_frame({p[0], p[1], p[2]}));
      positions.push_back({q.x, q.y, q.z});
    }
    return positions;
  }

  void compile_mesh(std::size_t i, const Mesh& mesh) {
    const std::uint32_t material = scene_.objects[i].material;
    const std::vector<std::array<float, 3>> positions = frame_positions(mesh);
    out_->accel_->add_mesh(positions, mesh.triangles);
    const TangentUse use = tangent_use(material);
    out_->geometry_.add_mesh(material, out_->geometry_.add_rows(mesh, positions, !scene_.textures.empty(), use.any()),
                             use);
    light_builder_.add_mesh(material, positions, mesh, is_sampled(i));
  }

  /// A mesh in coordinates of its own, recentred and with an extent near 1, and its rows.
  struct Prototype {
    std::uint32_t number = 0;
    GeometryTable::MeshRows rows;
    Vec3d center{0};
    double scale = 1;  ///< from units of its asset to its own
  };

  const Prototype& prototype(std::size_t i) {
    const Mesh& mesh = *meshes_.of_object[i];
    const auto [found, added] = prototypes_.try_emplace(&mesh);
    Prototype& p = found->second;
    if (added) {
      const Bounds& bounds = box_of(mesh);
      p.center = (bounds.low + bounds.high) * 0.5;
      const double extent = glm::length(bounds.size());
      p.scale = extent > 0 ? std::ldexp(1.0, -std::ilogb(extent)) : 1.0;
      std::vector<std::array<float, 3>> positions;
      positions.reserve(mesh.positions.size());
      for (const auto& q : mesh.positions) {
        const Vec3 local((Vec3d(q[0], q[1], q[2]) - p.center) * p.scale);
        positions.push_back({local.x, local.y, local.z});
      }
      p.number = out_->accel_->add_prototype(positions, mesh.triangles);
      p.rows = out_->geometry_.add_rows(mesh, positions, !scene_.textures.empty(),
                                        meshes_with_tangents_.contains(meshes_.of_object[i]));
    }
    return p;
  }

  void compile_instance(std::size_t i) {
    const Prototype& p = prototype(i);
    const glm::dmat3 linear = maps_[i].linear * (frame_.scale() / p.scale);
    const Vec3d origin = frame_.to_frame(maps_[i](p.center));
    glm::dmat3 normal = maps_[i].normal_matrix();
    const double largest = std::max({glm::length(normal[0]), glm::length(normal[1]), glm::length(normal[2])});
    normal *= 1 / largest;
    std::array<std::array<float, 4>, 3> rows{};
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        rows[row][column] = static_cast<float>(linear[column][row]);
      }
      rows[row][3] = static_cast<float>(origin[row]);
    }
    out_->accel_->add_instance(p.number, rows);
    const std::uint32_t material = scene_.objects[i].material;
    const TangentUse use = tangent_use(material);
    out_->geometry_.add_instance(material, use.any() ? p.rows : p.rows.without_tangents(), use, glm::mat3(linear),
                                 glm::mat3(normal));
    light_builder_.add_other();
  }

  void finish_lights(TextureSet textures) {
    LightBuilder::Tables tables = light_builder_.finish(textures);
    out_->lights_ = std::move(tables.lights);
    out_->emitter_points_ = std::move(tables.emitter_points);
    out_->emitters_ = std::move(tables.emitters);
    out_->environment_group_ = tables.environment_group;
    const MaterialRows rows = material_rows(scene_);
    out_->materials_ = MaterialTable(scene_, rows, std::move(textures), tables.radiance, out_->geometry_.has_colors());
    out_->normal_maps_ = NormalMaps(scene_, rows, frame_.scale());
    out_->anisotropy_directions_ = AnisotropyDirections(rows);
    out_->features_.mixtures = out_->materials_.has_mixtures();
    out_->features_.footprints = out_->materials_.textures().has_pyramids();
    out_->features_.environment = out_->lights_.environment.exists();
    out_->features_.shadow_catchers = out_->materials_.uses(MaterialKind::shadow_catcher);
    if (out_->features_.shadow_catchers) {
      out_->unoccluded_ = UnoccludedIrradiance(out_->lights_);
    }
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      const Material& material = scene_.materials[scene_.objects[i].material];
      out_->features_.normal_maps |= has_mapped_normals(material);
      out_->features_.emissive_surfaces |= !is_black(material.emission);
      out_->features_.opacity |= opacity_of(i) != 1;
    }
  }

  const Scene& scene_;
  std::unique_ptr<CompiledScene> out_;
  ObjectMeshes meshes_;
  std::vector<Bounds> bounds_;                                  ///< one an object, in scene units
  std::vector<Affine> maps_;                                    ///< one an object
  std::set<std::shared_ptr<const Mesh>> meshes_with_tangents_;  ///< of materials that use them
  std::map<const Mesh*, Bounds> boxes_;
  std::map<const Mesh*, Prototype> prototypes_;
  WorldFrame frame_;
  LightBuilder light_builder_{scene_, frame_};
};

Result<std::shared_ptr<const CompiledScene>> CompiledScene::compile(const Scene& scene, const AssetSource& assets,
                                                                    const ImageDecoder& images,
                                                                    const Options& options) {
  return SceneCompiler(scene).run(assets, images, options);
}

}  // namespace lightmill
