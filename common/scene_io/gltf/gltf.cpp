#include "common/scene_io/gltf/gltf.h"

#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/gltf/gltf_materials.h"
#include "common/scene_io/gltf/gltf_mesh.h"
#include "common/scene_io/gltf/gltf_nodes.h"
#include "common/scene_io/missing_parts.h"

namespace lightmill {
namespace {

constexpr std::array<std::string_view, 17> kKnownExtensions{"KHR_lights_punctual",
                                                            "KHR_materials_anisotropy",
                                                            "KHR_materials_clearcoat",
                                                            "KHR_materials_diffuse_transmission",
                                                            "KHR_materials_emissive_strength",
                                                            "KHR_materials_ior",
                                                            "KHR_materials_sheen",
                                                            "KHR_materials_specular",
                                                            "KHR_materials_transmission",
                                                            "KHR_materials_unlit",
                                                            "KHR_materials_volume",
                                                            "KHR_texture_transform",
                                                            "KHR_mesh_quantization",
                                                            kDraco,
                                                            kMeshopt,
                                                            kWebpTextures,
                                                            kDdsTextures};

constexpr std::uint64_t kMaxReadBytes = std::uint64_t{16} << 30;  ///< of other files, each time that one is read
constexpr std::size_t kMaxNamed = 100;                            ///< unlisted extensions of a file that are named

bool is_known(std::string_view extension) {
  return std::find(kKnownExtensions.begin(), kKnownExtensions.end(), extension) != kKnownExtensions.end();
}

class GltfScene {
 public:
  GltfScene(const GltfData& data, const std::string& file_name)
      : data_(data), file_name_(file_name), notices_(loaded_.notices), materials_(data, file_name, loaded_, notices_) {}

  Result<LoadedScene> read(const GltfOptions& options) {
    check_extensions();
    if (options.moment) {
      LM_ASSIGN_OR_RETURN(poses_, with_context(poses_at(data_, *options.moment), file_name_));
    } else if (data_.root()["animations"].size() > 0) {
      notices_.left_out("animations (`--at SECONDS` shows a moment of one)");
    }
    const std::vector<PlacedNode> nodes = placed_nodes(data_, poses_);
    for (const PlacedNode& placed : nodes) {
      places_.emplace(placed.node.path(), placed.to_scene);
    }
    for (const PlacedNode& placed : nodes) {
      read_node(placed);
      LM_RETURN_IF_ERROR(data_.status());
    }
    LM_RETURN_IF_ERROR(data_.status());
    say_what_is_flat();
    if (loaded_.scene.objects.empty()) {
      return invalid_argument("{}: the scene has no triangles", file_name_);
    }
    if (loaded_.cameras.empty()) {
      add_missing_camera(loaded_);
    } else {
      use_camera(loaded_.cameras.front(), loaded_.scene);
    }
    if (options.add_sky_if_unlit) {
      add_missing_light(loaded_);
    }
    LM_RETURN_IF_ERROR(with_context(validate(loaded_.scene), file_name_));
    loaded_.faults = data_.faults();
    return std::move(loaded_);
  }

 private:
  struct Part {
    MeshShape shape;
    std::uint32_t material = 0;
  };

  void check_extensions() {
    const JsonNode required = data_.root()["extensionsRequired"], used = data_.root()["extensionsUsed"];
    for (std::size_t i = 0; i < required.size(); ++i) {
      if (const std::string name = required.at(i).text(); !is_known(name)) {
        required.at(i).fail(fmt::format("the file requires {}, which is not supported", name));
      }
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (const std::string name = used.at(i).text(); !is_known(name)) {
        notices_.left_out(fmt::format("extension {}", name));
      }
    }
    // Extensions in the file that are not listed.
    std::size_t named = 0;
    for (const std::string& name : data_.extensions()) {
      if (!is_known(name) && named < kMaxNamed) {
        notices_.left_out(fmt::format("extension {}", utf8_text(name.substr(0, 80))));
        ++named;
      }
    }
  }

  void read_node(const PlacedNode& placed) {
    if (placed.node["mesh"].present()) {
      add_objects(placed);
    }
    if (std::optional<Light> light = read_light(data_, placed, notices_)) {
      loaded_.scene.lights.push_back(*std::move(light));
    }
    if (std::optional<NamedCamera> camera = read_camera(data_, placed, notices_)) {
      loaded_.cameras.push_back(*std::move(camera));
    }
  }

  void add_objects(const PlacedNode& placed) {
    const JsonNode mesh = data_.element("meshes", placed.node["mesh"]);
    const MeshPose pose = mesh_pose(placed, mesh);
    // The joints of a skin place the mesh, so the node does not (glTF 2.0, 3.7.3.1).
    const Transform& to_scene = pose.joints == nullptr ? placed.to_scene : kIdentityTransform;
    const std::vector<Part>& parts = parts_of(mesh, pose, placed.node);
    if (!spans_space(to_scene)) {
      flat_.push_back(name_of(placed.node));
      return;
    }
    std::string name = placed.node["name"].text();
    name = !name.empty() ? name : mesh["name"].text();
    for (const Part& part : parts) {
      const std::string& material = loaded_.scene.materials[part.material].name;
      const Status added = add_object({scene_name(parts.size() == 1 ? name : fmt::format("{}/{}", name, material)),
                                       part.material, part.shape, to_scene},
                                      loaded_);
      if (!added.ok()) {
        placed.node.fail(message_of(added));
        return;
      }
    }
  }

