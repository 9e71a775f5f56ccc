#include "common/wire/scene_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/file.h"
#include "lightmill/v1/scene.pb.h"
#include "tests/support/error_message.h"
#include "tests/support/paths.h"

namespace lightmill {
namespace {

// Line 1 is `{`; every part has a line of its own.
std::string document(const std::string& camera, const std::string& film, const std::string& materials,
                     const std::string& objects, const std::string& more = "") {
  return "{\n\"camera\": " + camera + ",\n\"film\": " + film + ",\n\"materials\": " + materials +
         ",\n\"objects\": " + objects + more + "\n}\n";
}

const std::string kCamera = R"({"eye": [0, 1, 5], "look_at": [0, 1, 0], "vertical_fov_degrees": 30})";
const std::string kFilm = R"({"width": 8, "height": 4})";
const std::string kMaterials = R"([{"name": "red", "diffuse": {"reflectance": {"rgb": [1, 0.5, 0]}}}])";
const std::string kObjects = R"([{"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}}])";

std::string scene_error(const std::string& text) {
  return test::error_message(read_scene_json(text, "box.json"));
}

TEST(SceneJson, AWholeDocumentIsRead) {
  const Result<SceneFile> file = read_scene_json(R"({
    "name": "all",
    "camera": {"eye": {"x": 1, "y": 2, "z": 3}, "look_at": [0, 0, -1e1], "up": [0, 0, 1], "camera_constant": 1},
    "film": {"width": 640, "height": 480, "filter": {"kind": "GAUSSIAN", "radius_pixels": 2}},
    "materials": [
      {"name": "red", "diffuse": {"reflectance": {"rgb": {"r": 0.75, "g": 0.25}}}},
      {"name": "mirror", "mirror": {}},
      {"name": "grey mirror", "mirror": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}},
      {"name": "glass", "dielectric": {}},
      {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [17, 12, 4]},
       "two_sided_emission": true}
    ],
    "objects": [
      {"name": "ball", "material": "glass", "sphere": {"center": [1, 2, 3], "radius": 0.5, "normal_inward": true}},
      {"mesh": {"file": "a.obj"}},
      {"material": "mirror", "mesh": {"file": "b.obj"}}
    ],
    "lights": [{"name": "bulb", "point": {"position": [0, 3, 0], "intensity": {"rgb": [1, 2, 3]}}}]
  })",
                                                 "all.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const Scene& scene = file->draft.scene;
  EXPECT_EQ(scene.name, "all");
  EXPECT_EQ(scene.camera.eye, (Point3d{1, 2, 3}));
  EXPECT_EQ(scene.camera.look_at, (Point3d{0, 0, -10}));
  EXPECT_EQ(scene.camera.up, (Point3d{0, 0, 1}));
  EXPECT_DOUBLE_EQ(scene.camera.vertical_fov_degrees, 2 * std::atan(0.5) * 180 / std::numbers::pi);
  EXPECT_EQ(scene.film.width, 640);
  EXPECT_EQ(scene.film.height, 480);
  EXPECT_EQ(scene.film.filter.kind, FilterKind::gaussian);
  EXPECT_EQ(scene.film.filter.radius_pixels, 2);
  ASSERT_EQ(scene.materials.size(), 5u);
  EXPECT_EQ(std::get<DiffuseMaterial>(scene.materials[0].kind).reflectance, (RgbColor{0.75f, 0.25f, 0}));
  EXPECT_EQ(std::get<MirrorMaterial>(scene.materials[1].kind).reflectance, (RgbColor{1, 1, 1}));
  EXPECT_EQ(std::get<MirrorMaterial>(scene.materials[2].kind).reflectance, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(std::get<DielectricMaterial>(scene.materials[3].kind).ior, 1.5);
  EXPECT_EQ(scene.materials[4].emission, (RgbColor{17, 12, 4}));
  EXPECT_TRUE(scene.materials[4].two_sided_emission);
  ASSERT_EQ(scene.objects.size(), 3u);
  EXPECT_EQ(scene.objects[0].material, 3u);
  EXPECT_TRUE(std::get<SphereShape>(scene.objects[0].shape).normal_inward);
  EXPECT_EQ(std::get<MeshShape>(scene.objects[1].shape).file, "a.obj");
  EXPECT_EQ(file->draft.material_by_face, (std::vector<bool>{false, true, false}));
  EXPECT_EQ(scene.objects[2].material, 1u);
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_EQ(std::get<PointLight>(scene.lights[0].kind).intensity, (RgbColor{1, 2, 3}));
  EXPECT_EQ(file->source.place("objects[1].mesh.file"), "all.json:15:25");
}

