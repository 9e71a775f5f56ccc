// Scenes of uploaded files, which read only these files.
#include <sys/stat.h>

#include "common/base/file.h"
#include "common/scene_io/scene_files.h"
#include "common/wire/scene_proto.h"
#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/scene_io/load_fixture.h"

namespace lightmill::test {
namespace {

/// Files by name, and one file on the disk that must never be read. Any loader would accept its bytes.
class UploadedScene : public Load {
 protected:
  void hand(const std::string& name, const std::string& bytes) {
    const Sha256 digest = sha256(bytes);
    bytes_[digest] = bytes;
    ASSERT_TRUE(files_.add(name, digest).ok()) << name;
  }
  Result<LoadedScene> load_handed(const std::vector<std::filesystem::path>& scene, const std::string& camera = {}) {
    LoadOptions options;
    options.camera = camera;
    options.files = &files_;
    return load(scene, options);
  }
  std::string error_of(const std::string& scene, const std::string& camera = {}) {
    return error_message(load_handed({scene}, camera));
  }
  /// A document with one more field.
  static std::string with(const std::string& field) {
    std::string text = document(R"([{"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}}])");
    text.insert(text.rfind('}'), ", " + field);
    return text;
  }

  std::map<Sha256, std::string> bytes_;
  UploadedFiles files_{[this](const Sha256& digest) -> Result<std::string> { return bytes_.at(digest); }};
};

constexpr const char* kNotThere = "is not among the uploaded files";

TEST_F(UploadedScene, IsTheSameAsFromTheDisk) {
  const std::string text = document(R"([{"mesh": {"file": "assets/t.obj"}}])");
  const auto on_disk = write("box.json", text);
  write("assets/t.obj", kTriangles);
  hand("sub/box.json", text);
  hand("sub/x/../assets/t.obj", kTriangles);
  const auto handed = load_handed({"sub/box.json"});
  const auto read = load({on_disk});
  ASSERT_TRUE(handed.ok() && read.ok()) << message_of(handed.status());
  EXPECT_EQ(pack_scene(handed->scene), pack_scene(read->scene));
  EXPECT_EQ(handed->assets, read->assets);
}

TEST_F(UploadedScene, ReachesNoFileOfThisMachine) {
  const std::string secret = write("secret.obj", kTriangles).string();
  std::filesystem::create_directories(folder_ / "assets" / "x");
  std::filesystem::create_symlink(folder_ / "secret.obj", folder_ / "assets" / "link.obj");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_ / "assets");
  for (const std::string& name : {secret, std::string("../secret.obj"), std::string("x/../../secret.obj"),
                                  std::string("link.obj"), std::string("/proc/self/cwd/../secret.obj")}) {
    files_ = UploadedFiles([this](const Sha256& digest) -> Result<std::string> { return bytes_.at(digest); });
    hand("box.json", document(R"([{"mesh": {"file": ")" + name + R"("}}])"));
    EXPECT_TRUE(std::filesystem::exists(name)) << name;
    const std::string message = error_of("box.json");
    EXPECT_NE(message.find("box.json:"), std::string::npos) << message;
    EXPECT_NE(message.find("objects[0].mesh.file: " + name + ": " + kNotThere), std::string::npos) << message;
  }
  std::filesystem::current_path(before);
}

TEST_F(UploadedScene, NamesMissingFilesOfEveryKind) {
  const std::string obj = write("there.obj", kTriangles).string();
  const std::string there = write("there.mtl", "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n").string();
  hand("texture.json", with(R"("textures": [{"name": "t", "file": ")" + there + R"("}])"));
  hand("sky.json", with(R"("lights": [{"environment": {"file": ")" + there + R"("}}])"));
  hand("lamp.json",
       with(R"("lights": [{"ies": {"file": ")" + there + R"(", "position": [0, 0, 0], "direction": [0, 0, 1]}}])"));
  hand("plain.json", document(R"([{"material": "red", "sphere": {"center": [0, 0, 0], "radius": 1}}])"));
  hand("buffer.gltf", R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "../there.bin", "byteLength": 4}]})");
  for (const std::string& name : std::vector<std::string>{"texture.json", "sky.json", "lamp.json"}) {
    const std::string message = error_of(name);
    EXPECT_NE(message.find(there + ": " + kNotThere), std::string::npos) << name << ": " << message;
    EXPECT_NE(message.find(name + ":"), std::string::npos) << message;
  }
  for (const std::string& camera : {there, std::string("/etc/passwd"), std::string("../there.mtl")}) {
    EXPECT_NE(error_of("plain.json", camera).find(kNotThere), std::string::npos) << error_of("plain.json", camera);
  }
  EXPECT_NE(error_of(obj).find("no such file"), std::string::npos) << error_of(obj);
}

