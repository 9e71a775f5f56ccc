#include "common/scene_io/load.h"

#include <cmath>
#include <numbers>

#include "common/base/text.h"
#include "common/scene/mesh.h"
#include "common/wire/scene_proto.h"
#include "tests/unit/scene_io/gltf_text.h"
#include "tests/unit/scene_io/load_fixture.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

using test::kTriangles;
using test::Load;

Mesh mesh_of(const LoadedScene& loaded, std::size_t object) {
  const auto& shape = std::get<MeshShape>(loaded.scene.objects[object].shape);
  const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(shape.asset)));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *mesh;
}

TEST_F(Load, FacesFindTheDocumentsMaterials) {
  write("assets/a.obj", kTriangles);
  const auto path = write("scene.json", document(R"([{"name": "thing", "mesh": {"file": "assets/a.obj"}}])"));
  const Result<LoadedScene> loaded = load({path});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->scene.objects.size(), 2u);
  EXPECT_EQ(loaded->scene.name, "scene");
  EXPECT_EQ(loaded->scene.objects[0].name, "thing/green");
  EXPECT_EQ(loaded->scene.objects[0].material, 1u);
  EXPECT_EQ(mesh_of(*loaded, 0).triangles.size(), 2u);
  EXPECT_EQ(loaded->scene.objects[1].material, 0u);
  EXPECT_EQ(mesh_of(*loaded, 1).triangles.size(), 2u);
  EXPECT_EQ(loaded->assets.size(), 2u);
  for (const auto& [digest, bytes] : loaded->assets) {
    EXPECT_EQ(sha256(bytes), digest);
  }
  EXPECT_TRUE(unpack_scene(pack_scene(loaded->scene)).ok());
}

TEST_F(Load, AMeshUsedTwiceIsOneAsset) {
  write("assets/a.obj", kTriangles);
  const auto path = write("scene.json", document(R"([{"material": "red", "mesh": {"file": "assets/a.obj"}},
    {"material": "green", "mesh": {"file": "assets/a.obj"}}])"));
  const Result<LoadedScene> loaded = load({path});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->scene.objects.size(), 2u);
  EXPECT_EQ(mesh_of(*loaded, 0).triangles.size(), 4u);
  EXPECT_EQ(loaded->scene.objects[1].material, 1u);
  EXPECT_EQ(loaded->assets.size(), 1u);  // the same mesh twice is one asset
}

TEST_F(Load, ADocumentWithoutExtensionIsRead) {
  write("assets/a.obj", kTriangles);
  write("scene.json", document(R"([{"mesh": {"file": "assets/a.obj"}}])"));
  EXPECT_TRUE(load({folder_ / "scene"}).ok());
  EXPECT_TRUE(load({folder_ / "scene.json"}).ok());
}