TEST(SceneJson, MetersSurviveARoundTrip) {
  const Result<SceneFile> file = read_scene_json(document(kCamera, kFilm, kMaterials, kObjects, R"(, "meters": [
        {"name": "desk", "irradiance": {"point": [1, 2, 3], "normal": [0, 1, 0]}},
        {"name": "wall", "patch": {"corner": [0, 0, 0], "edge1": [1, 0, 0], "edge2": [0, 2, 0]}},
        {"name": "eye", "radiance": {"point": [4, 5, 6], "direction": [0, 0, -1]}},
        {"name": "hole", "flux": {"patch": {"corner": [0, 0, 1], "edge1": [0, 3, 0], "edge2": [1, 0, 0]}}}])"),
                                                 "box.json");
  ASSERT_TRUE(file.ok()) << file.status();
  const auto check = [](const Scene& scene) {
    ASSERT_EQ(scene.meters.size(), 4u);
    EXPECT_EQ(scene.meters[0].name, "desk");
    EXPECT_EQ(std::get<IrradianceMeter>(scene.meters[0].kind).point, (Point3d{1, 2, 3}));
    EXPECT_EQ(std::get<IrradianceMeter>(scene.meters[0].kind).normal, (Point3d{0, 1, 0}));
    EXPECT_EQ(std::get<PatchMeter>(scene.meters[1].kind).patch.edge2, (Point3d{0, 2, 0}));
    EXPECT_EQ(std::get<RadianceMeter>(scene.meters[2].kind).direction, (Point3d{0, 0, -1}));
    EXPECT_EQ(std::get<FluxMeter>(scene.meters[3].kind).patch.edge1, (Point3d{0, 3, 0}));
  };
  check(file->draft.scene);
  const Result<Scene> packed = unpack_scene(pack_scene(file->draft.scene));
  ASSERT_TRUE(packed.ok()) << packed.status();
  check(*packed);
}

TEST(SceneJson, MistakesInMetersAreNamed) {
  const auto error = [](const std::string& meter) {
    return scene_error(document(kCamera, kFilm, kMaterials, kObjects, ", \"meters\": [" + meter + "]"));
  };
  EXPECT_NE(error(R"({"name": "a"})").find("meters[0]: a kind of meter must be given"), std::string::npos);
  EXPECT_NE(
      error(R"({"name": "a", "irradiance": {"point": [0, 0, 0]}})").find("meters[0].irradiance.normal: must be given"),
      std::string::npos);
  EXPECT_NE(error(R"({"name": "a", "flux": {}})").find("meters[0].flux.patch: must be given"), std::string::npos);
}

TEST(SceneJson, TheManualsExampleIsValid) {
  const Result<std::string> manual = read_file(test::source_file("docs/guide/scenes.md"));
  ASSERT_TRUE(manual.ok()) << manual.status();
  const std::size_t begin = manual->find("```json\n") + 8;
  const Result<SceneFile> file = read_scene_json(manual->substr(begin, manual->find("```", begin) - begin), "manual");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->draft.scene.name, "two balls");
  EXPECT_EQ(file->draft.scene.objects.size(), 3u);
}

TEST(SceneJson, DefaultsAreThoseOfTheSchema) {
  const Result<SceneFile> file = read_scene_json(
      "{\"camera\": " + kCamera + ", \"materials\": " + kMaterials + ", \"objects\": " + kObjects + "}", "f");
  ASSERT_TRUE(file.ok()) << file.status();
  const Scene& scene = file->draft.scene;
  EXPECT_EQ(scene.film.width, 512);
  EXPECT_EQ(scene.film.height, 512);
  EXPECT_EQ(scene.film.filter.kind, FilterKind::blackman_harris);
  EXPECT_EQ(scene.film.filter.radius_pixels, 1.5);
  EXPECT_EQ(scene.camera.up, (Point3d{0, 1, 0}));
  EXPECT_FALSE(scene.materials[0].two_sided_emission);
  for (const auto& [kind, radius] :
       {std::pair{"BOX", 0.5}, {"TENT", 1.0}, {"GAUSSIAN", 1.5}, {"BLACKMAN_HARRIS", 1.5}}) {
    const auto filtered = read_scene_json(
        document(kCamera, fmt::format(R"({{"filter": {{"kind": "{}"}}}})", kind), kMaterials, kObjects), "f");
    ASSERT_TRUE(filtered.ok()) << filtered.status();
    EXPECT_EQ(filtered->draft.scene.film.filter.radius_pixels, radius) << kind;
  }
}

