// Materials of scenes that are loaded from files.
#include "common/wire/scene_proto.h"
#include "tests/unit/scene_io/gltf_text.h"
#include "tests/unit/scene_io/load_fixture.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

using test::kTriangles;
using test::Load;

TEST_F(Load, ObjFilesBringTheirMaterials) {
  write("a.mtl", "newmtl red\nKd 0.5 0 0\nnewmtl green\nKd 0 1 0\nKa 2 2 2\n");
  write("b.mtl", "newmtl red\nKd 0.25 0 0\nnewmtl green\nKd 0 1 0\nKa 2 2 2\n");
  const auto a = write("a.obj", "mtllib a.mtl\n" + kTriangles);
  const auto b = write("b.obj", "mtllib b.mtl\n" + kTriangles);
  const Result<LoadedScene> loaded = load({a, b});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  const Scene& scene = loaded->scene;
  EXPECT_EQ(scene.name, "a+b");
  ASSERT_EQ(scene.materials.size(), 3u);
  EXPECT_EQ(scene.materials[0].name, "green");
  EXPECT_EQ(scene.materials[0].emission, (RgbColor{2, 2, 2}));
  EXPECT_TRUE(scene.materials[0].two_sided_emission);
  EXPECT_EQ(scene.materials[1].name, "red");
  EXPECT_EQ(scene.materials[2].name, "red (b.mtl)");
  ASSERT_EQ(scene.objects.size(), 4u);
  EXPECT_EQ(scene.objects[2].material, 0u);
  EXPECT_EQ(scene.objects[3].material, 2u);
  EXPECT_EQ(loaded->notices.at(0), "Ka was read as emission, because only some materials have it: green");
  EXPECT_TRUE(scene.lights.empty());
}

TEST_F(Load, SeveralLibrariesAndNamesWithBlanksAreRead) {
  write("a.mtl", "newmtl red\nKd 0.5 0 0\n");
  write("b.mtl", "newmtl green\nKd 0 1 0\n");
  write("both of them.mtl", "newmtl red\nKd 0.5 0 0\nnewmtl green\nKd 0 1 0\n");
  for (const char* names : {"a.mtl b.mtl", "b.mtl\ta.mtl", "both of them.mtl"}) {
    const Result<LoadedScene> loaded = load({write("a.obj", fmt::format("mtllib {}\n", names) + kTriangles)});
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    EXPECT_EQ(loaded->scene.materials.size(), 2u) << names;
  }
}

TEST_F(Load, AnOptionDecidesTheMeaningOfKa) {
  write("a.mtl", "newmtl red\nKd 0.5 0 0\nKa 1 1 1\nnewmtl green\nKd 0 1 0\nKa 1 1 1\n");
  const auto path = write("a.obj", "mtllib a.mtl\n" + kTriangles);
  LoadOptions options;
  EXPECT_TRUE(load({path})->scene.materials[0].emission == RgbColor{});
  options.ka = KaMeaning::emission;
  EXPECT_TRUE((load({path}, options)->scene.materials[0].emission == RgbColor{1, 1, 1}));
}

TEST_F(Load, MapsBringTheirImages) {
  fs::create_directories(folder_ / "more");
  write("more/wood.png", "an image's bytes");
  write("a.mtl", "newmtl red\nmap_Kd more\\wood.png\nnewmtl green\nmap_Kd more/wood.png\n");
  const auto path = write("a.obj", "mtllib a.mtl\n" + kTriangles);
  const Result<LoadedScene> loaded = load({path});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->scene.textures.size(), 1u);
  EXPECT_EQ(loaded->assets.at(loaded->scene.textures[0].asset), "an image's bytes");
  EXPECT_TRUE(unpack_scene(pack_scene(loaded->scene)).ok());
  ASSERT_EQ(loaded->images.size(), 2u);  // with the sky's
  EXPECT_EQ(loaded->images[0].asset, loaded->scene.textures[0].asset);
  EXPECT_FALSE(loaded->images[0].environment);
  EXPECT_EQ(without_folder(loaded->images[0].place), "a.mtl:4: map_Kd of material \"green\"");
}

TEST_F(Load, MapsOfTilesBringAllTheirImages) {
  fs::create_directory(write("a.txt", "").parent_path() / "maps");
  write("maps/Wall.1001.png", "one");
  write("maps/Wall.1011.png", "two");
  write("a.mtl", "newmtl red\nmap_Kd maps\\wall.<UDIM>.png\nmap_Pr none.<UDIM>.png\n");
  const Result<LoadedScene> loaded = load({write("a.obj", "mtllib a.mtl\n" + kTriangles)});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  const std::vector<TextureImage>& textures = loaded->scene.textures;
  ASSERT_EQ(textures.size(), 2u);
  EXPECT_TRUE(textures[0].file.ends_with("maps/Wall.1001.png")) << textures[0].file;
  EXPECT_EQ(textures[0].tile, 1001);
  EXPECT_EQ(textures[0].asset, sha256("one"));
  EXPECT_EQ(textures[1].tile, 1011);
  EXPECT_EQ(textures[1].tile_of, 0u);
  EXPECT_EQ(textures[1].asset, sha256("two"));
}

