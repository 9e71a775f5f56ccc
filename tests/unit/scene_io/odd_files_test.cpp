// Files with faults: wrong lines that programs write, and renamed files.
#include "tests/unit/scene_io/gltf_text.h"
#include "tests/unit/scene_io/load_fixture.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

using test::kTriangles;

/// A folder with a library of materials.
class FaultyFile : public test::Load {
 protected:
  void SetUp() override {
    Load::SetUp();
    fs::create_directories(folder_ / "parts");
    write("parts/colours.mtl", "newmtl red\nKd 1 0 0\n");
  }
  LoadedScene good(const fs::path& path) {
    Result<LoadedScene> loaded = load({path});
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    return std::move(loaded).value_or(LoadedScene());
  }
  /// One red triangle, with this library.
  LoadedScene with_library(const std::string& name) {
    return good(write("a.obj", "mtllib " + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"));
  }
  static RgbColor colour_of(const LoadedScene& loaded) {
    EXPECT_EQ(loaded.scene.materials.size(), 1u);
    return std::get<DiffuseMaterial>(loaded.scene.materials.at(0).kind).reflectance.rgb;
  }
};
using Texts = std::vector<std::string>;

constexpr RgbColor kRed{1, 0, 0}, kGrey{0.5f, 0.5f, 0.5f};

TEST_F(FaultyFile, AMissingLibraryMakesItsMaterialsGrey) {
  for (const std::string name : {"not-here.mtl", "not here.mtl"}) {
    const LoadedScene loaded = with_library(name);
    EXPECT_EQ(colour_of(loaded), kGrey);
    EXPECT_EQ(loaded.scene.materials[0].name, "red");
    EXPECT_EQ(faults_of(loaded),
              Texts{fmt::format("a.obj:1: mtllib: there is no file {}. Its materials are rendered as "
                                "grey diffuse",
                                name)});
    EXPECT_EQ(without_folder(loaded.notices[0]), faults_of(loaded)[0]);
  }
}

// Scanners write colours of vertices and no material.
TEST_F(FaultyFile, FacesWithoutAMaterialShowTheColoursOfTheirVertices) {
  const LoadedScene loaded = good(write("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n"));
  EXPECT_EQ(colour_of(loaded), (RgbColor{1, 1, 1}));
  const std::string& said = loaded.notices.at(0);
  EXPECT_TRUE(said.ends_with("a.obj: faces before the first usemtl are rendered as white diffuse")) << said;
}

TEST_F(FaultyFile, OtherLibrariesOfTheLineAreRead) {
  const LoadedScene loaded = with_library("not-here.mtl parts/colours.mtl");
  EXPECT_EQ(colour_of(loaded), kRed);
  EXPECT_EQ(faults_of(loaded),
            Texts{"a.obj:1: mtllib: there is no file not-here.mtl. Its materials are rendered as grey diffuse"});
}

// A path of Windows, another case, a folder of the machine where the file was made.
TEST_F(FaultyFile, FilesAreFoundInOtherSpellings) {
  for (const std::string name : {".\\parts\\colours.mtl", "PARTS/Colours.MTL", "parts/../PARTS\\COLOURS.mtl"}) {
    const LoadedScene loaded = with_library(name);
    EXPECT_EQ(colour_of(loaded), kRed) << name;
    EXPECT_EQ(faults_of(loaded),
              Texts{fmt::format("a.obj:1: mtllib: there is no file {}. Instead, parts/colours.mtl is read", name)});
  }
  write("Beside.mtl", "newmtl red\nKd 1 0 0\n");
  for (const std::string name : {"C:\\Users\\x\\beside.mtl", "/data/x/Beside.mtl", "elsewhere/Beside.mtl"}) {
    EXPECT_EQ(colour_of(with_library(name)), kRed) << name;
  }
  write("Two words.mtl", "newmtl red\nKd 1 0 0\n");
  EXPECT_EQ(colour_of(with_library("two WORDS.mtl")), kRed);
  EXPECT_TRUE(faults_of(with_library("./parts//colours.mtl")).empty());
  EXPECT_TRUE(faults_of(with_library("assets/../parts/colours.mtl")).empty());
}

TEST_F(FaultyFile, MapsAreFoundInOtherSpellings) {
  write("parts/Wood.PNG", "an image's bytes");
  write("parts/colours.mtl", "newmtl red\nmap_Kd wood.png\n");
  const LoadedScene loaded = with_library("parts/colours.mtl");
  ASSERT_EQ(loaded.images.size(), 2u);  // with the sky's
  EXPECT_EQ(faults_of(loaded), Texts{"parts/colours.mtl:2: map_Kd of material \"red\": there is no file wood.png. "
                                     "Instead, Wood.PNG is read"});
}

TEST_F(FaultyFile, GltfFilesAreFoundInOtherSpellings) {
  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  write("parts/My Data.BIN", buffer.bytes());
  const LoadedScene loaded = good(write(
      "a.gltf", test::gltf(buffer.members("Parts%5Cmy%20data.bin") +
                           R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}])")));
  EXPECT_EQ(faults_of(loaded),
            Texts{"a.gltf: buffers[0].uri: there is no file Parts\\my data.bin. Instead, parts/My Data.BIN is "
                  "read"});
}

TEST_F(FaultyFile, UnknownMaterialsAreGrey) {
  const std::string text =
      "mtllib parts/colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl (null)\nf 1 2 3\nusemtl red\n"
      "f 1 2 3\nusemtl None\nf 1 2 3\n";
  const LoadedScene loaded = good(write("a.obj", text));
  ASSERT_EQ(loaded.scene.materials.size(), 3u);
  EXPECT_EQ(loaded.scene.materials[0].name, "(null)");
  EXPECT_EQ(std::get<DiffuseMaterial>(loaded.scene.materials[0].kind).reflectance.rgb, kGrey);
  EXPECT_EQ(std::get<DiffuseMaterial>(loaded.scene.materials[1].kind).reflectance.rgb, kRed);
  EXPECT_EQ(faults_of(loaded),
            Texts{"a.obj:5: unknown material \"(null)\". Known materials: red. Its faces are rendered as grey "
                  "diffuse (and 1 more like it)"});
}

TEST_F(FaultyFile, AStrictReaderRefusesFaults) {
  LoadOptions strict;
  strict.strict = true;
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(error({write("a.obj", triangle)}, strict), "no error");
  EXPECT_EQ(error({write("a.obj", triangle + "odd\nf 1 2 9\n")}, strict),
            "--strict: a.obj:5: unknown statement \"odd\". Known statements: v, vt, vn, f, o, g, s, usemtl, mtllib");
  EXPECT_EQ(error({write("a.obj", "mtllib none.mtl\n" + triangle)}, strict),
            "--strict: a.obj:1: mtllib: there is no file none.mtl");
  write("a.mtl", "newmtl a\nKd 1\nKd 1 2\n");
  EXPECT_EQ(error({write("a.obj", "mtllib a.mtl\n" + triangle)}, strict),
            "--strict: a.mtl:3: Kd: three numbers are expected, got 2");
  write("assets/m.obj", triangle + "f 1 2\n");
  const auto json = write("a.json", document(R"([{"material": "red", "mesh": {"file": "assets/m.obj"}}])"));
  EXPECT_EQ(error({json}, strict), "--strict: assets/m.obj:5: f: at least 3 corners are expected, got 2");
  EXPECT_EQ(error({json}), "no error");
  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string gltf = test::gltf(buffer.embedded() + R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0},
"material":0}]}],"materials":[{"pbrMetallicRoughness":{"roughnessFactor":2}}],"nodes":[{"mesh":0}])");
  EXPECT_EQ(
      error({write("a.gltf", gltf)}, strict),
      "--strict: a.gltf: materials[0].pbrMetallicRoughness.roughnessFactor: a number from 0 to 1 is expected, got 2");
}