// Neither the path as written nor another spelling of it leads to a file of this machine.
TEST_F(UploadedScene, LeavesOutMissingLibraries) {
  const std::string there = write("There.mtl", "newmtl red\nKd 1 0 0\n").string();
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_);
  for (const std::string& name : {there, std::string("There.mtl"), std::string("there.MTL"), "assets/../" + there,
                                  std::string(".\\There.mtl"), "C:" + there}) {
    hand("lib.obj", "mtllib " + name + "\n" + kTriangles);
    const auto loaded = load_handed({"lib.obj"});
    ASSERT_TRUE(loaded.ok()) << message_of(loaded.status());
    EXPECT_EQ(loaded->faults.notices(),
              std::vector<std::string>{fmt::format("lib.obj:1: mtllib: there is no file {}. Its materials are rendered "
                                                   "as grey diffuse",
                                                   name)});
    files_ = UploadedFiles([this](const Sha256& digest) -> Result<std::string> { return bytes_.at(digest); });
  }
  std::filesystem::current_path(before);
}

TEST_F(UploadedScene, FindsFilesInOtherSpellings) {
  hand("Models/PARTS/Colours.MTL", "newmtl red\nKd 1 0 0\nnewmtl green\n");
  hand("Models/a.obj", "mtllib .\\parts\\colours.mtl\n" + kTriangles);
  hand("Models/PARTS.txt", "");
  const auto loaded = load_handed({"Models/a.obj"});
  ASSERT_TRUE(loaded.ok()) << message_of(loaded.status());
  EXPECT_EQ(loaded->faults.notices(),
            std::vector<std::string>{
                "Models/a.obj:1: mtllib: there is no file .\\parts\\colours.mtl. Instead, PARTS/Colours.MTL "
                "is read"});
}

TEST_F(UploadedScene, LeavesOutMissingMaps) {
  const std::string there = write("there.png", "x").string();
  hand("a.mtl", "newmtl red\nKd 1 0 0\nmap_Kd " + there + "\nnewmtl green\nKd 0 1 0\n");
  hand("a.obj", "mtllib a.mtl\n" + kTriangles);
  const auto loaded = load_handed({"a.obj"});
  ASSERT_TRUE(loaded.ok()) << message_of(loaded.status());
  ASSERT_EQ(loaded->images.size(), 1u);
  EXPECT_EQ(loaded->images[0].name, "sky");
  ASSERT_FALSE(loaded->notices.empty());
  EXPECT_NE(loaded->notices[0].find("there is no file " + there), std::string::npos) << loaded->notices[0];
}

TEST_F(UploadedScene, RefusesRepeatedNamesAndNamesOutsideTheFolder) {
  const Sha256 digest = sha256("x");
  EXPECT_TRUE(files_.add("a/b.obj", digest).ok());
  for (const std::string& name : std::vector<std::string>{"a//b.obj", "a/c/../b.obj", "./a/b.obj"}) {
    EXPECT_FALSE(files_.add(name, digest).ok()) << name;
  }
  for (const std::string& name :
       {std::string(), std::string("/a"), std::string(".."), std::string("../a"), std::string("a/../../b"),
        std::string("."), std::string("a/"), std::string("a\0b", 3), std::string(5000, 'a')}) {
    EXPECT_FALSE(files_.add(name, digest).ok()) << name;
  }
}

TEST(SceneFiles, PipesAndDevicesAreRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path pipe = folder.path() / "pipe.obj";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::filesystem::path& path : {pipe, std::filesystem::path("/dev/zero"), folder.path()}) {
    const Result<std::string> read = files_on_disk().read(path, 1 << 20);
    EXPECT_EQ(read.status().code(), StatusCode::kInvalidArgument) << path;
  }
}

}  // namespace
}  // namespace lightmill::test
