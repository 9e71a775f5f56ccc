// Loading of many materials: the work grows with their number, not with its square.
#include "tests/unit/scene_io/gltf_text.h"
#include "tests/unit/scene_io/load_fixture.h"
#include "tests/unit/scene_io/work_done.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

using test::Load;

/// Twice the names take about twice the work if trees look them up, and four times if lists are searched.
class LoadMany : public Load {
 protected:
  const std::size_t many_ = static_cast<std::size_t>(test::kManyNames);

  void SetUp() override {
    Load::SetUp();
    if (!test::work_done()) {
      GTEST_SKIP() << "comparisons are not counted under sanitizers";
    }
  }
  /// Loads the files that `write` makes for a number of names. Returns the scene of the larger number.
  template <class Write>
  LoadedScene expect_no_list_is_searched(const Write& write_files) {
    std::array<std::uint64_t, 2> counts{};
    LoadedScene last;
    for (const int times : {1, 2}) {
      const fs::path path = write_files(times * test::kManyNames);
      const std::uint64_t before = *test::work_done();
      Result<LoadedScene> loaded = load({path});
      counts[static_cast<std::size_t>(times - 1)] = *test::work_done() - before;
      EXPECT_TRUE(loaded.ok()) << loaded.status();
      last = std::move(loaded).value_or(LoadedScene());
    }
    EXPECT_GT(counts[0], many_) << "the work is not counted";
    EXPECT_LT(counts[1], 5 * counts[0] / 2);
    return last;
  }
};

/// All names have one length, because texts of different lengths are unequal without a comparison.
std::string nth_name(int i) {
  return fmt::format("m{:06}", i);
}

TEST_F(LoadMany, AnObjFileFindsMaterialsWithoutAListSearch) {
  write("a.png", "an image");
  const LoadedScene loaded = expect_no_list_is_searched([&](int count) {
    std::string mtl, obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < count; ++i) {
      mtl += fmt::format("newmtl {}\nmap_Kd -o {} a.png\n", nth_name(i), i);
      obj += fmt::format("usemtl {}\nf 1 2 3\n", nth_name(count - 1 - i));
    }
    write("a.mtl", mtl);
    return write("a.obj", obj);
  });
  EXPECT_EQ(loaded.scene.materials.size(), 2 * many_);
  EXPECT_EQ(loaded.scene.textures.size(), 2 * many_);
  ASSERT_EQ(loaded.scene.objects.size(), 2 * many_);
  EXPECT_EQ(loaded.scene.materials[loaded.scene.objects[0].material].name, nth_name(2 * test::kManyNames - 1));
}

TEST_F(LoadMany, FaultsAreCountedWithoutAListSearch) {
  const LoadedScene loaded = expect_no_list_is_searched([&](int count) {
    std::string mtl = "newmtl known\n", obj = "mtllib A.MTL\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (int i = 0; i < count; ++i) {
      mtl += fmt::format("newmtl {0}\nmap_Kd {0}.png\nKd {1}\n", nth_name(i), "1 2");
      obj += fmt::format("{0} 1\nusemtl {0}\nf 1 2 3\nusemtl no{0}\nf 1 2 4 5\nf 1//9 2 3\n", nth_name(i));
    }
    write("a.mtl", mtl);
    return write("a.obj", obj + "v 1 1 0\n");
  });
  EXPECT_EQ(loaded.scene.objects.size(), 4 * many_ + 1);
  EXPECT_LE(loaded.faults.notices().size(), Faults::kMaxKinds + 1);
}

TEST_F(LoadMany, ADocumentFindsMaterialsWithoutAListSearch) {
  const LoadedScene loaded = expect_no_list_is_searched([&](int count) {
    std::string materials, obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < count; ++i) {
      materials += fmt::format(R"({}{{"name": "{}", "mirror": {{}}}})", i == 0 ? "" : ",", nth_name(i));
      obj += fmt::format("usemtl {}\nf 1 2 3\n", nth_name(count - 1 - i));
    }
    write("a.obj", obj);
    return write("a.json", fmt::format(R"({{"camera": {{"eye": [0, 0, 5], "look_at": [0, 0, 0],
        "camera_constant": 1}}, "materials": [{}], "objects": [{{"mesh": {{"file": "a.obj"}}}}]}})",
                                       materials));
  });
  ASSERT_EQ(loaded.scene.objects.size(), 2 * many_);
  EXPECT_EQ(loaded.scene.objects[1].material, 2 * many_ - 2);
}

TEST_F(LoadMany, AGltfFileNumbersEqualNamesWithoutAListSearch) {
  const LoadedScene loaded = expect_no_list_is_searched([&](int count) {
    test::GltfBuffer buffer;
    buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    std::string materials, primitives;
    for (int i = 0; i < count; ++i) {
      materials += fmt::format(R"({}{{"name":"m"}})", i == 0 ? "" : ",");
      primitives += fmt::format(R"({}{{"attributes":{{"POSITION":0}},"material":{}}})", i == 0 ? "" : ",", i);
    }
    return write("a.gltf", test::gltf(fmt::format(
                               R"({},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}],"materials":[{}])",
                               buffer.embedded(), primitives, materials)));
  });
  ASSERT_EQ(loaded.scene.materials.size(), 2 * many_);
  EXPECT_EQ(loaded.scene.materials[0].name, "m");
  EXPECT_EQ(loaded.scene.materials[2 * many_ - 1].name, fmt::format("m ({})", 2 * many_));
}

}  // namespace
}  // namespace lightmill