TEST_F(Load, BadFilesAreNamed) {
  EXPECT_EQ(error({folder_ / "none"}), "none: no such file");
  EXPECT_EQ(error({folder_ / "none.json"}), "none.json: no such file");
  EXPECT_EQ(error({folder_ / "none.obj"}), "none.obj: no such file");
  std::filesystem::create_directory(folder_ / "farm");
  EXPECT_TRUE(error({folder_ / "farm"}).starts_with("farm is not a file: a scene document"))
      << error({folder_ / "farm"});
  for (const char* const name : {"empty.gltf", "empty.glb", "empty.ply", "empty.stl", "empty.pbrt", "empty.xml"}) {
    EXPECT_EQ(error({write(name, "")}), std::string(name) + ": the file is empty");
  }
  EXPECT_EQ(error({write("empty.json", "")}), "empty.json:1:1: the file is empty");
  EXPECT_EQ(
      error({write("a.fbx", "")}),
      "a.fbx: a scene document (.json), Wavefront files (.obj), a glTF file (.gltf, .glb), a mesh (.ply, .stl), a pbrt "
      "scene (.pbrt), a Mitsuba scene (.xml) or a .blend file is expected");
  EXPECT_EQ(error({}),
            "a scene document (.json), Wavefront files (.obj), a glTF file (.gltf, .glb), a mesh (.ply, .stl), a pbrt "
            "scene (.pbrt), a Mitsuba scene (.xml) or a .blend file is expected, got none");
  const auto json = write("scene.json", document(R"([{"mesh": {"file": "assets/a.obj"}}])"));
  EXPECT_EQ(
      error({json, json}),
      "one scene document, one glTF file, one mesh, one pbrt or Mitsuba scene or any number of .obj files are expected, got 2 files that are not all .obj");
  EXPECT_EQ(error({json}),
            "scene.json:3:31: objects[0].mesh.file: cannot open assets/a.obj: No such file or directory");
  write("assets/a.obj", "v 0 0 0\n");
  EXPECT_EQ(
      error({json}),
      "scene.json:3:31: objects[0].mesh.file: assets/a.obj: the mesh is empty, at least one face (f) is expected");
  write("assets/a.obj", "v 0 0 0\nf 1 1 2\n");
  EXPECT_EQ(error({json}),
            "scene.json:3:31: objects[0].mesh.file: assets/a.obj:2: f: index 2 is out of range, there are 1 vertices");
  write("assets/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl blue\nf 1 2 3\n");
  EXPECT_EQ(error({json}),
            "scene.json:3:31: objects[0].mesh.file: assets/a.obj:4: unknown material \"blue\". Known materials: red, "
            "green");
  write("assets/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(error({json}),
            "scene.json:3:31: objects[0].mesh.file: assets/a.obj has faces before its first usemtl, and the object "
            "names no material");
}

TEST_F(Load, MissingFilesNameTheScriptThatFetchesThem) {
  const auto json = write("scene.json", document(R"([{"mesh": {"file": "assets/a.obj"}}])"));
  const std::string missing =
      "scene.json:3:31: objects[0].mesh.file: cannot open assets/a.obj: No such file or directory";
  EXPECT_EQ(error({json}), missing);
  write("get-models", "");
  EXPECT_EQ(error({json}), missing + ". Run get-models to fetch the models");
  write("assets/a.obj", "v 0 0 0\n");
  EXPECT_EQ(error({json}).find("get-models"), std::string::npos);
}

TEST_F(Load, PowersNeedAnArea) {
  const auto of = [&](const std::string& shape, const std::string& more = "") {
    write("scene.json", R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1}, "materials": [
{"name": "red", "mirror": {}},
{"name": "lamp", "mirror": {}, "emission_strength": {"lumen": 800}}],
"objects": [{"material": "lamp", )" +
                            shape + R"(}, {"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}})" + more +
                            "]}");
    return error({folder_ / "scene.json"});
  };
  const std::string none =
      "scene.json:3:1: materials[1]: \"lamp\" states a power (emission_flux, or emission_strength in watt or lumen), "
      "but its surfaces have no area";
  write("assets/line.obj", "v 0 0 0\nv 1 2 3\nv 2 4 6\nf 1 2 3\nf 1 2 2\n");
  write("assets/face.obj", "v 0 0 0\nv 1 2 3\nv 2 4 7\nf 1 2 2\nf 1 2 3\n");
  EXPECT_EQ(of(R"("mesh": {"file": "assets/line.obj"})"),
            "scene.json:4:51: objects[0].mesh.file: assets/line.obj:4: f: this face and all others have no area");
  EXPECT_EQ(of(R"("triangle": {"a": [1, 1, 1], "b": [2, 2, 2], "c": [3, 3, 3]})"), none);
  EXPECT_EQ(of(R"("mesh": {"file": "assets/face.obj"})"), "no error");
  EXPECT_EQ(of(R"("triangle": {"a": [1, 1, 1], "b": [2, 2, 2], "c": [3, 3, 4]})"), "no error");
  EXPECT_EQ(of(R"("triangle": {"a": [1, 1, 1], "b": [2, 2, 2], "c": [3, 3, 3]})",
               R"(, {"material": "lamp", "sphere": {"center": [0, 0, 0], "radius": 1}})"),
            "no error");
  EXPECT_NE(of(R"("sphere": {"center": [0, 0, 0], "radius": 1})",
               R"(, {"material": "lamp", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}})")
                .find("objects[2].plane: its material \"lamp\" states a power (materials[1].emission_flux"),
            std::string::npos);
}

