// A glTF file's JSON, its binary data, and the numbers of its accessors.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/image/decoder/compressed_mesh.h"
#include "common/scene_io/file_finder.h"
#include "common/scene_io/gltf/gltf_meshopt.h"
#include "common/scene_io/gltf/json_node.h"

namespace lightmill {

inline constexpr std::uint64_t kMaxSharedBytes = std::uint64_t{1} << 30;  ///< see GltfOptions
inline constexpr std::string_view kDraco = "KHR_draco_mesh_compression";
/// Bytes that all decoded meshes of a file may have together, with the compressed ones.
inline constexpr std::uint64_t kMaxDracoBytes = std::uint64_t{4} << 30;

/// An opened glTF 2.0 file: JSON, or GLB with its binary chunk. Buffers and images are in the file, in base64 data
/// URIs, or in other files.
class GltfData {
 public:
  /// `file_name` is for messages: "model.gltf: accessors[3].count: what is expected, what is there".
  /// Without `decode_mesh`, primitives that are there only in compressed form are errors. `most_shared_bytes`: see
  /// GltfOptions.
  static Result<std::unique_ptr<GltfData>> open(std::string bytes, const std::string& file_name, FileSource files,
                                                MeshDecoder decode_mesh = nullptr,
                                                std::uint64_t most_shared_bytes = kMaxSharedBytes);
  ~GltfData();

  JsonNode root() const;
  /// The names of all extensions in the file, sorted. Extras are skipped. So are textures, whose extensions only add
  /// other images.
  std::vector<std::string> extensions() const;
  /// The first error so far, with the file's name.
  Status status() const;
  const Faults& faults() const { return errors_.faults(); }
  /// The element of the root's list `what` with this index. Not present if the index is missing or wrong.
  JsonNode element(std::string_view what, const JsonNode& index) const;

  /// The elements of the accessor `index`, as vectors of `n` numbers (n = 1: SCALAR). Normalized integers become [0, 1]
  /// or [−1, 1]. Sparse values are applied. Empty after an error.
  template <std::size_t n>
  std::vector<std::array<double, n>> vectors(const JsonNode& index) const;
  /// Only the elements `which`, which must ascend and be below the accessor's count.
  template <std::size_t n>
  std::vector<std::array<double, n>> vectors(const JsonNode& index, std::span<const std::uint32_t> which) const;
  /// The number of elements of the accessor `index`. 0 after an error.
  std::size_t count(const JsonNode& index) const;
  /// The elements of a SCALAR accessor of unsigned integers. Empty after an error.
  std::vector<std::uint32_t> indices(const JsonNode& index) const;
  /// Whether the buffer of a buffer view is there. It is not if it stands for compressed data.
  bool has_bytes(const JsonNode& index) const;
  /// The bytes of a buffer view. If they are only there in the compressed form of kMeshopt, they are decoded. Empty
  /// after an error.
  std::string_view view(const JsonNode& index) const;
  /// The geometry of a primitive that is there only in the compressed form of kDraco. Its attributes can be read
  /// afterwards. If all of it is there uncompressed, too, then the uncompressed form is used, on machines with and
  /// without a decoder. Null without compressed geometry, and after an error.
  std::shared_ptr<const DecodedMesh> decompressed(const JsonNode& primitive) const;
  /// Whether the values of this attribute of a primitive were compressed.
  bool is_decompressed(const JsonNode& attribute) const { return attributes_.contains(attribute.path()); }
  /// The bytes that a uri names. NOT_FOUND without a place if there is no such file. Else an error is also noted.
  Result<std::string> uri_bytes(const JsonNode& uri) const;

 private:
  struct Accessor;
  GltfData(std::string bytes, std::string file_name, FileSource files, MeshDecoder decode_mesh,
           std::uint64_t most_shared_bytes);
  Status parse();
  void load_buffers();
  Accessor accessor(const JsonNode& index, std::size_t components) const;
  std::string_view part_of_buffer(const JsonNode& view) const;
  std::string_view decoded(const JsonNode& view, const JsonNode& compressed) const;
  bool has_data(const JsonNode& index) const;
  bool is_only_compressed(const JsonNode& primitive) const;
  MeshRequest draco_request(const JsonNode& primitive, std::vector<std::string>& names) const;
  std::shared_ptr<const DecodedMesh> decode_draco(const JsonNode& extension, const MeshRequest& request) const;
  template <std::size_t n>
  std::vector<std::array<double, n>> read(const JsonNode& index, const Accessor& from,
                                          const std::span<const std::uint32_t>* which) const;
  bool may_read(const JsonNode& index, std::uint64_t bytes) const;
  bool find_elements(const JsonNode& at, const JsonNode& view_index, std::size_t count, std::size_t element_bytes,
                     std::size_t element_stride, Accessor& out) const;

  std::string bytes_;  ///< the whole file
  std::string file_name_;
  FileSource files_;
  MeshDecoder decode_mesh_;
  const std::uint64_t most_shared_bytes_;
  std::unique_ptr<nlohmann::json> json_;
  std::string_view binary_chunk_;
  bool has_binary_chunk_ = false;
  std::vector<std::string> owned_;         ///< buffers outside the file
  std::vector<std::string_view> buffers_;  ///< each with its byteLength
  std::uint64_t buffer_bytes_ = 0;         ///< of all of them; those of one file once
  mutable FirstError errors_;
  mutable std::map<std::string, std::string> decoded_;  ///< compressed views, by path
  mutable std::uint64_t meshopt_budget_ = kMaxMeshoptBytes;
  mutable std::map<std::string, std::shared_ptr<const DecodedMesh>> meshes_;        ///< by buffer view and request
  mutable std::map<std::string, std::shared_ptr<const DecodedMesh>> decompressed_;  ///< by path of the primitive
  mutable std::map<std::string, std::string_view> attributes_;                      ///< decompressed values, by path
  mutable std::uint64_t draco_budget_ = kMaxDracoBytes;
  mutable std::uint64_t zero_elements_ = 0;  ///< elements of accessors without data so far
  mutable std::uint64_t read_bytes_ = 0;     ///< bytes of elements read so far. Accessors may share bytes
};

}  // namespace lightmill
