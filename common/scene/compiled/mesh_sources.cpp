#include "common/scene/compiled/mesh_sources.h"

namespace lightmill {
namespace {

/// Indices of the nine floats of a triangle stay below 2^31, as eight-lane gathers need.
constexpr std::uint64_t kMaxTriangles = 200'000'000;

std::shared_ptr<const Mesh> one_triangle(const TriangleShape& triangle) {
  Mesh mesh;
  mesh.positions = {triangle.a, triangle.b, triangle.c};
  mesh.texture_coordinates = {{0, 0}, {1, 0}, {0, 1}};
  mesh.triangles = {{0, 1, 2}};
  return std::make_shared<const Mesh>(std::move(mesh));
}

}  // namespace

Result<ObjectMeshes> load_meshes(const Scene& scene, const CompiledScene::AssetSource& assets) {
  ObjectMeshes meshes;
  std::map<Sha256, std::shared_ptr<const Mesh>> loaded;
  std::uint64_t triangles = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    std::shared_ptr<const Mesh>& mesh = meshes.emplace_back();
    if (const auto* triangle = std::get_if<TriangleShape>(&scene.objects[i].shape)) {
      mesh = one_triangle(*triangle);
    }
    const auto* shape = std::get_if<MeshShape>(&scene.objects[i].shape);
    if (shape == nullptr) {
      continue;
    }
    const std::string where = fmt::format("objects[{}] \"{}\"", i, scene.objects[i].name);
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
    triangles += mesh->triangles.size();
    if (triangles > kMaxTriangles) {
      return resource_exhausted("{}: the scene has more than the limit of {} triangles", where, kMaxTriangles);
    }
  }
  return meshes;
}

Mesh transformed(const Mesh& mesh, const Affine& map) {
  Mesh out = mesh;
  for (auto& p : out.positions) {
    const Vec3d q = map({p[0], p[1], p[2]});
    p = {q.x, q.y, q.z};
  }
  const glm::dmat3 normal_matrix = map.normal_matrix();
  for (auto& n : out.normals) {
    const Vec3d q = glm::normalize(near_one(normal_matrix * Vec3d(n[0], n[1], n[2])));
    n = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
  }
  if (map.mirrors()) {
    for (auto& t : out.triangles) {
      std::swap(t[1], t[2]);
    }
  }
  return out;
}

Bounds bounds_of(const Mesh& mesh, const Affine& map) {
  Bounds bounds;
  for (const auto& p : mesh.positions) {
    bounds.add(map({p[0], p[1], p[2]}));
  }
  return bounds;
}

}  // namespace lightmill
