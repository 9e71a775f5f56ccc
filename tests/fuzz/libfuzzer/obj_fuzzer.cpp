// Fuzzer of the OBJ reader: any bytes give valid meshes, or an error with its line.
#include "common/scene_io/obj.h"

#include "tests/fuzz/libfuzzer/fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lightmill;
  Faults faults;
  const Result<ObjFile> file = read_obj(as_text(data, size), "fuzz.obj", faults);
  if (!file.ok()) {
    expect_placed(file.status(), "fuzz.obj:");
    return 0;
  }
  for (const ObjPart& part : file->parts) {
    const ObjPart* const only = &part;
    const Mesh mesh = make_mesh(*file, std::span(&only, 1));
    expect_ok(validate(mesh), "the mesh of a part");
    const std::string bytes = encode_mesh(mesh);
    const Result<Mesh> again = decode_mesh(as_byte_view(bytes));
    expect_ok(again.status(), "its bytes");
    LM_CHECK(encode_mesh(*again) == bytes, "the mesh has changed");
  }
  return 0;
}