TEST(SceneJson, UnknownAndDuplicateFieldsAreNamed) {
  EXPECT_EQ(scene_error(document(kCamera, R"({"width": 8, "depth": 4})", kMaterials, kObjects)),
            "box.json:3:22: film.depth: unknown field. Known fields: width, height, filter");
  EXPECT_EQ(scene_error(document(kCamera, R"({"width": 8, "width": 9})", kMaterials, kObjects)),
            "box.json:3:22: film.width: the field is given twice");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, kObjects, ",\n\"camera\": {}")),
            "box.json:6:1: camera: the field is given twice");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": "a", "mirror": {}, "dielectric": {}}])", kObjects)),
            "box.json:4:43: materials[0].dielectric: only one of diffuse, mirror, dielectric, phong, conductor, "
            "principled, shadow_catcher, mixture may be given, and mirror "
            "is given "
            "already");
}

TEST(SceneJson, WrongTypesAreNamed) {
  EXPECT_EQ(scene_error(document(kCamera, R"({"width": "wide"})", kMaterials, kObjects)),
            "box.json:3:19: film.width: an integer is expected, got a string");
  EXPECT_EQ(scene_error(document(kCamera, R"({"width": 8.5})", kMaterials, kObjects)),
            "box.json:3:19: film.width: an integer is expected, got 8.5");
  EXPECT_EQ(scene_error(document(kCamera, R"({"width": null})", kMaterials, kObjects)),
            "box.json:3:19: film.width: null is not allowed: an integer is expected. The field may also be left out");
  EXPECT_EQ(scene_error(document("7", kFilm, kMaterials, kObjects)),
            "box.json:2:11: camera: an object with eye, look_at, up, vertical_fov_degrees, camera_constant, "
            "lens_radius, focus_distance, shift_x, shift_y is "
            "expected, got 7");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, "{}", kObjects)),
            "box.json:4:14: materials: a list is expected, got an object");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, "[[]]")),
            "box.json:5:13: objects[0]: an object with name, material, mesh, sphere, plane, "
            "triangle, transform is expected, got a list");
  EXPECT_EQ(scene_error(document(R"({"eye": [1, 2], "look_at": [0, 0, 0], "vertical_fov_degrees": 9})", kFilm,
                                 kMaterials, kObjects)),
            "box.json:2:19: camera.eye: 3 numbers [x, y, z] are expected, got 2");
  EXPECT_EQ(scene_error(document(R"({"eye": [1, 2, 3, 4]})", kFilm, kMaterials, kObjects)),
            "box.json:2:19: camera.eye: 3 numbers [x, y, z] are expected, got more");
  EXPECT_EQ(scene_error(document(R"({"eye": [1, true, 3]})", kFilm, kMaterials, kObjects)),
            "box.json:2:23: camera.eye[1]: a number is expected, got true");
  EXPECT_EQ(scene_error(document(R"({"eye": "here"})", kFilm, kMaterials, kObjects)),
            "box.json:2:19: camera.eye: 3 numbers [x, y, z] are expected, got a string");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": 5}])", kObjects)),
            "box.json:4:24: materials[0].name: a string is expected, got 5");
  EXPECT_EQ(
      scene_error(document(kCamera, kFilm, R"([{"name": "a", "diffuse": {"reflectance": [1, 1, 1]}}])", kObjects)),
      "box.json:4:56: materials[0].diffuse.reflectance: a colour is expected, as in {\"rgb\": [0.5, 0.5, 0.5]}, "
      "got a list");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"two_sided_emission": 1}])", kObjects)),
            "box.json:4:38: materials[0].two_sided_emission: true or false is expected, got 1");
  EXPECT_EQ(scene_error(document(kCamera, R"({"filter": {"kind": "BOXY"}})", kMaterials, kObjects)),
            "box.json:3:29: film.filter.kind: unknown value \"BOXY\": one of BOX, TENT, GAUSSIAN, BLACKMAN_HARRIS is "
            "expected");
  EXPECT_EQ(scene_error(document(kCamera, R"({"filter": {"kind": 1}})", kMaterials, kObjects)),
            "box.json:3:29: film.filter.kind: one of BOX, TENT, GAUSSIAN, BLACKMAN_HARRIS is expected, got 1");
  EXPECT_EQ(scene_error("[]"), "box.json:1:1: an object is expected, got a list");
  EXPECT_EQ(scene_error(" 5"), "box.json:1:2: an object is expected");
}