TEST_F(Load, DigitsAfterTheTileNumberAreIgnored) {
  write("wall.1001.v1001.png", "one");
  write("wall.1002.v1001.png", "two");
  write("a.mtl", "newmtl red\nmap_Kd wall.<UDIM>.v1001.png\nmap_Ks <UDIM>/wall.png\n");
  const Result<LoadedScene> loaded = load({write("a.obj", "mtllib a.mtl\n" + kTriangles)});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->scene.textures.size(), 2u);
  EXPECT_EQ(loaded->scene.textures[1].asset, sha256("two"));
}

TEST_F(Load, MapsWithoutTheirImageAreLeftOut) {
  fs::create_directories(folder_ / "glow.png");  // a folder is no image
  write("a.mtl", "newmtl red\nKd 0.5 0.25 0\nmap_Kd more\\wood.png\nnewmtl green\nKe 1 1 1\nmap_Ke glow.png\n");
  const Result<LoadedScene> loaded = load({write("a.obj", "mtllib a.mtl\n" + kTriangles)});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_TRUE(loaded->scene.textures.empty());
  const Material& red = *std::ranges::find(loaded->scene.materials, "red", &Material::name);
  EXPECT_EQ(std::get<DiffuseMaterial>(red.kind).reflectance.rgb, (RgbColor{0.5f, 0.25f, 0}));
  for (const Material& material : loaded->scene.materials) {
    EXPECT_EQ(material.emission, TexturedColor{});  // most of an emissive map is black
  }
  EXPECT_EQ(faults_of(*loaded),
            (std::vector<std::string>{
                "a.mtl:6: map_Ke of material \"green\": there is no file glow.png. The map is left out",
                "a.mtl:3: map_Kd of material \"red\": there is no file more\\wood.png. The map is left out"}));
}

TEST_F(Load, MeaninglessMtlNumbersAreLeftOut) {
  write("a.mtl", "newmtl red\nillum 4\nNi 0\nmap_Kd\nnewmtl green\nKs 0.5 0.5 0.5\nNs -1\nillum 2\nd 2\nTr -1\n");
  const Result<LoadedScene> loaded = load({write("a.obj", "mtllib a.mtl\n" + kTriangles)});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(std::get<DielectricMaterial>(loaded->scene.materials[1].kind).ior, 1.5);
  EXPECT_EQ(std::get<PhongMaterial>(loaded->scene.materials[0].kind).exponent, PhongMaterial().exponent);
  EXPECT_EQ(faults_of(*loaded),
            (std::vector<std::string>{
                "a.mtl:3: Ni: a number in (0, 10] is expected, got \"0\". The line is skipped",
                "a.mtl:4: map_Kd: the name of a file is expected. The line is skipped",
                "a.mtl:7: Ns: a number from 0 to 1000000000 is expected, got \"-1\". The line is skipped",
                "a.mtl:9: d: a number from 0 to 1 is expected, got \"2\". The line is skipped",
                "a.mtl:10: Tr: a number from 0 to 1 is expected, got \"-1\". The line is skipped"}));
}

TEST_F(Load, TheFirstMaterialOfANameCounts) {
  write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl red\nKd 1 0 0\nnewmtl red\nKd 0 1 0\n");
  write("b.mtl", "newmtl red\nKd 0 0 1\n");
  const Result<LoadedScene> loaded = load(
      {write("a.obj", "mtllib a.mtl\nmtllib b.mtl\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n")});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->scene.materials.size(), 1u);
  EXPECT_EQ(std::get<DiffuseMaterial>(loaded->scene.materials[0].kind).reflectance.rgb, (RgbColor{1, 0, 0}));
  std::vector<std::string> notices;
  for (const std::string& notice : loaded->notices) {
    if (notice.starts_with("left out")) {
      notices.push_back(without_folder(notice));
    }
  }
  EXPECT_EQ(notices,
            (std::vector<std::string>{"left out: a.mtl:5: material \"red\", which a.mtl:1 defines differently",
                                      "left out: b.mtl:1: material \"red\", which a.mtl:1 defines differently"}));
}

}  // namespace
}  // namespace lightmill
