#include "common/scene/compiled/scene_memory.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <set>

#include "common/materials/texture_pyramid.h"
#include "common/scene/compiled/mesh_sources.h"

namespace lightmill {
namespace {

// Bytes at the peak of compiling, per item. Measured by scene_memory_bench.
constexpr std::uint64_t kOfTriangle = 200;          ///< Embree's hierarchy while it is built, and tables
constexpr std::uint64_t kOfPosition = 28;           ///< in single precision, twice
constexpr std::uint64_t kOfNormal = 24;             ///< as tables grow
constexpr std::uint64_t kOfCoordinate = 16;         ///< as tables grow
constexpr std::uint64_t kOfColor = 32;              ///< as tables grow
constexpr std::uint64_t kOfTangent = 32;            ///< as tables grow
constexpr std::uint64_t kOfDerivatives = 64;        ///< as tables grow, per triangle of materials that use tangents
constexpr std::uint64_t kOfEmissiveTriangle = 650;  ///< of the lights' table
constexpr std::uint64_t kOfObject = 1100;
constexpr std::uint64_t kOfLight = 1000;      ///< in the document, in the table and in its hierarchy
constexpr std::uint64_t kOfMaterial = 1200;   ///< in the document and in its table
constexpr std::uint64_t kOfFileByte = 2;      ///< while an image is decoded: the file, and its copy for the decoder
constexpr std::uint64_t kOfSkyPixel = 28;     ///< light_builder.cpp has the peak
constexpr std::uint64_t kOfScene = 16 << 20;  ///< loaded with a program's first scene

/// The header of a mesh's asset (mesh.h).
struct MeshHeader {
  std::uint64_t file_bytes = 0, positions = 0, triangles = 0;
  bool normals = false, coordinates = false, colors = false, tangents = false;
};

MeshHeader header_of(ByteView bytes) {
  MeshHeader header;
  std::array<std::uint32_t, 3> numbers{};
  if (bytes.size() >= 16 && std::memcmp(bytes.data(), "LMM1", 4) == 0) {
    std::memcpy(numbers.data(), bytes.data() + 4, sizeof(numbers));
    header.file_bytes = bytes.size();
    header.normals = (numbers[0] & 1) != 0;
    header.coordinates = (numbers[0] & 2) != 0;
    header.colors = (numbers[0] & 8) != 0;
    header.tangents = (numbers[0] & 4) != 0;
    // If a header claims more than the file has, it cannot be decoded.
    header.positions = std::min<std::uint64_t>(numbers[1], bytes.size() / 24);
    header.triangles = std::min<std::uint64_t>(numbers[2], bytes.size() / 12);
  }
  return header;
}

/// The memory of an object with such a mesh, without the decoded mesh.
std::uint64_t bytes_of(const MeshHeader& mesh, bool moved, bool emits, bool uses_tangents) {
  std::uint64_t bytes = mesh.triangles * kOfTriangle + mesh.positions * kOfPosition;
  bytes += mesh.normals ? mesh.positions * kOfNormal : 0;
  bytes += mesh.coordinates ? mesh.positions * kOfCoordinate : 0;
  bytes += mesh.colors ? mesh.positions * kOfColor : 0;
  bytes += uses_tangents && (mesh.coordinates || mesh.tangents) ? mesh.triangles * kOfDerivatives : 0;
  bytes += uses_tangents && mesh.tangents ? mesh.positions * kOfTangent : 0;
  bytes += emits ? mesh.triangles * kOfEmissiveTriangle : 0;
  bytes += moved ? mesh.file_bytes : 0;  // a copy in the scene's coordinates
  return bytes;
}

/// Adds up memory, and remembers the largest part.
class Sum {
 public:
  void add(std::uint64_t bytes, const std::string& name) {
    memory_.bytes += bytes;
    if (bytes > memory_.largest_bytes) {
      memory_.largest_bytes = bytes;
      memory_.largest = name;
    }
  }
  void add_triangles(std::uint64_t triangles) { memory_.triangles += triangles; }
  const SceneMemory& memory() const { return memory_; }

 private:
  SceneMemory memory_;
};

class Estimator {
 public:
  Estimator(const Scene& scene, const CompiledScene::AssetSource& assets, const ImageSizer& sizes)
      : scene_(scene), assets_(assets), sizes_(sizes) {}