TEST(SceneJson, NonFiniteNumbersAreNamed) {
  EXPECT_EQ(scene_error(document(R"({"eye": [0, NaN, 0]})", kFilm, kMaterials, kObjects)),
            "box.json:2:23: camera.eye[1]: NaN is not a finite number");
  EXPECT_EQ(
      scene_error(document(R"({"eye": [0, 0, 0], "vertical_fov_degrees": -Infinity})", kFilm, kMaterials, kObjects)),
      "box.json:2:54: camera.vertical_fov_degrees: -Infinity is not a finite number");
  EXPECT_EQ(scene_error(document(R"({"eye": [0, 1e999, 0]})", kFilm, kMaterials, kObjects)),
            "box.json:2:23: camera.eye[1]: 1e999 is too large for a number");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": "a", "emission": {"rgb": [1e39, 0, 0]}}])", kObjects)),
            "box.json:4:50: materials[0].emission.rgb[0]: 1e39 is too large for a single-precision number");
}

TEST(SceneJson, AbsurdSizesAreNamed) {
  EXPECT_EQ(scene_error(document(kCamera, R"({"width": 1000000000})", kMaterials, kObjects)),
            "box.json:3:19: film.width: must be 1 to 65536, got 1000000000");
  EXPECT_EQ(scene_error(document(kCamera, R"({"height": 0})", kMaterials, kObjects)),
            "box.json:3:20: film.height: must be 1 to 65536, got 0");
  EXPECT_EQ(scene_error(document(kCamera, R"({"height": 10000000000})", kMaterials, kObjects)),
            "box.json:3:20: film.height: 10000000000 is too large for an integer of 32 bits");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials,
                                 R"([{"material": "red", "sphere": {"center": [1e15, 0, 0], "radius": 1}}])")),
            "box.json:5:54: objects[0].sphere.center: coordinates must be finite and at most 1000000000000, got "
            "(1000000000000000, 0, 0)");
}

TEST(SceneJson, DeepNestingIsRefused) {
  std::string material = R"("mirror": {})";
  for (int i = 0; i < 10'000; ++i) {
    material = R"("mixture": {"first": {)" + material + "}}";
  }
  const std::string error = scene_error(document(kCamera, kFilm, R"([{"name": "red", )" + material + "}]", kObjects));
  EXPECT_TRUE(error.ends_with("objects and lists can be nested 64 deep")) << error.substr(0, 300);
  EXPECT_LT(error.size(), 200u);
}

TEST(SceneJson, UnknownMaterialsAreNamed) {
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials,
                                 R"([{"material": "rad", "sphere": {"center": [0, 0, 0], "radius": 1}}])")),
            "box.json:5:26: objects[0].material: unknown material \"rad\". Known materials: red");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, "[]", kObjects)),
            "box.json:5:26: objects[0].material: unknown material \"red\". There are no materials");
  EXPECT_EQ(
      scene_error(document(kCamera, kFilm, R"([{"name": "a", "mirror": {}}, {"name": "a", "mirror": {}}])", kObjects)),
      "box.json:5:26: objects[0].material: unknown material \"red\". Known materials: a, a");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": "red", "mirror": {}}, {"name": "red", "mirror": {}}])",
                                 kObjects)),
            "box.json:4:55: materials[1].name: \"red\" names an earlier material already");
}

