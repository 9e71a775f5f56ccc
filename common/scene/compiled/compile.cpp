#include <cmath>

#include "common/base/check.h"
#include "common/math/transcendental.h"
#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/world_frame.h"

namespace lightmill {
namespace {

/// Indices of the nine floats of a triangle stay below 2^31, as eight-lane gathers need.
constexpr std::uint64_t kMaxTriangles = 200'000'000;

/// v times the power of two that brings its largest component near 1, so that no square of it under- or overflows.
Vec3d near_one(const Vec3d& v) {
  const int exponent = std::ilogb(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
  return {std::scalbn(v.x, -exponent), std::scalbn(v.y, -exponent), std::scalbn(v.z, -exponent)};
}

CameraBasis camera_basis(const Camera& camera, int height, const Vec3d& eye) {
  const Vec3d forward = glm::normalize(near_one(to_vec(camera.look_at) - to_vec(camera.eye)));
  const Vec3d right = glm::normalize(glm::cross(forward, near_one(to_vec(camera.up))));
  const Vec3d down = glm::cross(forward, right);
  const double half_height = tan_fixed(camera.vertical_fov_degrees * kPiDouble / 360.0);
  const double pixel = 2.0 * half_height / height;
  return {Vec3(eye), Vec3(forward), Vec3(right * pixel), Vec3(down * pixel)};
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
      // Harris 1978, the four-term window of −92 dB, centred.
      return FilterTable(radius, [=](double x) {
        const double t = kPiDouble * (x / radius + 1.0);
        return 0.35875 - 0.48829 * cos_fixed(t) + 0.14128 * cos_fixed(2 * t) - 0.01168 * cos_fixed(3 * t);
      });
  }
  LM_CHECK(false, "unknown filter kind");
}

}  // namespace

/// Builds a CompiledScene step by step; owns what is only needed meanwhile.
class SceneCompiler {
 public:
  explicit SceneCompiler(const Scene& scene) : scene_(scene), out_(new CompiledScene()) {}

  Result<std::shared_ptr<const CompiledScene>> run(const CompiledScene::AssetSource& assets) {
    LM_RETURN_IF_ERROR(validate(scene_));
    LM_RETURN_IF_ERROR(load_meshes(assets));
    find_bounds();
    out_->materials_ = MaterialTable(scene_);
    out_->accel_ = std::make_unique<Accel>(needs_robust_rays());
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      compile_object(scene_.objects[i], meshes_[i].get());
    }
    for (const PointLight& light : scene_.point_lights) {
      if (!is_black(light.intensity)) {
        out_->lights_.add(PointEmitter{Vec3(frame_.to_frame(to_vec(light.position))),
                                       frame_.scaled_intensity(to_vec(light.intensity))});
      }
    }
    finish_lights();
    LM_RETURN_IF_ERROR(out_->accel_->commit());
    out_->frame_ = frame_;
    out_->camera_ = camera_basis(scene_.camera, scene_.film.height, frame_.to_frame(to_vec(scene_.camera.eye)));
    out_->filter_ = std::make_unique<FilterTable>(filter_table(scene_.film.filter));
    out_->film_width_ = scene_.film.width;
    out_->film_height_ = scene_.film.height;
    out_->bytes_ = triangle_count_ * 190 + out_->geometry_.bytes() + 65536;
    return std::shared_ptr<const CompiledScene>(std::move(out_));
  }

