// Fuzzer of the glTF reader: any bytes give a valid scene that survives packing, or an error with the file's name.
#include "tests/fuzz/libfuzzer/fuzzer.h"
#include "tests/fuzz/scene_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lightmill::fuzz::try_gltf(lightmill::as_text(data, size));
  return 0;
}