TEST(SceneJson, MissingFieldsAreNamed) {
  EXPECT_EQ(scene_error("{}"), "box.json:1:1: camera: must be given");
  EXPECT_EQ(scene_error(document("{}", kFilm, kMaterials, kObjects)), "box.json:2:11: camera.eye: must be given");
  EXPECT_EQ(scene_error(document(R"({"eye": [0, 0, 0], "look_at": [0, 0, 1]})", kFilm, kMaterials, kObjects)),
            "box.json:2:11: camera: vertical_fov_degrees or camera_constant must be given");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, "[]")),
            "box.json:5:12: objects: the scene is empty, at least one object is expected");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": "red"}])", kObjects)),
            "box.json:4:15: materials[0]: a kind of material must be given. The kinds are diffuse, mirror, dielectric, "
            "phong, conductor, principled, shadow_catcher, mixture");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"mirror": {}}])", kObjects)),
            "box.json:4:15: materials[0].name: must not be empty");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": "a", "diffuse": {}}])", kObjects)),
            "box.json:4:40: materials[0].diffuse.reflectance: must be given");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, R"([{"name": "a", "diffuse": {"reflectance": {}}}])", kObjects)),
            "box.json:4:56: materials[0].diffuse.reflectance: a colour is expected, as in {\"rgb\": [0.5, 0.5, 0.5]}");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, R"([{"material": "red"}])")),
            "box.json:5:13: objects[0]: a shape must be given. The shapes are mesh, sphere, plane, triangle");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, R"([{"material": "red", "mesh": {}}])")),
            "box.json:5:41: objects[0].mesh.file: must be given");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, R"([{"sphere": {"center": [0, 0, 0], "radius": 1}}])")),
            "box.json:5:13: objects[0].material: must be given");
  EXPECT_EQ(
      scene_error(document(kCamera, kFilm, kMaterials, R"([{"material": "red", "sphere": {"center": [0, 0, 0]}}])")),
      "box.json:5:43: objects[0].sphere.radius: must be positive and at most 1000000000000, got 0");
  EXPECT_EQ(scene_error(document(kCamera, kFilm, kMaterials, kObjects, ",\n\"lights\": [{\"name\": \"x\"}]")),
            "box.json:6:12: lights[0]: a kind of light must be given. The kinds are point, directional, spot, "
            "cosine_power, disk, rectangle, ies, environment");
}

TEST(SceneJson, BrokenJsonIsReportedWithItsPlace) {
  EXPECT_EQ(
      scene_error("{\n  \"camera\" 5}"),
      "box.json:2:12: not JSON: syntax error while parsing object separator - unexpected number literal; expected ':'");
  EXPECT_EQ(scene_error("{\"name\": \"a\"\n \"film\": {}}"),
            "box.json:2:2: not JSON: syntax error while parsing object - unexpected string literal; expected '}'");
  EXPECT_EQ(scene_error("{\"name\": \"a\","),
            "box.json:1:14: not JSON: syntax error while parsing object key - unexpected end of input; expected string "
            "literal");
  EXPECT_EQ(scene_error("{\"name\": \"a\",\n}"), "box.json:2:1: not JSON: a comma before }. Remove it");
  EXPECT_EQ(scene_error(R"({"materials": [{"name": "x", "mirror": {}}, ]})"),
            "box.json:1:45: not JSON: a comma before ]. Remove it");
  EXPECT_EQ(scene_error(""), "box.json:1:1: the file is empty");
}

TEST(SceneJson, CamerasCanStandAlone) {
  const Result<Camera> camera = read_camera_json(kCamera, "camera.json");
  ASSERT_TRUE(camera.ok()) << camera.status();
  EXPECT_EQ(camera->vertical_fov_degrees, 30);
  EXPECT_EQ(camera->eye, (Point3d{0, 1, 5}));
  const auto error = [](const std::string& text) { return message_of(read_camera_json(text, "c.json").status()); };
  EXPECT_EQ(error(R"({"eye": [0, 0, 0],
  "look_at": [0, 0, 0], "camera_constant": 1})"),
            "c.json:2:14: look_at: must differ from camera.eye, both are (0, 0, 0)");
  EXPECT_EQ(error("{\"foo\": 1}"),
            "c.json:1:2: foo: unknown field. Known fields: eye, look_at, up, vertical_fov_degrees, camera_constant, "
            "lens_radius, focus_distance, shift_x, shift_y");
  EXPECT_EQ(error(R"({"eye": [0, 0, 0], "look_at": [0, 0, 1], "camera_constant": -1})"),
            "c.json:1:61: camera_constant: must be in [0.001, 1000000], got -1");
}

// ---- the packed form ----