  Result<SceneMemory> run() {
    sum_.add(kOfScene, "what every scene takes");
    sum_.add(scene_.objects.size() * kOfObject, fmt::format("its {} objects", scene_.objects.size()));
    sum_.add(scene_.lights.size() * kOfLight, fmt::format("its {} lights", scene_.lights.size()));
    std::uint64_t rows = 0;
    for (const Material& material : scene_.materials) {
      rows += 2 * count_parts(material) - 1;  // the mixtures have rows, too
    }
    sum_.add(rows * kOfMaterial, fmt::format("its {} materials", scene_.materials.size()));
    LM_RETURN_IF_ERROR(add_meshes());
    for (const TextureImage& image : scene_.textures) {
      LM_RETURN_IF_ERROR(add_image(image.asset, image.file, "texture", 0));
    }
    for (const Light& light : scene_.lights) {
      if (const auto* environment = std::get_if<EnvironmentLight>(&light.kind); environment && environment->has_image) {
        LM_RETURN_IF_ERROR(add_image(environment->asset, environment->file, "environment", kOfSkyPixel));
      } else if (const auto* ies = std::get_if<IesLight>(&light.kind); ies && files_.insert(ies->asset).second) {
        LM_ASSIGN_OR_RETURN(const std::string bytes, assets_(ies->asset));
        note_file(bytes.size(), fmt::format("the file of the light \"{}\"", light.name));
      }
    }
    sum_.add(largest_file_bytes_ * kOfFileByte, largest_file_);
    return sum_.memory();
  }

 private:
  Status add_meshes() {
    std::map<Sha256, std::uint32_t> users;
    for (const Object& object : scene_.objects) {
      if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
        ++users[mesh->asset];
      }
    }
    std::map<Sha256, MeshHeader> headers;
    std::set<Sha256> held;
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      const Object& object = scene_.objects[i];
      const auto* mesh = std::get_if<MeshShape>(&object.shape);
      if (mesh == nullptr) {
        continue;
      }
      const std::string name = fmt::format("objects[{}] \"{}\"", i, object.name);
      const auto [found, is_new] = headers.try_emplace(mesh->asset);
      if (is_new) {
        LM_ASSIGN_OR_RETURN(const std::string bytes, assets_(mesh->asset));
        found->second = header_of(as_byte_view(bytes));
        sum_.add(found->second.file_bytes, name);
      }
      const MeshHeader& header = found->second;
      const RgbColor& emission = scene_.materials[object.material].emission.rgb;
      const bool emits = emission.r > 0 || emission.g > 0 || emission.b > 0;
      const bool instanced = users.at(mesh->asset) > 1 && header.triangles >= kInstancedTriangles && !emits;
      if (!instanced || held.insert(mesh->asset).second) {
        const Material& material = scene_.materials[object.material];
        const bool uses_tangents = has_mapped_normals(material) || is_anisotropic(material);
        sum_.add(bytes_of(header, !instanced && object.transform != kIdentityTransform, emits, uses_tangents), name);
        sum_.add_triangles(header.triangles);
      }
    }
    return ok_status();
  }

  /// `later`: bytes per pixel after decoding, if that is more than decoding takes.
  Status add_image(const Sha256& asset, const std::string& file, const char* what, std::uint64_t later) {
    if (!files_.insert(asset).second) {
      return ok_status();
    }
    LM_ASSIGN_OR_RETURN(const std::string bytes, assets_(asset));
    note_file(bytes.size(), fmt::format("the file of the {} \"{}\"", what, file));
    if (const Result<ImageSize> size = sizes_(as_byte_view(bytes), file); size.ok()) {
      // The decoder's values together with the pixels, or encoded pixels together with their linear form; and the
      // smaller copies of textures.
      sum_.add(size->pixels() * std::max<std::uint64_t>(2 * size->bytes_per_pixel, later) +
                   (later == 0 ? pyramid_peak_bytes(size->width, size->height, size->bytes_per_pixel) : 0),
               fmt::format("the {} \"{}\"", what, file));
    }
    return ok_status();
  }

  /// Files are read one after the other, so only the largest one counts.
  void note_file(std::uint64_t bytes, std::string name) {
    if (bytes > largest_file_bytes_) {
      largest_file_bytes_ = bytes;
      largest_file_ = std::move(name);
    }
  }

  const Scene& scene_;
  const CompiledScene::AssetSource& assets_;
  const ImageSizer& sizes_;
  std::set<Sha256> files_;  ///< of images and lights
  std::uint64_t largest_file_bytes_ = 0;
  std::string largest_file_;
  Sum sum_;
};

}  // namespace

Result<SceneMemory> estimate_memory(const Scene& scene, const CompiledScene::AssetSource& assets,
                                    const ImageSizer& sizes) {
  return Estimator(scene, assets, sizes).run();
}

}  // namespace lightmill