// Of each kind of thing, in each format.
TEST_F(FaultyFile, LongNamesAreCut) {
  std::string name;
  for (int i = 0; i < 600; ++i) {
    name += "é";
  }
  const auto expect_cut = [](const std::string& of_thing) {
    EXPECT_LE(of_thing.size(), 1000u);
    EXPECT_TRUE(of_thing.starts_with("éé") && of_thing.ends_with("é…")) << of_thing;
  };
  write("long.mtl", "newmtl " + name + "\nKd 1 0 0\n");
  const LoadedScene obj =
      good(write("a.obj", "mtllib long.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl " + name + "\nf 1 2 3\n"));
  EXPECT_EQ(colour_of(obj), kRed);
  expect_cut(obj.scene.materials[0].name);

  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string named = fmt::format(R"("name":"{}")", name);
  const LoadedScene gltf = good(write(
      "a.gltf",
      test::gltf(buffer.embedded() +
                 fmt::format(
                     R"(,"extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[
                        {{"type":"point",{0}}}]}}}},"materials":[{{{0}}}],"meshes":[{{"primitives":[
                        {{"attributes":{{"POSITION":0}},"material":0}}]}}],"nodes":[{{{0},"mesh":0}},
                        {{{0},"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],"scenes":[{{"nodes":[0,1]}}])",
                     named))));
  ASSERT_EQ(gltf.scene.lights.size(), 1u);
  expect_cut(gltf.scene.materials.at(0).name);
  expect_cut(gltf.scene.objects.at(0).name);
  expect_cut(gltf.scene.lights[0].name);

  const LoadedScene mitsuba = good(
      write("a.xml", fmt::format(R"(<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere" id="{0}">
                 <bsdf type="diffuse" id="{0}2"/></shape><emitter type="point" id="{0}3"/></scene>)",
                                 name)));
  expect_cut(mitsuba.scene.materials.at(0).name);
  expect_cut(mitsuba.scene.objects.at(0).name);
  expect_cut(mitsuba.scene.lights.at(0).name);
}

}  // namespace
}  // namespace lightmill