TEST_F(Load, ShadowCatcherMistakesAreReportedWithTheirPlace) {
  write("assets/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl hole\nf 1 2 3\n");
  const auto json = write("scene.json", R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1},
"materials": [{"name": "hole", "shadow_catcher": {}},
{"name": "lamp", "mirror": {}, "emission": {"rgb": [1, 1, 1]}, "emission_exponent": 3}],
"objects": [{"material": "lamp", "sphere": {"center": [0, 0, 0], "radius": 1}}, {"mesh": {"file": "assets/a.obj"}}]})");
  EXPECT_EQ(error({json}),
            "scene.json:3:85: materials[1].emission_exponent: \"lamp\", of objects[0], emits with an exponent, which "
            "is not possible in a scene with a shadow catcher (objects[1])");
}

TEST_F(Load, ADocumentsImagesAreListedWithTheirPlaces) {
  write("a.png", "a texture");
  write("b.exr", "a sky");
  std::string text = document(R"([{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "red"}])");
  text.insert(text.size() - 1, R"(,
"textures": [{"name": "wood", "file": "a.png"}],
"lights": [{"environment": {"file": "b.exr"}}])");
  const Result<LoadedScene> loaded = load({write("a.json", text)});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->images.size(), 2u);
  const auto expect = [&](const ImageAsset& image, const std::string& name, const std::string& place,
                          const std::string& bytes) {
    EXPECT_EQ(image.name, name);
    EXPECT_EQ(image.place, folder_.string() + "/a.json:" + place);
    EXPECT_EQ(loaded->assets.at(image.asset), bytes);
    EXPECT_EQ(image.environment, name == "b.exr");
  };
  expect(loaded->images[0], "a.png", "4:39: textures[0].file", "a texture");
  expect(loaded->images[1], "b.exr", "5:37: lights[0].environment.file", "a sky");
}

// Downloaded models often come without their images.
TEST_F(Load, EndingsMayBeInCapitals) {
  write("a.mtl", "newmtl red\nnewmtl green\n");
  EXPECT_EQ(error({write("A.OBJ", "mtllib a.mtl\n" + kTriangles)}), "no error");
  EXPECT_EQ(
      error({write("A.JSON", document(R"([{"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}}])"))}),
      "no error");
}

TEST_F(Load, IesTiltFactorsAreReportedAsLeftOut) {
  write("lamp.ies",
        "IESNA:LM-63-2002\nTILT=INCLUDE\n1\n2\n0 90\n1 0.5\n1 -1 1 2 1 1 1 .1 .1 .1\n1 1 100\n0 90\n0\n9 9\n");
  const auto loaded = load({write("scene.json", R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0],
"camera_constant": 1}, "materials": [{"name": "m", "mirror": {}}],
"objects": [{"material": "m", "sphere": {"center": [0, 0, 0], "radius": 1}}],
"lights": [{"ies": {"position": [0, 1, 0], "direction": [0, -1, 0], "up": [1, 0, 0],
"file": "lamp.ies"}}]})")});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->notices.size(), 1u);
  EXPECT_EQ(without_folder(loaded->notices[0]),
            "scene.json:5:9: lights[0].ies.file: lamp.ies: the factors for tilted mounting (TILT) are left out: the "
            "light has its measured intensity");
}

TEST_F(Load, AByteOrderMarkIsSkipped) {
  write("a.mtl", "\xef\xbb\xbfnewmtl red\nKd 1 0 0\n");
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
  const Result<LoadedScene> loaded = load({write("a.obj", "\xef\xbb\xbfmtllib a.mtl\n" + triangle)});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_TRUE(loaded->faults.empty());
  EXPECT_EQ(loaded->scene.materials[0].name, "red");
}

