// Cameras and skies of files that have none.
#include <numbers>

#include "common/scene_io/scene_light.h"
#include "tests/support/paths.h"
#include "tests/unit/scene_io/gltf_fixture.h"
#include "tests/unit/scene_io/load_fixture.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

using test::expect_near;
using test::Load;

const std::string kCube =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";

class MissingParts : public Load {
 protected:
  LoadedScene good(const std::vector<fs::path>& paths, const LoadOptions& options = {}) {
    Result<LoadedScene> loaded = load(paths, options);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    return std::move(loaded).value_or(LoadedScene());
  }
  static int skies(const LoadedScene& loaded) {
    return static_cast<int>(std::ranges::count_if(
        loaded.scene.lights, [](const Light& light) { return std::holds_alternative<EnvironmentLight>(light.kind); }));
  }
  static bool says(const LoadedScene& loaded, std::string_view begin) {
    return std::ranges::any_of(loaded.notices, [&](const std::string& notice) { return notice.starts_with(begin); });
  }
};

// The bounding sphere touches the upper and lower edges of the film, and the sky lights the cube.
TEST_F(MissingParts, AnObjFileIsSeenAsAWholeAndLit) {
  for (const double shift : {0.0, 1000.0}) {
    for (const double scale : {1.0, 1e-3}) {
      std::string text;
      std::string_view rest = kCube;
      for (std::string_view line = rest.substr(0, rest.find('\n')); line.starts_with('v');
           line = rest.substr(0, rest.find('\n'))) {
        std::array<double, 3> p{};
        std::sscanf(std::string(line).c_str(), "v %lf %lf %lf", &p[0], &p[1], &p[2]);
        text += fmt::format("v {} {} {}\n", scale * p[0] + shift, scale * p[1], scale * p[2]);
        rest.remove_prefix(line.size() + 1);
      }
      const LoadedScene loaded = good({write("cube.obj", text + std::string(rest))});
      const Camera& camera = loaded.scene.camera;
      expect_near(camera.look_at, {shift, 0, 0}, 1e-9);
      const double distance = scale * std::sqrt(3.0) / std::sin(camera.vertical_fov_degrees * std::numbers::pi / 360);
      // In front, on the right and above; (0.48, 0.36, 0.8) is a unit vector.
      expect_near(camera.eye, {shift + 0.48 * distance, 0.36 * distance, 0.8 * distance}, 1e-9);
      EXPECT_EQ(skies(loaded), 1);
      EXPECT_TRUE(says(loaded, "there is no camera: one was added")) << loaded.notices[0];
      EXPECT_TRUE(says(loaded, "nothing emits light: a soft sky was added"));
    }
  }
}

TEST_F(MissingParts, TheSameMeshInAGltfFileHasTheSameViewAndSky) {
  test::GltfBuffer buffer;
  buffer.positions({-1, -1, -1, 1, -1, 1, 1, 1, -1});
  const LoadedScene gltf = good({write(
      "a.gltf", test::gltf(buffer.embedded() +
                           R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}])"))});
  const LoadedScene obj = good({write("a.obj", "v -1 -1 -1\nv 1 -1 1\nv 1 1 -1\nf 1 2 3\n")});
  EXPECT_EQ(gltf.scene.camera.eye, obj.scene.camera.eye);
  EXPECT_EQ(gltf.scene.camera.look_at, obj.scene.camera.look_at);
  EXPECT_EQ(gltf.scene.camera.vertical_fov_degrees, obj.scene.camera.vertical_fov_degrees);
  EXPECT_EQ(skies(gltf), 1);
  EXPECT_EQ(skies(obj), 1);
}

TEST_F(MissingParts, MeshFilesAreSeenAsAWholeAndLit) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n0 2 0\n3 0 1 2\n";
  const std::string stl =
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 2 0\nendloop\nendfacet\n"
      "endsolid a\n";
  for (const auto& [name, text] : {std::pair{"a.ply", ply}, {"A.STL", stl}}) {
    const Result<LoadedScene> loaded = load({write(name, text)});
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    const Scene& scene = loaded->scene;
    ASSERT_EQ(scene.objects.size(), 1u);
    EXPECT_EQ(scene.objects[0].name, name == std::string("a.ply") ? "a" : "A");
    EXPECT_TRUE(std::holds_alternative<DiffuseMaterial>(scene.materials.at(0).kind));
    ASSERT_EQ(scene.lights.size(), 1u);
    expect_near(scene.camera.look_at, {1, 1, 0}, 1e-9);
    ASSERT_EQ(loaded->notices.size(), 3u);
    EXPECT_TRUE(loaded->notices[0].ends_with("the file has no materials: it is rendered as grey diffuse"))
        << loaded->notices[0];
  }
  EXPECT_NE(error({write("a.ply", ply), write("b.ply", ply)}).find("one mesh"), std::string::npos);
  LoadOptions dark;
  dark.sky = SkyChoice::off;
  EXPECT_TRUE(load({write("a.ply", ply)}, dark)->scene.lights.empty());
}

