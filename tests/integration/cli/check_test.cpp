// `lightmill check` and the reading of scenes: what they hold, and what is wrong in them.
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(CliTest, CheckSaysWhatIsInAScene) {
  const nlohmann::json facts = json({"check", scene("cornell-bench-balls.json")});
  EXPECT_EQ(facts["triangles"], 12);  // five walls and the lamp
  EXPECT_EQ(facts["spheres"], 2);
  EXPECT_EQ(facts["materials"]["mirror"], 1);
  EXPECT_EQ(facts["materials"]["dielectric"], 1);
  EXPECT_EQ(facts["lights"]["emissive_objects"], 1);
  EXPECT_EQ(facts["width"], 512);
  EXPECT_TRUE(facts["meters"].empty());
  EXPECT_TRUE(facts["notices"].empty());
}

/// A floor seen from above, with a light and a meter in light groups of their own, and `more`.
std::string floor_scene(const std::string& more) {
  return R"({"camera": {"eye": [0, 5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "camera_constant": 1}, "materials": [
{"name": "grey", "diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]}}}], "objects": [
{"material": "grey", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}])" +
         more + "}";
}

TEST_F(CliTest, CheckNamesMetersAndLightGroups) {
  const std::string lit = write("lit.json", floor_scene(R"(, "lights": [
{"name": "a", "point": {"position": [0, 1, 0], "intensity": {"rgb": [1, 1, 1]}}, "group": "key"}], "meters": [
{"name": "desk", "irradiance": {"point": [0, 0, 0], "normal": [0, 1, 0]}}])"));
  const nlohmann::json facts = json({"check", lit});
  EXPECT_EQ(facts["meters"], nlohmann::json::parse(R"([{"name": "desk", "quantity": "irradiance"}])"));
  EXPECT_EQ(facts["light_groups"], nlohmann::json::parse(R"(["key"])"));
  EXPECT_EQ(facts["textures"], 0);
  const CommandResult text = lightmill({"check", lit});
  for (const char* part :
       {"0 triangles, 0 spheres, 1 plane\n", "light groups       key\n", "meter              desk: irradiance\n"}) {
    EXPECT_NE(text.out.find(part), std::string::npos) << part << text.out;
  }
}

TEST_F(FarmCliTest, ABlackPictureIsPredicted) {
  const std::string dark = write("dark.json", floor_scene(""));
  const std::string note = "nothing emits light";
  EXPECT_NE(lightmill({"check", dark}).out.find(note), std::string::npos);
  EXPECT_NE(lightmill({"submit", dark, "--server", server()}).err.find(note), std::string::npos);
  EXPECT_EQ(lightmill({"submit", dark, "--server", server(), "--method", "ao"}).err.find(note), std::string::npos);
}

TEST_F(CliTest, BadScenesAreNamedWithTheirPlace) {
  const std::string unknown = write("unknown.json", "{\"name\": \"x\",\n \"colour\": 3}");
  const CommandResult result = lightmill({"render", unknown});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("unknown.json:2:"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("colour"), std::string::npos) << result.err;
}

TEST_F(CliTest, ImagesThatCannotBeReadAreNamedWithTheirPlace) {
  write("a.png", "root:x:0:0:root");
  const std::string with_texture = write("texture.json",
                                         R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1},
"textures": [{"name": "wood", "file": "a.png"}],
"materials": [{"name": "wood", "diffuse": {"reflectance": {"texture": "wood"}}}],
"objects": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "wood"}]})");
  for (const char* command : {"check", "render"}) {
    const CommandResult result = lightmill({command, with_texture});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("texture.json:2:39: textures[0].file: a.png: not a readable image"), std::string::npos)
        << result.err;
  }
  write("a.png", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n");
  const CommandResult large = lightmill({"check", with_texture});
  EXPECT_EQ(large.exit_code, 2) << "the farm is not full";
  EXPECT_NE(large.err.find("texture.json:2:39: textures[0].file: a.png: "), std::string::npos) << large.err;
}

TEST_F(CliTest, CamerasAreSavedAndLoaded) {
  const std::string saved = file("view.json");
  const nlohmann::json box = json({"check", scene("cornell-bench-blocks.json"), "--save-camera", saved});
  const nlohmann::json course = json({"check", scene("cornell-course-blocks.json"), "--camera", saved});
  EXPECT_EQ(course["camera"], box["camera"]);
  EXPECT_NE(json({"check", scene("cornell-course-blocks.json")})["camera"], box["camera"]);
}

