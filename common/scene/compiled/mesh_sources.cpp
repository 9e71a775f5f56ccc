#include "common/scene/compiled/mesh_sources.h"

#include <tuple>

namespace lightmill {
namespace {

std::shared_ptr<const Mesh> one_triangle(const TriangleShape& triangle) {
  Mesh mesh;
  mesh.positions = {triangle.a, triangle.b, triangle.c};
  mesh.texture_coordinates = {{0, 0}, {1, 0}, {0, 1}};
  mesh.triangles = {{0, 1, 2}};
  return std::make_shared<const Mesh>(std::move(mesh));
}

/// Decides which objects are instances, and counts triangles.
Status share_meshes(const Scene& scene, std::uint64_t max_triangles, ObjectMeshes& meshes) {
  std::map<const Mesh*, int> users, instances;
  for (const auto& mesh : meshes.of_object) {
    ++users[mesh.get()];
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Mesh* mesh = meshes.of_object[i].get();
    if (mesh == nullptr) {
      meshes.instanced.push_back(false);
      continue;
    }
    const std::size_t triangles = mesh->triangles.size();
    const bool instanced = users.at(mesh) > 1 && triangles >= kInstancedTriangles &&
                           is_black(scene.materials[scene.objects[i].material].emission);
    meshes.instanced.push_back(instanced);
    meshes.triangles_seen += triangles;
    meshes.triangles_held += instanced && ++instances[mesh] > 1 ? 0 : triangles;
    if (meshes.triangles_held > max_triangles) {
      return resource_exhausted(
          "objects[{}] \"{}\": the scene has more triangles than the worker's limit of {} "
          "(--scene-triangles; instances of a mesh count once)",
          i, scene.objects[i].name, max_triangles);
    }
  }
  return ok_status();
}

}  // namespace

Result<ObjectMeshes> load_meshes(const Scene& scene, const CompiledScene::AssetSource& assets,
                                 std::uint64_t max_triangles) {
  ObjectMeshes meshes;
  std::map<Sha256, std::shared_ptr<const Mesh>> loaded;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    std::shared_ptr<const Mesh>& mesh = meshes.of_object.emplace_back();
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
      LM_ASSIGN_OR_RETURN(const std::string bytes, with_context(assets(shape->asset), where));
      LM_ASSIGN_OR_RETURN(Mesh decoded, with_context(decode_mesh(as_byte_view(bytes)), where));
      known = std::make_shared<const Mesh>(std::move(decoded));
    }
    mesh = known;
  }
  LM_RETURN_IF_ERROR(share_meshes(scene, max_triangles, meshes));
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
  for (auto& [x, y, z, sign] : out.tangents) {
    const Vec3 t(glm::normalize(near_one(map.linear * Vec3d(x, y, z))));
    std::tie(x, y, z) = std::tuple(t.x, t.y, t.z);
    sign = map.mirrors() ? -sign : sign;
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

Bounds bounds_of(const Bounds& box, const Affine& map) {
  Bounds bounds;
  for (unsigned corner = 0; corner < 8; ++corner) {
    bounds.add(map({(corner & 1) != 0 ? box.high.x : box.low.x, (corner & 2) != 0 ? box.high.y : box.low.y,
                    (corner & 4) != 0 ? box.high.z : box.low.z}));
  }
  return bounds;
}

}  // namespace lightmill