TEST_F(MissingParts, TheSoftSkyIsBrightestOnTheUpperLeft) {
  const LoadedScene loaded = good({write("cube.obj", kCube)});
  const auto& sky = std::get<EnvironmentLight>(loaded.scene.lights.at(0).kind);
  ASSERT_TRUE(sky.has_image);
  const std::string& file = loaded.assets.at(sky.asset);
  const std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n";
  ASSERT_TRUE(file.starts_with(header));
  ASSERT_EQ(file.size(), header.size() + std::size_t{4} * 16 * 32);
  const double length = std::sqrt(0.0625 + 0.7225 + 0.25);
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 32; ++column) {
      const auto* texel = reinterpret_cast<const unsigned char*>(file.data()) + header.size() + 4 * (32 * row + column);
      const double value = std::ldexp(texel[0], texel[3] - 136) * static_cast<double>(sky.radiance.r);
      // docs/reference/scene.md: the top is at +y, the centre at +x, and the right half towards +z.
      const double theta = (row + 0.5) / 16 * std::numbers::pi, phi = (column + 0.5 - 16) / 16 * std::numbers::pi;
      const double along =
          (-0.25 * std::cos(phi) * std::sin(theta) + 0.85 * std::cos(theta) + 0.5 * std::sin(phi) * std::sin(theta)) /
          length;
      EXPECT_NEAR(value, 0.6 * (1 + along), 0.01) << row << "," << column;
    }
  }
}

// Its picture must stay as it was, whatever is in the room and however little it emits.
TEST_F(MissingParts, TheCoursesCornellBoxGetsItsViewAndNoSky) {
  const fs::path assets = test::source_file("scenes/assets");
  for (const std::vector<fs::path>& files :
       {std::vector<fs::path>{assets / "CornellBox.obj", assets / "CornellBlocks.obj"}, {assets / "CornellBox.obj"}}) {
    const LoadedScene loaded = good(files);
    EXPECT_EQ(loaded.scene.camera.eye, (Point3d{277, 275, -570}));
    EXPECT_EQ(loaded.scene.camera.look_at, (Point3d{277, 275, 0}));
    EXPECT_DOUBLE_EQ(loaded.scene.camera.vertical_fov_degrees, 2 * std::atan(0.5) * 180 / std::numbers::pi);
    EXPECT_TRUE(loaded.scene.lights.empty());
    EXPECT_TRUE(is_lit(loaded));
  }
  const LoadedScene blocks = good({assets / "CornellBlocks.obj"});
  EXPECT_NE(blocks.scene.camera.eye, (Point3d{277, 275, -570}));
  EXPECT_EQ(skies(blocks), 1);
}

/// A square of this side around (0, 0, z), seen from +z, or from −z if it is turned.
std::string square(double side, double z, bool turned, int first) {
  std::string text;
  for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
    text += fmt::format("v {} {} {}\n", x * side, y * side, z);
  }
  return text + (turned ? fmt::format("f {} {} {} {}\n", first + 3, first + 2, first + 1, first)
                        : fmt::format("f {} {} {} {}\n", first, first + 1, first + 2, first + 3));
}