TEST_F(CliTest, TheMtlOptionDecidesWhetherKaEmits) {
  write("a.mtl", "newmtl white\nKa 1 1 1\n");
  const std::string mesh = write("a.obj", "mtllib a.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(json({"check", mesh})["lights"]["emissive_objects"], 0);
  EXPECT_EQ(json({"check", mesh, "--mtl", "course"})["lights"]["emissive_objects"], 1);
  EXPECT_EQ(json({"check", mesh, "--mtl", "standard"})["lights"]["emissive_objects"], 0);
}

TEST_F(CliTest, BlendFilesNeedBlender) {
  const std::string blend = write("scene.blend", "BLENDER-v304");
  Environment without = environment();
  without["LIGHTMILL_BLENDER"] = "";
  without["PATH"] = file("no programs here");
  CommandResult result = run_command({program("lightmill"), "check", blend}, without);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("Blender, which is not installed"), std::string::npos) << result.err;
  // A file that is no Blender scene, and a Blender that is none: /bin/false.
  without["LIGHTMILL_BLENDER"] = "/bin/false";
  result = run_command({program("lightmill"), "check", blend}, without);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("scene.blend: /bin/false could not export the scene (exit code 1)"), std::string::npos)
      << result.err;
  EXPECT_EQ(lightmill({"check", file("none.blend")}).exit_code, 2);
  result = run_command({program("lightmill"), "check", write("SCENE.BLEND", "BLENDER-v304")}, without);
  EXPECT_NE(result.err.find("SCENE.BLEND: /bin/false could not export the scene (exit code 1)"), std::string::npos)
      << result.err;
  EXPECT_TRUE(temporary_is_empty());
}

TEST_F(CliTest, BlendFilesAreRead) {
  if (run_command({"/usr/bin/env", "TMPDIR=" + file(""), "blender", "--background", "--factory-startup",
                   "--python-exit-code", "3", "--python-expr", "import numpy"},
                  environment())
          .exit_code != 0) {
    GTEST_SKIP() << "Blender with numpy is not installed";
  }
  // Blender's default scene, a cube of 2 m, saved with a blue sky, a second camera and smoke.
  const std::string blend = file("first.blend");
  const std::string script = write("make.py", R"(import bpy
bpy.context.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.25, 0.5, 1, 1)
bpy.context.scene.render.resolution_percentage = 50
bpy.ops.object.camera_add(location=(1, 2, 3))
bpy.context.object.name = "second"
bpy.ops.object.volume_add()
bpy.ops.wm.save_as_mainfile(filepath=")" + blend + "\")\n");
  const CommandResult made = run_command({"/usr/bin/env", "TMPDIR=" + file(""), "blender", "--background",
                                          "--factory-startup", "--python-exit-code", "3", "--python", script},
                                         environment());
  ASSERT_EQ(made.exit_code, 0) << made.out << made.err;
  const nlohmann::json scene = json({"check", blend});
  EXPECT_EQ(scene["name"], "first");
  EXPECT_EQ(scene["width"], 960);
  EXPECT_EQ(scene["height"], 540);
  EXPECT_EQ(scene["triangles"], 12);
  EXPECT_NEAR(scene["camera"]["eye"][0].get<double>(), 7.358891, 1e-5);  // Blender's (7.36, −6.93, 4.96), with y up
  EXPECT_NEAR(scene["camera"]["eye"][1].get<double>(), 4.958309, 1e-5);
  EXPECT_NEAR(scene["camera"]["eye"][2].get<double>(), 6.925791, 1e-5);
  EXPECT_NE(scene["notices"].dump().find("object Volume: left out"), std::string::npos) << scene["notices"];
  EXPECT_EQ(scene["facts"]["environment"], "constant");
  const nlohmann::json second = json({"check", blend, "--camera", "second", "--sky", "off"});
  EXPECT_EQ(second["camera"]["eye"], nlohmann::json::parse("[1.0, 3.0, -2.0]"));
  EXPECT_EQ(second["facts"]["environment"], "none");
  // Another Python is first on the PATH, as in an activated environment. It has no numpy.
  std::filesystem::create_directories(file("other/bin"));
  std::filesystem::create_symlink("/bin/false", file("other/bin/python3"));
  for (const int minor : {9, 10, 11, 12, 13}) {
    std::filesystem::create_directories(file(fmt::format("other/lib/python3.{}", minor)));
    write(fmt::format("other/lib/python3.{}/os.py", minor), "");
  }
  Environment activated = environment();
  activated["PATH"] = fmt::format("{}:{}", file("other/bin"), std::getenv("PATH"));
  activated["PYTHONHOME"] = file("other");
  const CommandResult again = run_command({program("lightmill"), "check", blend}, activated);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(temporary_is_empty());
}

}  // namespace
}  // namespace lightmill::test