 private:
  Status load_meshes(const CompiledScene::AssetSource& assets) {
    std::map<Sha256, std::shared_ptr<const Mesh>> loaded;
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      std::shared_ptr<const Mesh>& mesh = meshes_.emplace_back();
      const auto* shape = std::get_if<MeshShape>(&scene_.objects[i].shape);
      if (shape == nullptr) {
        continue;
      }
      const std::string where = fmt::format("objects[{}] \"{}\"", i, scene_.objects[i].name);
      std::shared_ptr<const Mesh>& known = loaded[shape->asset];
      if (known == nullptr) {
        Result<std::string> bytes = assets(shape->asset);
        if (!bytes.ok()) {
          return with_context(bytes.status(), where);
        }
        Result<Mesh> decoded = decode_mesh(as_byte_view(*bytes));
        if (!decoded.ok()) {
          return with_context(decoded.status(), where);
        }
        known = std::make_shared<const Mesh>(std::move(*decoded));
      }
      mesh = known;
      triangle_count_ += mesh->triangles.size();
      if (triangle_count_ > kMaxTriangles) {
        return resource_exhausted("{}: the scene has more than the limit of {} triangles", where, kMaxTriangles);
      }
    }
    return ok_status();
  }

  void find_bounds() {
    Bounds scene;
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      Bounds& bounds = bounds_.emplace_back();
      if (const auto* sphere = std::get_if<SphereShape>(&scene_.objects[i].shape)) {
        bounds.add(to_vec(sphere->center) - Vec3d(sphere->radius));
        bounds.add(to_vec(sphere->center) + Vec3d(sphere->radius));
      } else {
        for (const auto& p : meshes_[i]->positions) {
          bounds.add({p[0], p[1], p[2]});
        }
      }
      scene.add(bounds.low);
      scene.add(bounds.high);
    }
    frame_ = WorldFrame(scene);
  }

  /// Fast rays may slip through the edge of two triangles once in some 10^7; that and coordinates much larger than the
  /// geometry they describe call for the slower, exact ones.
  bool needs_robust_rays() const {
    double smallest = frame_.extent();
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      const auto* sphere = std::get_if<SphereShape>(&scene_.objects[i].shape);
      smallest = std::min(smallest, sphere != nullptr ? sphere->radius : glm::length(bounds_[i].size()));
    }
    return triangle_count_ > 1000 || frame_.extent() > 1e3 * smallest;
  }

  /// `mesh` is null for spheres.
  void compile_object(const Object& object, const Mesh* mesh) {
    const Material& material = scene_.materials[object.material];
    const bool emits = !is_black(material.emission);
    if (const auto* sphere = std::get_if<SphereShape>(&object.shape)) {
      const Vec3 center(frame_.to_frame(to_vec(sphere->center)));
      const auto radius = static_cast<float>(sphere->radius * frame_.scale());
      out_->geometry_.add_sphere(object.material, center, radius, sphere->normal_inward);
      out_->accel_->add_sphere(center, radius);
      if (emits) {
        out_->lights_.add(EmissiveSphere{center, radius, to_vec(material.emission), sphere->normal_inward,
                                         material.two_sided_emission});
      }
      return;
    }
    std::vector<std::array<float, 3>> positions;
    positions.reserve(mesh->positions.size());
    for (const auto& p : mesh->positions) {
      const Vec3 q(frame_.to_frame({p[0], p[1], p[2]}));
      positions.push_back({q.x, q.y, q.z});
    }
    out_->accel_->add_mesh(positions, mesh->triangles);
    out_->geometry_.add_mesh(object.material, *mesh, positions);
    if (emits) {
      add_emissive_mesh(*mesh, positions, material);
    }
  }

  void add_emissive_mesh(const Mesh& mesh, const std::vector<std::array<float, 3>>& positions,
                         const Material& material) {
    const auto corner = [&](std::uint32_t i) { return Vec3(positions[i][0], positions[i][1], positions[i][2]); };
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      EmissiveFacet facet{corner(t[0]),
                          corner(t[1]) - corner(t[0]),
                          corner(t[2]) - corner(t[0]),
                          to_vec(material.emission),
                          material.two_sided_emission,
                          false};
      // Two triangles in a row that are the halves (0, 1, 2) and (0, 2, 3) of a parallelogram.
      if (i + 1 < mesh.triangles.size() && mesh.triangles[i + 1][0] == t[0] && mesh.triangles[i + 1][1] == t[2]) {
        const Vec3 edge3 = corner(mesh.triangles[i + 1][2]) - facet.corner;
        if (glm::length(facet.edge2 - facet.edge1 - edge3) <= 1e-6f * glm::length(facet.edge2)) {
          facet.edge2 = edge3;
          facet.parallelogram = true;
          ++i;
        }
      }
      if (glm::length(glm::cross(facet.edge1, facet.edge2)) > 0) {
        out_->lights_.add(facet);
      }
    }
  }

  void finish_lights() {
    out_->lights_.build();
    out_->features_.lights = !out_->lights_.empty();
    for (const Object& object : scene_.objects) {
      const Material& material = scene_.materials[object.material];
      const bool emits = !is_black(material.emission);
      out_->features_.emissive_surfaces |= emits;
      const auto* sphere = std::get_if<SphereShape>(&object.shape);
      const Vec3 radiance = to_vec(material.emission);
      float pdf_area = 0, probability = 0;
      if (emits && sphere != nullptr) {
        probability =
            out_->lights_.sphere_choice_probability({Vec3(0), static_cast<float>(sphere->radius * frame_.scale()),
                                                     radiance, sphere->normal_inward, material.two_sided_emission});
      } else if (emits) {
        pdf_area = out_->lights_.facet_pdf_area(radiance, material.two_sided_emission);
      }
      out_->emitter_pdf_area_.push_back(pdf_area);
      out_->emitter_probability_.push_back(probability);
    }
  }

  const Scene& scene_;
  std::unique_ptr<CompiledScene> out_;
  std::vector<std::shared_ptr<const Mesh>>
      meshes_;                  ///< one an object, shared by those that name one asset; null for spheres
  std::vector<Bounds> bounds_;  ///< one an object, in scene units
  std::uint64_t triangle_count_ = 0;
  WorldFrame frame_;
};

Result<std::shared_ptr<const CompiledScene>> CompiledScene::compile(const Scene& scene, const AssetSource& assets) {
  try {
    return SceneCompiler(scene).run(assets);
  } catch (const std::bad_alloc&) {
    return resource_exhausted("out of memory while compiling a scene of {} objects", scene.objects.size());
  }
}

}  // namespace lightmill
