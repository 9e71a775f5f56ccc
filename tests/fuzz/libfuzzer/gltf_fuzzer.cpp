// Fuzzer of the glTF reader: any bytes give a valid scene that survives packing, or an error with the file's name.
// Files that the input names have a few zeros.
#include <google/protobuf/stubs/logging.h>

#include "common/scene/mesh.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/gltf/gltf.h"
#include "common/wire/scene_proto.h"
#include "tests/fuzz/libfuzzer/fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lightmill;
  static const google::protobuf::LogSilencer quiet;
  const auto files = [](const std::string& name) -> Result<SourceFile> {
    return SourceFile{name, std::string(64, '\0')};
  };
  const Result<LoadedScene> loaded = read_gltf(std::string(as_text(data, size)), "fuzz.gltf", true, files);
  if (!loaded.ok()) {
    expect_placed(loaded.status(), "fuzz.gltf: ");
    return 0;
  }
  expect_ok(validate(loaded->scene), "a scene that was read");
  const std::string packed = pack_scene(loaded->scene);
  const Result<Scene> unpacked = unpack_scene(packed);
  expect_ok(unpacked.status(), "the packed scene");
  LM_CHECK(pack_scene(*unpacked) == packed, "the scene has changed");
  for (const Object& object : loaded->scene.objects) {
    const auto asset = loaded->assets.find(std::get<MeshShape>(object.shape).asset);
    LM_CHECK(asset != loaded->assets.end(), "an object without its mesh");
    expect_ok(decode_mesh(as_byte_view(asset->second)).status(), "a mesh");
  }
  return 0;
}
