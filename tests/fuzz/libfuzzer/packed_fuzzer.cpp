// Fuzzer of packed scenes and meshes: any bytes give a valid value or an error. The first byte chooses which.
#include <google/protobuf/stubs/logging.h>

#include "common/scene/mesh.h"
#include "common/wire/scene_proto.h"
#include "tests/fuzz/libfuzzer/fuzzer.h"

namespace lightmill {
namespace {

void try_scene(std::string_view bytes) {
  const Result<Scene> scene = unpack_scene(bytes);
  if (!scene.ok()) {
    return;
  }
  const std::string packed = pack_scene(*scene);
  const Result<Scene> again = unpack_scene(packed);
  expect_ok(again.status(), "the packed scene");
  LM_CHECK(pack_scene(*again) == packed, "the scene has changed");
}

void try_mesh(std::string_view bytes) {
  const Result<Mesh> mesh = decode_mesh(as_byte_view(bytes));
  if (!mesh.ok()) {
    expect_placed(mesh.status(), "mesh: ");
    return;
  }
  LM_CHECK(encode_mesh(*mesh) == bytes, "the mesh has changed");
}

}  // namespace
}  // namespace lightmill

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lightmill;
  static const google::protobuf::LogSilencer quiet;
  const std::string_view bytes = as_text(data, size);
  if (!bytes.empty()) {
    bytes[0] == 'M' ? try_mesh(bytes.substr(1)) : try_scene(bytes.substr(1));
  }
  return 0;
}