Scene example_scene() {
  Scene scene;
  scene.name = "example";
  scene.camera = {{0.1, 1, 5}, {0, 1, 0}, {0, 1, 0}, 33.25, 0.125, 7.5};
  scene.film = {640, 480, {FilterKind::box, 0.5}};
  scene.materials = {{"red", DiffuseMaterial{{0.63f, 0.065f, 0.05f}}, {}, false},
                     {"mirror", MirrorMaterial{{0.9f, 1, 1}}, {}, false},
                     {"glass", DielectricMaterial{1.33}, {}, false},
                     {"lamp", DiffuseMaterial{{0, 0, 0}}, {17, 12, 4}, true}};
  scene.objects = {{"mesh", 0, MeshShape{"a.obj", sha256("mesh")}},
                   {"again", 3, MeshShape{"a.obj", sha256("mesh")}},
                   {"ball", 2, SphereShape{{1, 2, 3}, 0.5, true}}};
  scene.lights = {{"bulb", PointLight{{0, 3, 0}, {1, 2, 3}}}};
  return scene;
}

TEST(CameraFile, SurvivesARoundTripToTheLastBit) {
  Camera camera;
  camera.eye = {0.1, -1e-300, 1.0 / 3};
  camera.look_at = {0, 0, 0};
  camera.up = {0, std::nextafter(1, 2), 1e11};
  camera.vertical_fov_degrees = 53.13010235415598;
  const Result<Camera> back = read_camera_json(write_camera_json(camera), "camera.json");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->eye, camera.eye);
  EXPECT_EQ(back->look_at, camera.look_at);
  EXPECT_EQ(back->up, camera.up);
  EXPECT_EQ(back->vertical_fov_degrees, camera.vertical_fov_degrees);
}

TEST(PackedScene, SurvivesARoundTripWithTheSameBytes) {
  const Scene scene = example_scene();
  const std::string bytes = pack_scene(scene);
  const Result<Scene> back = unpack_scene(bytes);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(pack_scene(*back), bytes);
  EXPECT_EQ(back->camera.vertical_fov_degrees, 33.25);
  EXPECT_EQ(back->film.filter.kind, FilterKind::box);
  EXPECT_EQ(std::get<DiffuseMaterial>(back->materials[0].kind).reflectance, (RgbColor{0.63f, 0.065f, 0.05f}));
  EXPECT_EQ(std::get<DielectricMaterial>(back->materials[2].kind).ior, 1.33);
  EXPECT_TRUE(back->materials[3].two_sided_emission);
  EXPECT_EQ(std::get<MeshShape>(back->objects[0].shape).asset, sha256("mesh"));
  EXPECT_EQ(back->objects[2].material, 2u);
}

TEST(PackedScene, OneChangeChangesTheBytes) {
  const std::string bytes = pack_scene(example_scene());
  Scene scene = example_scene();
  scene.camera.eye[0] = std::nextafter(0.1, 1);
  EXPECT_NE(pack_scene(scene), bytes);
  scene = example_scene();
  std::get<SphereShape>(scene.objects[2].shape).normal_inward = false;
  EXPECT_NE(pack_scene(scene), bytes);
}

TEST(PackedScene, DamagedBytesAreRefused) {
  const auto error = [](const v1::Scene& scene) {
    return message_of(unpack_scene(scene.SerializeAsString()).status());
  };
  EXPECT_EQ(message_of(unpack_scene("\xff\xff").status()), "a packed scene of 2 bytes is damaged");
  EXPECT_EQ(message_of(unpack_scene(std::string(17 << 20, ' ')).status()),
            "a packed scene of 17825792 bytes is more than the limit of 16777216");
  v1::Scene message;
  to_wire(example_scene(), &message);
  v1::Scene changed = message;
  changed.mutable_objects(0)->mutable_mesh()->set_asset("xyz");
  EXPECT_EQ(error(changed), "objects[0].mesh.asset: a SHA-256 is 64 hex digits, got 'xyz'");
  changed = message;
  changed.mutable_objects(1)->clear_material();
  EXPECT_EQ(error(changed), "objects[1].material: must be given in a packed scene");
  changed = message;
  changed.mutable_film()->mutable_filter()->set_kind(static_cast<v1::PixelFilter::Kind>(77));
  EXPECT_EQ(error(changed), "film.filter.kind: unknown value 77");
  changed = message;
  changed.mutable_camera()->mutable_eye()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(error(changed), "camera.eye: coordinates must be finite and at most 1000000000000, got (nan, 1, 5)");
}

}  // namespace
}  // namespace lightmill
