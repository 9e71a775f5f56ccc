// Fuzz tests of a scene's files and bytes: reading gives a valid value, or an error with its place.
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include "common/base/file.h"
#include "common/scene/mesh.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/load.h"
#include "common/scene_io/obj.h"
#include "common/wire/scene_json.h"
#include "tests/fuzz/fuzz_loop.h"
#include "tests/fuzz/scene_target.h"
#include "tests/support/paths.h"

namespace lightmill {
namespace {

const int kSceneRounds = fuzz_cases(5000);

const std::filesystem::path kScenes = test::source_file("scenes");

std::string shipped(const std::string& name) {
  const Result<std::string> text = read_file(kScenes / name);
  EXPECT_TRUE(text.ok()) << text.status();
  return *text;
}

LoadedScene shipped_scene() {
  const std::array<std::filesystem::path, 1> paths{kScenes / "cornell-course-balls"};
  Result<LoadedScene> loaded = load_scene(paths);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return *std::move(loaded);
}

TEST(SceneFuzz, DamagedDocumentsAreReadOrRefused) {
  constexpr std::array<std::string_view, 22> kWords{"1e999",     "NaN",
                                                    "-Infinity", "null",
                                                    "true",      "[[[[",
                                                    "{{{{",      "]",
                                                    "}",         "\"",
                                                    "\\u0000",   "-1",
                                                    "1e-9",      "99999999999999999999",
                                                    ",",         ":",
                                                    "0.5",       "\"rgb\"",
                                                    "\"mesh\"",  "\"name\": \"x\",",
                                                    "\xff",      " "};
  const auto read = [&](const std::string& original, FuzzRandom& random) {
    const Result<SceneFile> file = read_scene_json(mutate(original, kWords, random), "fuzz.json");
    if (file.ok()) {
      EXPECT_TRUE(validate(file->draft.scene).ok());
      EXPECT_EQ(file->draft.material_by_face.size(), file->draft.scene.objects.size());
    } else {
      EXPECT_TRUE(message_of(file.status()).starts_with("fuzz.json:")) << file.status();
    }
    return file.ok();
  };
  expect_both_outcomes({shipped("cornell-course-balls.json")}, 1, kSceneRounds, read);
}

TEST(SceneFuzz, DamagedMeshFilesAreReadOrRefused) {
  constexpr std::array<std::string_view, 20> kWords{"-1", "1e999", "nan",  "0",   "4294967296", "-9223372036854775808",
                                                    "/",  "//",    "\\\n", "\n",  "\r\n",       "#",
                                                    "f ", "v ",    "vn ",  "1/1", "1//1",       "usemtl ",
                                                    "\t", "1e-320"};
  const std::string original = shipped("assets/CornellBlocks.obj") + "vn 0 0 1\nvt 0 0\nf 1//1 2/1/1 3//-1\n";
  expect_both_outcomes({original}, 2, kSceneRounds, [&](const std::string& whole, FuzzRandom& random) {
    Faults faults;
    const Result<ObjFile> file = read_obj(mutate(whole, kWords, random), "fuzz.obj", faults);
    if (!file.ok()) {
      EXPECT_TRUE(message_of(file.status()).starts_with("fuzz.obj:")) << file.status();
      return false;
    }
    for (const ObjPart& part : file->parts) {
      const ObjPart* const only = &part;
      const Status valid = validate(make_mesh(*file, std::span(&only, 1)));
      EXPECT_TRUE(valid.ok()) << valid;
    }
    return true;
  });
}

TEST(SceneFuzz, DamagedMaterialFilesAreReadOrRefused) {
  constexpr std::array<std::string_view, 14> kWords{"Ka ",      "Ke 1 1 1\n", "Ks ",  "illum 4\n", "illum 99\n",
                                                    "Ni 1.5\n", "newmtl ",    "-1",   "nan",       "\\\n",
                                                    "\n",       "map_Kd x\n", "1e30", "0"};
  const auto read_damaged = [&](const std::string& original, FuzzRandom& random) {
    Faults faults;
    std::vector<MtlMaterial> read = read_mtl(mutate(original, kWords, random), "fuzz.mtl", faults);
    EXPECT_TRUE(faults.empty() || message_of(faults.as_error()).starts_with("fuzz.mtl:")) << faults.as_error();
    std::set<std::string> names;
    std::erase_if(read, [&](const MtlMaterial& material) { return !names.insert(material.name).second; });
    std::vector<std::string> notices;
    Scene scene;
    map_materials(read, KaMeaning::automatic, scene, notices);
    scene.objects = {{"ball", 0, SphereShape{}}};
    EXPECT_TRUE(scene.materials.empty() || validate(scene).ok()) << validate(scene);
    return faults.empty();
  };
  expect_both_outcomes({shipped("assets/CornellBox.mtl")}, 3, kSceneRounds, read_damaged);
}

TEST(SceneFuzz, DamagedGltfScenesAreReadOrRefused) {
  constexpr std::array<std::string_view, 20> kWords{"\"byteOffset\":1,",
                                                    "\"byteStride\":4,",
                                                    "\"normalized\":true,",
                                                    "\"sparse\":{\"count\":1},",
                                                    "\"mesh\":0,",
                                                    "\"skin\":0,",
                                                    "\"children\":[0],",
                                                    "\"matrix\":[",
                                                    "\"weights\":[1e300],",
                                                    "\"CUBICSPLINE\"",
                                                    "\"extensions\":{",
                                                    "\"uri\":\"data:;base64,AAAA\",",
                                                    "{",
                                                    "}",
                                                    "[",
                                                    "]",
                                                    "1e300",
                                                    "-1",
                                                    "4294967296",
                                                    "null"};
  std::vector<std::string> originals;
  for (const char* name : {"all.gltf", "all.glb", "posed.gltf", "compressed.gltf", "draco.gltf"}) {
    originals.push_back(read_file(test::source_file(std::string("tests/fuzz/seeds/gltf/") + name)).value());
    EXPECT_TRUE(fuzz::try_gltf(originals.back())) << name;
  }
  expect_both_outcomes(originals, 8, kSceneRounds / 5, [&](const std::string& whole, FuzzRandom& random) {
    return fuzz::try_gltf(mutate(whole, kWords, random));
  });
}

TEST(SceneFuzz, DamagedPbrtScenesAreReadOrRefused) {
  constexpr std::array<std::string_view, 20> kWords{"AttributeBegin ",
                                                    "AttributeEnd ",
                                                    "ObjectBegin \"a\" ",
                                                    "ObjectEnd ",
                                                    "WorldBegin ",
                                                    "Shape \"sphere\" ",
                                                    "\"float ",
                                                    "\"rgb ",
                                                    "\"texture ",
                                                    "Include \"more.pbrt\" ",
                                                    "[",
                                                    "]",
                                                    "\"",
                                                    "1e300",
                                                    "-1",
                                                    "0 ",
                                                    "4294967296",
                                                    "nan",
                                                    "\n",
                                                    "\\"};
  const std::string original = read_file(test::source_file("tests/fuzz/seeds/pbrt/all.pbrt")).value();
  EXPECT_TRUE(fuzz::try_pbrt(original));
  expect_both_outcomes({original}, 6, kSceneRounds / 25, [&](const std::string& whole, FuzzRandom& random) {
    return fuzz::try_pbrt(mutate(whole, kWords, random));
  });
}

TEST(SceneFuzz, DamagedMitsubaScenesAreReadOrRefused) {
  constexpr std::array<std::string_view, 20> kWords{"<shape type=\"sphere\">",
                                                    "</shape>",
                                                    "<bsdf type=\"",
                                                    "</bsdf>",
                                                    "<ref id=\"gold\"/>",
                                                    "<ref id=\"group\"/>",
                                                    "<include filename=\"more.xml\"/>",
                                                    "name=\"",
                                                    "value=\"",
                                                    "$size",
                                                    "<scale value=\"0\"/>",
                                                    "/>",
                                                    "\"",
                                                    "1e300",
                                                    "-1",
                                                    "0 ",
                                                    "4294967296",
                                                    "nan",
                                                    "\n",
                                                    "&"};
  const std::string original = read_file(test::source_file("tests/fuzz/seeds/mitsuba/all.xml")).value();
  EXPECT_TRUE(fuzz::try_mitsuba(original));
  expect_both_outcomes({original}, 7, kSceneRounds / 25, [&](const std::string& whole, FuzzRandom& random) {
    return fuzz::try_mitsuba(mutate(whole, kWords, random));
  });
}

TEST(SceneFuzz, DamagedPackedScenesAreReadOrRefused) {
  const google::protobuf::LogSilencer quiet;  // it reports each name that is not UTF-8
  constexpr std::array<std::string_view, 6> kWords{"\xff\xff\xff\xff\x0f",
                                                   std::string_view("\0", 1),
                                                   "\x0a\x7f",
                                                   "white",
                                                   "\x12",
                                                   std::string_view("\0\0\0\0\0\0\xf8\x7f", 8)};
  const auto read = [&](const std::string& original, FuzzRandom& random) {
    const Result<Scene> scene = unpack_scene(mutate(original, kWords, random));
    if (scene.ok()) {
      const std::string packed = pack_scene(*scene);
      const Result<Scene> again = unpack_scene(packed);
      EXPECT_TRUE(again.ok() && pack_scene(*again) == packed) << again.status();
    } else {
      EXPECT_FALSE(message_of(scene.status()).empty());
    }
    return scene.ok();
  };
  expect_both_outcomes({pack_scene(shipped_scene().scene)}, 4, 4 * kSceneRounds, read);
}

TEST(SceneFuzz, DamagedMeshBytesAreReadOrRefused) {
  constexpr std::array<std::string_view, 4> kWords{"\xff\xff\xff\xff", std::string_view("\0\0\0\0", 4), "LMM1",
                                                   std::string_view("\0\0\0\0\0\0\xf0\x7f", 8)};
  std::vector<std::string> originals;
  for (const auto& [digest, bytes] : shipped_scene().assets) {
    originals.push_back(bytes);
  }
  expect_both_outcomes(originals, 5, 4 * kSceneRounds, [&](const std::string& original, FuzzRandom& random) {
    const std::string bytes = mutate(original, kWords, random);
    const Result<Mesh> mesh = decode_mesh(as_byte_view(bytes));
    if (mesh.ok()) {
      EXPECT_EQ(encode_mesh(*mesh), bytes);
    } else {
      EXPECT_TRUE(message_of(mesh.status()).starts_with("mesh: ")) << mesh.status();
    }
    return mesh.ok();
  });
}

}  // namespace
}  // namespace lightmill
