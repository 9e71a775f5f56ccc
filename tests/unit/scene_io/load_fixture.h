// Fixture of scenes that are loaded from their own files.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "common/base/file.h"
#include "common/scene_io/load.h"
#include "tests/support/error_message.h"

namespace lightmill::test {

inline const std::string kTriangles =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl green\nf 1 2 3\nusemtl red\nf 1 2 4\nf 1 3 4\nusemtl green\nf 2 3 4\n";

/// A folder for each test.
class Load : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              fmt::format("lightmill-load-{}-{}", ::getpid(),
                          ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_ / "assets");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) {
    EXPECT_TRUE(write_file_atomically(folder_ / name, as_byte_view(text)).ok());
    return folder_ / name;
  }
  Result<LoadedScene> load(const std::vector<std::filesystem::path>& paths, const LoadOptions& options = {}) {
    return load_scene(paths, options);
  }
  std::string error(const std::vector<std::filesystem::path>& paths, const LoadOptions& options = {}) {
    return without_folder(error_message(load(paths, options)));
  }
  std::string without_folder(std::string text) const {
    const std::string prefix = folder_.string() + "/";
    for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix)) {
      text.erase(at, prefix.size());
    }
    return text;
  }
  /// The notices of a scene's faults, without the folder.
  std::vector<std::string> faults_of(const LoadedScene& loaded) const {
    std::vector<std::string> out = loaded.faults.notices();
    std::ranges::transform(out, out.begin(), [&](const std::string& text) { return without_folder(text); });
    return out;
  }
  static std::string document(const std::string& objects) {
    return R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1},
"materials": [{"name": "red", "mirror": {}}, {"name": "green", "mirror": {}}],
"objects": )" +
           objects + "}";
  }

  std::filesystem::path folder_;
};

}  // namespace lightmill::test