TEST_F(Load, FacesBeforeAMaterialAreGrey) {
  const Result<LoadedScene> plain = load({write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3")});
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_TRUE(plain->faults.empty());
  EXPECT_NE(plain->notices[0].find("faces before the first usemtl are rendered as grey diffuse"), std::string::npos);
}

TEST_F(Load, NamesInOtherEncodingsCanBePacked) {
  write("a.mtl", "newmtl gr\xfcn\nKd 0 1 0\n");
  const Result<LoadedScene> loaded =
      load({write("a\xfc.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl gr\xfcn\nf 1 2 3")});
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->scene.materials[0].name, "gr\\xfcn");
  EXPECT_EQ(loaded->scene.name, "a\\xfc");
  const Result<Scene> unpacked = unpack_scene(pack_scene(loaded->scene));
  ASSERT_TRUE(unpacked.ok()) << unpacked.status();
  EXPECT_EQ(utf8_text("gr\xc3\xbcn \xe2\x82\xac \xf0\x9f\x98\x80"), "gr\xc3\xbcn \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(utf8_text("\xc0\x80\xed\xa0\x80\xe2\x82"), "\\xc0\\x80\\xed\\xa0\\x80\\xe2\\x82");
}

TEST_F(Load, ACameraFileReplacesTheCamera) {
  const auto obj = write("a.obj", kTriangles);
  LoadOptions options;
  options.camera =
      write("camera.json", R"({"eye": [1, 2, 3], "look_at": [0, 0, 0], "vertical_fov_degrees": 20})").string();
  const Result<LoadedScene> loaded = load({obj}, options);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->scene.camera.eye, (Point3d{1, 2, 3}));
  write("camera.json", "{\"eye\": 1}");
  EXPECT_EQ(error({obj}, options), "camera.json:1:9: eye: 3 numbers [x, y, z] are expected, got 1");
  options.camera = (folder_ / "none.json").string();
  EXPECT_EQ(
      error({obj}, options),
      "--camera none.json: the scene has no camera of this name. As a file: cannot open none.json: No such file or "
      "directory");
}

TEST_F(Load, GltfFilesBringTheirFilesAndCameras) {
  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  write("assets/my data.bin", buffer.bytes());
  const std::string members = R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"cameras":[{"type":
"perspective","perspective":{"yfov":0.5,"aspectRatio":2}},{"type":"perspective","perspective":{"yfov":1}}],"nodes":[
{"mesh":0},{"camera":0,"name":"Front","translation":[0,0,5]},{"camera":1,"name":"Back","translation":[0,0,-5]}])";
  const auto path = write("model.gltf", test::gltf(buffer.members("assets/my%20data.bin") + members));
  const Result<LoadedScene> front = load({path});
  ASSERT_TRUE(front.ok()) << front.status();
  EXPECT_EQ(front->scene.name, "model");
  EXPECT_EQ(front->scene.camera.eye, (Point3d{0, 0, 5}));
  EXPECT_EQ(front->scene.film.width, 1024);
  EXPECT_EQ(mesh_of(*front, 0).triangles.size(), 1u);
  LoadOptions options;
  options.camera = "Back";
  const Result<LoadedScene> back = load({path}, options);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->scene.camera.eye, (Point3d{0, 0, -5}));
  options.camera = (folder_ / "Side").string();
  EXPECT_EQ(
      error({path}, options),
      "--camera Side: the scene has no camera of this name. Its cameras: Front, Back. As a file: cannot open Side: No "
      "such file or directory");
  write("Side", R"({"eye": [1, 2, 3], "look_at": [0, 0, 0], "camera_constant": 1})");
  EXPECT_EQ(load({path}, options)->scene.camera.eye, (Point3d{1, 2, 3}));
  fs::remove(folder_ / "assets/my data.bin");
  EXPECT_EQ(error({path}), "model.gltf: buffers[0].uri: cannot open assets/my data.bin: No such file or directory");
  EXPECT_EQ(
      error({path, path}),
      "one scene document, one glTF file, one mesh, one pbrt or Mitsuba scene or any number of .obj files are expected, got 2 files that are not all "
      ".obj");
}

}  // namespace
}  // namespace lightmill
