// Fuzzer of the MTL reader: any bytes give valid materials, and faults with their lines.
#include "common/scene/validate/validate.h"
#include "common/scene_io/mtl.h"

#include "tests/fuzz/libfuzzer/fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lightmill;
  Faults faults;
  std::vector<MtlMaterial> read = read_mtl(as_text(data, size), "fuzz.mtl", faults);
  if (!faults.empty()) {
    expect_placed(faults.as_error(), "fuzz.mtl:");
  }
  std::set<std::string> names;
  std::erase_if(read, [&](const MtlMaterial& material) { return !names.insert(material.name).second; });
  for (const KaMeaning ka : {KaMeaning::automatic, KaMeaning::emission, KaMeaning::ambient}) {
    std::vector<std::string> notices;
    Scene scene;
    map_materials(read, ka, scene, notices);
    scene.objects = {{"ball", 0, SphereShape{}}};
    if (!scene.materials.empty()) {
      expect_ok(validate(scene), "the scene of these materials");
    }
  }
  return 0;
}