  /// The deformation of a node's mesh.
  MeshPose mesh_pose(const PlacedNode& placed, const JsonNode& mesh) {
    const JsonNode& node = placed.node;
    MeshPose pose;
    if (const auto animated = poses_.find(node.path()); animated != poses_.end() && animated->second.weights) {
      pose.weights = moving(*animated->second.weights);
    } else if (node["weights"].present()) {
      pose.weights = weights_of(node["weights"], mesh);
    } else {
      pose.weights = mesh_weights(mesh);
    }
    if (const JsonNode skin = data_.element("skins", node["skin"]); skin.present()) {
      const auto [found, added] = joints_.try_emplace(skin.path());
      if (added) {
        found->second = joints_of(data_, skin, places_);
      }
      pose.joints = found->second;
      pose.to_scene = placed.to_scene;
    }
    return pose;
  }

  /// The weights of nodes that have none of their own.
  const std::shared_ptr<const std::vector<double>>& mesh_weights(const JsonNode& mesh) {
    const auto [found, added] = mesh_weights_.try_emplace(mesh.path());
    if (added) {
      found->second = weights_of(mesh["weights"], mesh);
    }
    return found->second;
  }
  /// Null if all are 0.
  static std::shared_ptr<const std::vector<double>> moving(std::vector<double> weights) {
    const bool moves = std::ranges::any_of(weights, [](double weight) { return weight != 0; });
    return moves ? std::make_shared<const std::vector<double>>(std::move(weights)) : nullptr;
  }
  /// As many as the mesh has targets.
  static std::shared_ptr<const std::vector<double>> weights_of(const JsonNode& weights, const JsonNode& mesh) {
    const JsonNode primitives = mesh["primitives"];
    const std::size_t targets = primitives.size() == 0 ? 0 : primitives.at(0)["targets"].size();
    std::vector<double> out;
    for (std::size_t i = 0; i < std::min(weights.size(), targets); ++i) {
      out.push_back(weights.at(i).number(0, -kMaxWeight, kMaxWeight));
    }
    return moving(std::move(out));
  }

  /// The primitives of a mesh as assets. Nodes that do not deform the mesh, or only by its own weights, share them.
  const std::vector<Part>& parts_of(const JsonNode& mesh, const MeshPose& pose, const JsonNode& node) {
    const bool own = pose.joints != nullptr || pose.weights != mesh_weights(mesh);
    const std::string key = own ? fmt::format("{} {}", mesh.path(), node.path()) : mesh.path();
    const auto [found, added] = meshes_.try_emplace(key);
    if (!added) {
      return found->second;
    }
    const JsonNode primitives = mesh["primitives"];
    for (std::size_t i = 0; i < primitives.size() && data_.status().ok(); ++i) {
      const JsonNode primitive = primitives.at(i);
      const GltfMaterials::Used used = materials_.use(primitive["material"]);
      const bool coordinates = used.anisotropic && primitive["attributes"]["TEXCOORD_0"].present();
      const std::optional<std::uint64_t> texture_set =
          coordinates && !used.texture_set ? std::optional<std::uint64_t>(0) : used.texture_set;
      std::optional<Mesh> triangles =
          read_primitive(data_, primitive, pose, texture_set, used.tangents, deformed_, notices_);
      if (!triangles) {
        continue;
      }
      if (used.anisotropic && triangles->tangents.empty() && triangles->texture_coordinates.empty()) {
        notices_.once("anisotropic surfaces without tangents and texture coordinates have the mean roughness");
      }
      if (used.unlit && !triangles->colors.empty()) {
        notices_.left_out("vertex colours of unlit materials");
        triangles->colors.clear();
      }
      found->second.push_back(
          {{fmt::format("{} {}", file_name_, primitive.path()), add_bytes(encode_mesh(*triangles), loaded_)},
           used.material});
    }
    return found->second;
  }

  static std::string name_of(const JsonNode& node) {
    const std::string name = node["name"].text();
    return name.empty() ? node.path() : fmt::format("{} \"{}\"", node.path(), name);
  }

  void say_what_is_flat() {
    constexpr std::size_t kShown = 10;
    std::string names;
    for (std::size_t i = 0; i < std::min(flat_.size(), kShown); ++i) {
      names += (i == 0 ? "" : ", ") + flat_[i];
    }
    if (flat_.size() > kShown) {
      names += fmt::format(" and {} more", flat_.size() - kShown);
    }
    if (!flat_.empty()) {
      notices_.left_out("objects with a scale of 0: " + names);
    }
  }

  const GltfData& data_;
  const std::string& file_name_;
  LoadedScene loaded_;
  Notices notices_;
  GltfMaterials materials_;
  GltfPoses poses_;
  std::map<std::string, std::shared_ptr<const std::vector<double>>> mesh_weights_;  ///< by mesh
  std::unordered_map<std::string, Transform> places_;                               ///< of the scene's nodes
  std::map<std::string, std::shared_ptr<const std::vector<Transform>>> joints_;     ///< by skin
  std::map<std::string, std::vector<Part>> meshes_;                                 ///< by mesh and pose
  std::uint64_t deformed_ = 0;                                                      ///< see count_deformed
  std::vector<std::string> flat_;  ///< nodes with scale 0; this hides everything in them
};

}  // namespace

Result<LoadedScene> read_gltf(std::string bytes, const std::string& file_name, const GltfOptions& options,
                              FileSource files) {
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<GltfData> data,
                      GltfData::open(std::move(bytes), file_name, at_most(kMaxReadBytes, std::move(files)),
                                     options.decode_mesh, options.most_shared_bytes));
  return GltfScene(*data, file_name).read(options);
}

}  // namespace lightmill