/// An emissive square of side 0.1, and at distance 1 a small white one.
class EmissiveSquare : public MissingParts {
 protected:
  struct Case {
    double radiance = 1;
    bool faces_away = false, other_faces_away = false, two_sided = false;
    double scale = 1;
    std::string other = "Kd 0.5 0.5 0.5";
  };
  bool lights(const Case& c) {
    write("a.mtl", fmt::format("newmtl glow\nKe {0} {0} {0}\nnewmtl other\n{1}\n", c.radiance, c.other));
    LoadedScene loaded =
        good({write("a.obj", "mtllib a.mtl\nusemtl glow\n" + square(0.1 * c.scale, 0, c.faces_away, 1) +
                                 "usemtl other\n" + square(0.01 * c.scale, c.scale, !c.other_faces_away, 5))});
    loaded.scene.lights.clear();
    for (Material& material : loaded.scene.materials) {
      material.two_sided_emission = material.two_sided_emission && c.two_sided;
    }
    return is_lit(loaded);
  }
};

// A small surface of area A and radiance L gives the irradiance L A / d² at distance d on its axis. Under a white sky it
// is π. So A = 0.01 and d = 1 give 1 % of that at L = π.
TEST_F(EmissiveSquare, LightsFromOnePercentOfTheSkysIrradianceOn) {
  for (const double scale : {1.0, 1e4, 1e-4}) {
    EXPECT_FALSE(lights({.radiance = 0.97 * std::numbers::pi, .scale = scale})) << scale;
    EXPECT_TRUE(lights({.radiance = 1.03 * std::numbers::pi, .scale = scale})) << scale;
  }
}

TEST_F(EmissiveSquare, LightsOnlyWhatItsLightCanReach) {
  EXPECT_TRUE(lights({.radiance = 10, .other_faces_away = true}));  // a wall whose normals point outwards
  EXPECT_FALSE(lights({.radiance = 1e6, .faces_away = true}));
  EXPECT_TRUE(lights({.radiance = 10, .faces_away = true, .two_sided = true}));
  EXPECT_FALSE(lights({.radiance = 1e6, .faces_away = true, .other_faces_away = true, .two_sided = true}));
  EXPECT_TRUE(lights({.radiance = 1e-6, .other = "Kd 0 0 0"}));  // nothing can be lit
}

TEST_F(MissingParts, EmittersThatLightNothingDoNotReplaceTheSky) {
  // A label on each of two faces.
  write("a.mtl", "newmtl body\nKd 0.8 0.5 0.2\nnewmtl label\nKd 0 0 0\nKe 0 50 0\n");
  const std::string labels =
      "usemtl label\nv -0.3 -0.3 1\nv 0.3 -0.3 1\nv 0.3 0.3 1\nv -0.3 0.3 1\nf 9 10 11 12\n"
      "v 1 -0.3 -0.3\nv 1 0.3 -0.3\nv 1 0.3 0.3\nv 1 -0.3 0.3\nf 13 14 15 16\n";
  const LoadedScene labelled = good({write("a.obj", "mtllib a.mtl\nusemtl body\n" + kCube + labels)});
  EXPECT_EQ(skies(labelled), 1);
  EXPECT_TRUE(says(labelled, "the emissive surfaces do not light the others: a soft sky was added"));
  // In front of a wall the same labels are its lights.
  const std::string wall = "usemtl body\nv -2 -2 1.5\nv -2 2 1.5\nv 2 2 1.5\nv 2 -2 1.5\nf 17 18 19 20\n";
  EXPECT_EQ(skies(good({write("a.obj", "mtllib a.mtl\nusemtl body\n" + kCube + labels + wall)})), 0);
}

/// A triangle with an emissive map, and one without in front of it.
std::string map_of(const std::string& extensions) {
  return test::OneTriangle().text(
      R"("nodes":[{"mesh":0},{"mesh":0,"translation":[0,0,-1]}],"images":[{"bufferView":2}],"textures":[{"source":0}],
"materials":[{"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}}])" +
          extensions,
      R"(,"material":0)");
}

TEST_F(MissingParts, EmissiveMapsDoNotReplaceTheSky) {
  const LoadedScene mapped = good({write("a.gltf", map_of(""))});
  EXPECT_EQ(skies(mapped), 1);
  EXPECT_TRUE(says(mapped, "the emissive surfaces do not light the others: a soft sky was added"));
  // A light of the file is light, however weak.
  const std::string sun =
      R"(,"extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional"}]}},"scene":0,"scenes":[{"nodes":[0,1,2]}])";
  std::string text = map_of(sun);
  text.insert(text.find(R"(,{"mesh":0,"translation")"), R"(,{"extensions":{"KHR_lights_punctual":{"light":0}}})");
  EXPECT_EQ(skies(good({write("a.gltf", text)})), 0);
  // All is unlit: the sky would light nothing.
  const LoadedScene unlit = good({write("a.gltf", test::OneTriangle().text(
                                                      R"("nodes":[{"mesh":0}],"images":[{"bufferView":2}],"textures":[{
"source":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"extensions":{"KHR_materials_unlit":{}}}])",
                                                      R"(,"material":0)"))});
  EXPECT_EQ(skies(unlit), 0);
}

