// Fuzzer of the Mitsuba reader: any bytes give a valid scene that survives packing, or an error with a file's name and
// line.
#include "tests/fuzz/libfuzzer/fuzzer.h"
#include "tests/fuzz/scene_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lightmill::fuzz::try_mitsuba(lightmill::as_text(data, size));
  return 0;
}
