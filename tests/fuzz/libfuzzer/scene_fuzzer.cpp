// Fuzzer of scene documents: any bytes give a valid scene that survives packing, or an error with its place.
#include <google/protobuf/stubs/logging.h>

#include "common/scene/validate/validate.h"
#include "common/wire/scene_json.h"
#include "tests/fuzz/libfuzzer/fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lightmill;
  static const google::protobuf::LogSilencer quiet;
  const Result<SceneFile> file = read_scene_json(as_text(data, size), "fuzz.json");
  if (!file.ok()) {
    expect_placed(file.status(), "fuzz.json:");
    return 0;
  }
  expect_ok(validate(file->draft.scene), "a scene that was read");
  const std::string packed = pack_scene(file->draft.scene);
  const Result<Scene> unpacked = unpack_scene(packed);
  expect_ok(unpacked.status(), "the packed scene");
  LM_CHECK(pack_scene(*unpacked) == packed, "the scene has changed");
  return 0;
}