TEST_F(MissingParts, AnOptionChoosesTheSky) {
  const auto obj = write("a.obj", kCube);
  const auto json = write("a.json", document(R"([{"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}}])"));
  std::string with_sky = document(R"([{"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}}])");
  with_sky.insert(with_sky.rfind('}'), R"(, "lights": [{"name": "dome", "environment": {}}])");
  LoadOptions options;
  EXPECT_EQ(skies(good({json})), 0);  // a document means what it says
  options.sky = SkyChoice::on;
  EXPECT_EQ(skies(good({obj}, options)), 1);
  EXPECT_EQ(skies(good({json}, options)), 1);
  EXPECT_EQ(error({write("b.json", with_sky)}, options),
            "--sky on: the scene has the environment \"dome\", and a scene can have only one");
  options.sky = SkyChoice::off;
  EXPECT_EQ(skies(good({obj}, options)), 0);
  EXPECT_FALSE(says(good({obj}, options), "nothing emits light"));
}

TEST_F(MissingParts, CamerasAreChosenByNameNumberOrAutomatically) {
  test::GltfBuffer buffer;
  buffer.positions({-1, -1, -1, 1, -1, 1, 1, 1, -1});
  const auto path =
      write("a.gltf", test::gltf(buffer.embedded() + R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.5,"aspectRatio":2}},{"type":"perspective","perspective":{"yfov":1}}],
"nodes":[{"mesh":0},{"camera":0,"name":"Front","translation":[0,0,5]},{"camera":1,"name":"1","translation":[0,0,-5]}])"));
  LoadOptions options;
  const auto eye_of = [&](const std::string& camera) {
    options.camera = camera;
    return good({path}, options).scene.camera.eye;
  };
  EXPECT_EQ(eye_of(""), (Point3d{0, 0, 5}));
  EXPECT_EQ(eye_of("Front"), (Point3d{0, 0, 5}));
  EXPECT_EQ(eye_of("2"), (Point3d{0, 0, -5}));
  EXPECT_EQ(eye_of("1"), (Point3d{0, 0, -5}));  // a name comes first
  const Point3d automatic = eye_of("auto");
  EXPECT_EQ(automatic, good({write("a.obj", "v -1 -1 -1\nv 1 -1 1\nv 1 1 -1\nf 1 2 3\n")}).scene.camera.eye);
  options.camera = "3";
  EXPECT_EQ(error({path}, options),
            "--camera 3: the scene has 2 cameras: Front, 1. Give the number or name of one, a camera file, or auto");
  // Nobody needs to hear of a camera that was not used.
  options.camera =
      write("view.json", R"({"eye": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov_degrees": 40})").string();
  const auto mesh = write("a.obj", "v -1 -1 -1\nv 1 -1 1\nv 1 1 -1\nf 1 2 3\n");
  EXPECT_TRUE(says(good({mesh}), "there is no camera"));
  EXPECT_FALSE(says(good({mesh}, options), "there is no camera"));
  options.camera = "auto";
  const auto ball =
      write("a.json", document(R"([{"material": "red", "sphere": {"center": [1, 2, 3], "radius": 0.5}}])"));
  expect_near(good({ball}, options).scene.camera.look_at, {1, 2, 3});
  const auto plane =
      write("a.json", document(R"([{"material": "red", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}])"));
  EXPECT_EQ(error({plane}, options), "--camera auto: the scene has only planes, which are infinite: give a camera");
}

}  // namespace
}  // namespace lightmill
