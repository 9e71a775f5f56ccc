// The readers of glTF, pbrt and Mitsuba scenes, called as in the program, for tests and libFuzzer.
#pragma once

#include <google/protobuf/stubs/logging.h>

#include "common/base/check.h"
#include "common/scene/mesh.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/gltf/gltf.h"
#include "common/scene_io/mitsuba/mitsuba.h"
#include "common/scene_io/pbrt/pbrt.h"
#include "common/wire/scene_proto.h"

namespace lightmill::fuzz {

/// Files by name: a mesh, an included file, else some bytes.
inline Result<SourceFile> file_of_fuzzed_scene(const std::string& name) {
  if (name == "mesh.ply") {
    return SourceFile{
        name,
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 0 1 2\n"};
  }
  if (name == "mesh.obj") {
    return SourceFile{name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"};
  }
  if (name == "more.xml") {
    return SourceFile{name, "<scene version=\"3.0.0\"><shape type=\"sphere\"/></scene>"};
  }
  return name == "none" ? Result<SourceFile>(not_found("cannot open {}", name))
                        : SourceFile{name, name == "more.pbrt" ? "Translate 1 0 0\nShape \"sphere\"\n" : "bytes"};
}

/// Whether the scene was read. Stops the program if it is invalid, or if an error has no place.
inline bool check_fuzzed_scene(const Result<LoadedScene>& loaded) {
  if (!loaded.ok()) {
    const std::string message = message_of(loaded.status());
    bool placed = message.starts_with("fuzz:");
    for (std::size_t i = 0; i + 1 < message.size(); ++i) {  // an included file may have any name
      placed = placed || (message[i] == ':' && message[i + 1] >= '1' && message[i + 1] <= '9');
    }
    LM_CHECK(placed, "the error does not name its place: {}", message);
    return false;
  }
  LM_CHECK(validate(loaded->scene).ok());
  const std::string packed = pack_scene(loaded->scene);
  const Result<Scene> unpacked = unpack_scene(packed);
  LM_CHECK(unpacked.ok(), "the packed scene: {}", message_of(unpacked.status()));
  LM_CHECK(pack_scene(*unpacked) == packed, "the scene has changed");
  for (const Object& object : loaded->scene.objects) {
    if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
      LM_CHECK(decode_mesh(as_byte_view(loaded->assets.at(mesh->asset))).ok());
    }
  }
  return true;
}

/// Arrays of the requested sizes with numbers of all kinds, for compressed meshes.
inline Result<DecodedMesh> decode_fuzzed_mesh(ByteView bytes, const MeshRequest& request) {
  LM_RETURN_IF_ERROR(check_request(request));
  if (bytes.empty() || request.vertices == 0 || size_bytes(request) > 1'000'000) {
    return resource_exhausted("too large");
  }
  DecodedMesh mesh;
  for (std::uint64_t i = 0; i < 3 * request.triangles; ++i) {
    mesh.corners.push_back(static_cast<std::uint32_t>((i + i / 3) % request.vertices));
  }
  for (const CompressedAttribute& attribute : request.attributes) {
    std::string& numbers =
        mesh.attributes.emplace_back(request.vertices * attribute.components * component_bytes(attribute.type), '\0');
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      numbers[i] = static_cast<char>(bytes[i % bytes.size()]);
    }
  }
  return mesh;
}

/// Files that the scene names have a few zeros. With animations, it is read at a moment of the first one.
inline bool try_gltf(std::string_view text) {
  static const google::protobuf::LogSilencer quiet;
  GltfOptions options{.decode_mesh = decode_fuzzed_mesh};
  if (text.find("\"animations\"") != text.npos) {
    options.moment = AnimationMoment{"", 0.5};
  }
  return check_fuzzed_scene(read_gltf(std::string(text), "fuzz", options, [](const std::string& name) {
    return Result<SourceFile>(SourceFile{name, std::string(64, '\0')});
  }));
}

inline bool try_pbrt(std::string_view text) {
  static const google::protobuf::LogSilencer quiet;
  return check_fuzzed_scene(read_pbrt(std::string(text), "fuzz", file_of_fuzzed_scene));
}

inline bool try_mitsuba(std::string_view text) {
  static const google::protobuf::LogSilencer quiet;
  return check_fuzzed_scene(read_mitsuba(std::string(text), "fuzz", file_of_fuzzed_scene));
}

}  // namespace lightmill::fuzz
