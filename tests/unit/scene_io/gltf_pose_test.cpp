// Skins, morph targets and animations of glTF files. Expected positions follow from the specification's formulas.
#include <cmath>
#include <numbers>

#include "common/scene/mesh.h"
#include "common/scene_io/gltf/gltf_deform.h"
#include "common/scene_io/gltf/gltf_mesh.h"
#include "common/scene_io/notices.h"
#include "tests/unit/scene_io/gltf_fixture.h"

namespace lightmill {
namespace {

using namespace lightmill::test;

Result<LoadedScene> read_at(const std::string& text, double seconds, const std::string& animation = "") {
  return read_gltf(text, "a.gltf", {.moment = AnimationMoment{animation, seconds}}, no_files);
}

testing::AssertionResult says(const std::string& text, std::string_view part) {
  return text.find(part) != text.npos ? testing::AssertionSuccess()
                                      : testing::AssertionFailure() << "no \"" << part << "\" in " << text;
}

std::string all_of(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) {
    out += text + "\n";
  }
  return out;
}

/// A triangle in the plane z = 0, and the buffer that tests add to.
class PoseFile {
 public:
  PoseFile() {
    buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    buffer.positions({0, 0, 1, 0, 0, 1, 0, 0, 1});
  }
  /// `members` begin with "nodes". `primitive` and `mesh` are further members, each with a comma before it.
  std::string text(const std::string& members, const std::string& primitive = "", const std::string& mesh = "") const {
    return gltf(fmt::format(R"({},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1{}}}]{}}}],{})",
                            buffer.embedded(), primitive.empty() ? "}" : primitive, mesh, members));
  }
  /// An accessor of floats.
  int floats(const std::vector<float>& values, std::string_view type, std::size_t components) {
    return buffer.add(packed(values), type, 5126, values.size() / components);
  }

  GltfBuffer buffer;
};

// ---- morph targets ----

TEST(GltfMorphTargets, MovePositionsAndNormalsByTheirWeights) {
  PoseFile file;
  const int moves = file.buffer.positions({0, 0, 0, 0, 0, 4, 0, 0, 0});
  const int turns = file.buffer.positions({0, 0, 0, 2, 0, 0, 0, 0, 0});
  const std::string targets =
      fmt::format(R"(}},"targets":[{{"POSITION":{}}},{{"NORMAL":{}}},{{"POSITION":0}}])", moves, turns);
  const LoadedScene loaded =
      good(file.text(R"("nodes":[{"mesh":0},{"mesh":0,"weights":[1,0,-0.5]}])", targets, R"(,"weights":[0.5,0.5,0])"));
  ASSERT_EQ(loaded.scene.objects.size(), 2u);
  const Mesh mesh = object_mesh(loaded), other = object_mesh(loaded, 1);
  EXPECT_EQ(mesh.positions, (std::vector<Point3d>{Point3d{0, 0, 0}, Point3d{1, 0, 2}, Point3d{0, 1, 0}}));
  const float half = std::sqrt(0.5f);  // (0, 0, 1) + 0.5 · (2, 0, 0)
  EXPECT_NEAR(mesh.normals[1][0], half, 1e-6);
  EXPECT_NEAR(mesh.normals[1][2], half, 1e-6);
  EXPECT_EQ(mesh.normals[2], (std::array<float, 3>{0, 0, 1}));
  EXPECT_EQ(other.positions, (std::vector<Point3d>{Point3d{0, 0, 0}, Point3d{0.5, 0, 4}, Point3d{0, 0.5, 0}}));
}

// In any order, and also where a node sets all weights to 0.
TEST(GltfMorphTargets, WeightsOfOneNodeDoNotChangeOthers) {
  const std::string targets = R"(},"targets":[{"POSITION":1}])", weights = R"(,"weights":[0.5])";  // along z
  const LoadedScene loaded = good(
      PoseFile().text(R"("nodes":[{"mesh":0,"weights":[0]},{"mesh":0},{"mesh":0,"weights":[2]}])", targets, weights));
  ASSERT_EQ(loaded.scene.objects.size(), 3u);
  EXPECT_EQ(object_mesh(loaded, 0).positions[0], (Point3d{0, 0, 0}));
  EXPECT_EQ(object_mesh(loaded, 1).positions[0], (Point3d{0, 0, 0.5}));
  EXPECT_EQ(object_mesh(loaded, 2).positions[0], (Point3d{0, 0, 2}));
}

// ---- skins ----

/// A skin of two joints. The second one's inverse bind matrix moves by −1 along x.
struct SkinFile : PoseFile {
  explicit SkinFile(const std::vector<float>& weights = {1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0}) {
    joints = buffer.add(packed<std::uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}), "VEC4", 5121, 3);
    this->weights = floats(weights, "VEC4", 4);
    binds = floats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1},
                   "MAT4", 16);
  }
  /// The joints are nodes 1 and 2. The mesh's own node is far away, which has no effect.
  std::string skinned(const std::string& first, const std::string& second, const std::string& more = "") const {
    return text(fmt::format(R"("nodes":[{{"mesh":0,"skin":0,"translation":[9,9,9]}},{{"name":"a"{}}},{{"name":"b"{}}}],
"skins":[{{"joints":[1,2],"inverseBindMatrices":{}}}]{})",
                            first, second, binds, more),
                fmt::format(R"(,"JOINTS_0":{},"WEIGHTS_0":{}}})", joints, weights));
  }

  int joints = 0, weights = 0, binds = 0;
};

TEST(GltfSkins, MoveVerticesWithTheirJointsAndIgnoreTheirOwnNode) {
  // Joint b turns by 90° about y: (1, 0, 0) − (1, 0, 0) stays at the joint, which is at (1, 0, 2).
  const LoadedScene loaded =
      good(SkinFile().skinned(R"(,"translation":[0,0,-1])",
                              R"(,"translation":[1,0,2],"rotation":[0,0.70710678118654752,0,0.70710678118654752])"));
  ASSERT_EQ(loaded.scene.objects.size(), 1u);
  EXPECT_EQ(loaded.scene.objects[0].transform, kIdentityTransform);
  const Mesh mesh = object_mesh(loaded);
  expect_near(mesh.positions[0], {0, 0, -1});
  expect_near(mesh.positions[1], {1, 0, 2});
  // Vertex 2 is the mean of (0, 1, −1), by joint a, and (1, 1, 3), by joint b: (−1, 1, 0) turned is (0, 1, 1).
  expect_near(mesh.positions[2], {0.5, 1, 1});
  EXPECT_NEAR(mesh.normals[0][2], 1, 1e-6);
  EXPECT_NEAR(mesh.normals[1][0], 1, 1e-6);  // z turned by 90° about y is x
}

TEST(GltfSkins, AShearTurnsNormalsByTheCofactors) {
  // Joint a scales x by 4. The triangle's normal stays that of its plane.
  SkinFile file({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  const LoadedScene loaded = good(file.skinned(R"(,"matrix":[4,0,1,0,0,1,0,0,0,0,1,0,0,0,0,1])", ""));
  const Mesh mesh = object_mesh(loaded);
  // (1, 0, 0) → (4, 0, 1) and (0, 1, 0) stays: the plane's normal is (4, 0, 1) × (0, 1, 0) = (−1, 0, 4).
  const double length = std::sqrt(17);
  EXPECT_NEAR(mesh.normals[1][0], -1 / length, 1e-6);
  EXPECT_NEAR(mesh.normals[1][2], 4 / length, 1e-6);
}

TEST(GltfSkins, WeightsAreNormalised) {
  const LoadedScene loaded =
      good(SkinFile({2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0}).skinned(R"(,"translation":[0,0,5])", ""));
  const Mesh mesh = object_mesh(loaded);
  expect_near(mesh.positions[0], {0, 0, 5});
  expect_near(mesh.positions[1], {0, 0, 0});
  expect_near(mesh.positions[2], {0, 1, 5});  // without weights: the first joint
}

TEST(GltfSkins, FaultsKeepTheModelledPose) {
  SkinFile file;
  const LoadedScene loaded = good(file.text(
      fmt::format(
          R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"skin":0,"translation":[0,0,3]}},{{}},{{}}],"skins":[{{"joints":[1,2]}}])"),
      fmt::format(R"(,"JOINTS_0":{},"WEIGHTS_0":{}}})", file.joints, file.weights)));
  EXPECT_TRUE(says(all_of(loaded.faults.notices()), "skins[0].joints[0]: the joint is not in the scene"));
  // The node places it, which it does not with a skin.
  expect_near(moved(loaded.scene.objects.at(0), object_mesh(loaded).positions[1]), {1, 0, 3});
}

TEST(GltfSkins, MirroredJointsKeepTheOuterSideOutside) {
  SkinFile file({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  const Mesh mesh = object_mesh(good(file.skinned(R"(,"scale":[-1,1,1])", "")));
  const auto& [a, b, c] = mesh.triangles.at(0);
  const Point3d &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
  EXPECT_GT((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]), 0);  // seen from +z, as before
  EXPECT_EQ(mesh.normals[0], (std::array<float, 3>{0, 0, 1}));
}

TEST(GltfSkins, PrimitivesWithoutJointsMoveWithTheirNode) {
  SkinFile file;
  const LoadedScene loaded = good(file.text(fmt::format(
      R"("nodes":[{{"mesh":0,"skin":0,"translation":[0,0,3]}},{{}},{{}}],"skins":[{{"joints":[1,2],"inverseBindMatrices":{}}}])",
      file.binds)));
  expect_near(object_mesh(loaded).positions[1], {1, 0, 3});
}

TEST(GltfSkins, PartsWithoutAreaInTheirPoseAreLeftOut) {
  SkinFile file({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  const std::string hidden = file.skinned(R"(,"scale":[0,0,0])", "");
  EXPECT_EQ(error_message(read(hidden)), "a.gltf: the scene has no triangles");
}

TEST(GltfSkins, WrongJointsAreErrors) {
  SkinFile file;
  const std::string influences = fmt::format(R"(,"JOINTS_0":{},"WEIGHTS_0":{}}})", file.joints, file.weights);
  EXPECT_EQ(error_message(read(file.text(R"("nodes":[{"mesh":0,"skin":0},{}],"skins":[{"joints":[1]}])", influences))),
            "a.gltf: meshes[0].primitives[0].attributes.JOINTS_0: joint 1 is out of range, there are 1");
  EXPECT_EQ(
      error_message(read(file.text(
          fmt::format(
              R"("nodes":[{{"mesh":0,"skin":0}},{{}},{{}},{{}}],"skins":[{{"joints":[1,2,3],"inverseBindMatrices":{}}}])",
              file.binds),
          influences))),
      "a.gltf: skins[0].inverseBindMatrices: 3 matrices are expected, got 2");
}

TEST(GltfMorphTargets, CountTheWorkOfAllMeshes) {
  const auto data =
      GltfData::open(PoseFile().text(R"("nodes":[])", R"(},"targets":[{"POSITION":0}])"), "a.gltf", no_files);
  ASSERT_TRUE(data.ok()) << data.status();
  const JsonNode primitive = (*data)->root()["meshes"].at(0)["primitives"].at(0);
  const MeshPose pose{.weights = std::make_shared<const std::vector<double>>(1, 0.5), .joints = nullptr};
  std::vector<std::string> texts;
  Notices notices(texts);
  std::uint64_t deformed = 0;
  EXPECT_TRUE(read_primitive(**data, primitive, pose, std::nullopt, false, deformed, notices).has_value());
  // Three vertices and a triangle, by two arrays; a target; two attributes.
  EXPECT_EQ(deformed, (3 + 1) * 2 + 1u + 2u);
  deformed = kMaxDeformed - 8;
  EXPECT_FALSE(read_primitive(**data, primitive, pose, std::nullopt, false, deformed, notices).has_value());
  EXPECT_EQ(message_of((*data)->status()),
            "a.gltf: meshes[0].primitives[0]: skins and morph targets move too much: more than 100000000 vertices, "
            "triangles and targets");
}

// ---- animations ----

/// The position of a node whose translation has these keyframes.
Point3d animated_position(const std::string& interpolation, const std::vector<float>& times,
                          const std::vector<float>& values, double seconds) {
  PoseFile file;
  const int input = file.floats(times, "SCALAR", 1), output = file.floats(values, "VEC3", 3);
  const LoadedScene loaded = good_scene(read_at(
      file.text(fmt::format(R"("nodes":[{{"mesh":0,"translation":[7,7,7]}}],"animations":[{{"channels":[{{"sampler":0,
"target":{{"node":0,"path":"translation"}}}}],"samplers":[{{"input":{},"output":{},"interpolation":"{}"}}]}}])",
                            input, output, interpolation)),
      seconds));
  return loaded.scene.objects.empty() ? Point3d{} : moved(loaded.scene.objects[0], {0, 0, 0});
}

TEST(GltfAnimations, LinearAndStepKeyframesAreInterpolatedAndHeldOutside) {
  const std::vector<float> times{1, 2, 4}, values{0, 0, 0, 10, 0, 0, 10, 4, 0};
  const auto linear = [&](double seconds) { return animated_position("LINEAR", times, values, seconds); };
  expect_near(linear(0), {0, 0, 0});
  expect_near(linear(1.25), {2.5, 0, 0});
  expect_near(linear(2), {10, 0, 0});
  expect_near(linear(3.5), {10, 3, 0});
  expect_near(linear(99), {10, 4, 0});
  const auto step = [&](double seconds) { return animated_position("STEP", times, values, seconds); };
  expect_near(step(1.99), {0, 0, 0});
  expect_near(step(2), {10, 0, 0});
  expect_near(step(99), {10, 4, 0});
}

TEST(GltfAnimations, CubicSplinesGiveCubicPolynomialsExactly) {
  // x = t³ and y = t² between t = 1 and t = 3: in-tangent, value and out-tangent of each keyframe.
  const std::vector<float> times{1, 3}, values{0, 0, 0, 1, 1, 0, 3, 2, 0, 27, 6, 0, 27, 9, 0, 0, 0, 0};
  for (const double t : {1.0, 1.3, 2.0, 2.75, 3.0}) {
    expect_near(animated_position("CUBICSPLINE", times, values, t), {t * t * t, t * t, 0}, 1e-9);
  }
  expect_near(animated_position("CUBICSPLINE", times, values, 0), {1, 1, 0});
  expect_near(animated_position("CUBICSPLINE", times, values, 9), {27, 9, 0});
}

TEST(GltfAnimations, RotationsTakeTheShorterArcAtConstantSpeed) {
  PoseFile file;
  const float c = std::cos(std::numbers::pi_v<float> / 4);
  // From 0° to 90° about z. The second quaternion has the other sign.
  const int input = file.floats({0, 3}, "SCALAR", 1), output = file.floats({0, 0, 0, 1, 0, 0, -c, -c}, "VEC4", 4);
  const std::string text = file.text(fmt::format(
      R"("nodes":[{{"children":[1]}},{{"mesh":0}}],"animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],
"samplers":[{{"input":{},"output":{}}}]}}])",
      input, output));
  for (const double seconds : {0.0, 1.0, 2.0, 3.0}) {
    const LoadedScene loaded = good_scene(read_at(text, seconds));
    ASSERT_EQ(loaded.scene.objects.size(), 1u);
    const double angle = seconds / 3 * std::numbers::pi / 2;
    expect_near(moved(loaded.scene.objects[0], {1, 0, 0}), {std::cos(angle), std::sin(angle), 0}, 1e-6);
  }
}

TEST(GltfAnimations, WeightsOfMorphTargetsAreAnimated) {
  PoseFile file;
  const int first = file.buffer.positions({0, 0, 1, 0, 0, 1, 0, 0, 1});
  const int second = file.buffer.positions({0, 1, 0, 0, 1, 0, 0, 1, 0});
  const int input = file.floats({0, 2}, "SCALAR", 1), output = file.floats({0, 8, 4, 0}, "SCALAR", 1);
  const std::string text = file.text(
      fmt::format(
          R"("nodes":[{{"mesh":0}}],"animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"weights"}}}}],
"samplers":[{{"input":{},"output":{}}}]}}])",
          input, output),
      fmt::format(R"(}},"targets":[{{"POSITION":{}}},{{"POSITION":{}}}])", first, second));
  expect_near(object_mesh(good_scene(read_at(text, 0))).positions[0], {0, 8, 0});
  expect_near(object_mesh(good_scene(read_at(text, 0.5))).positions[0], {0, 6, 1});
  expect_near(object_mesh(good_scene(read_at(text, 2))).positions[0], {0, 0, 4});
}

TEST(GltfAnimations, JointsMoveTheirMeshes) {
  SkinFile file;
  const int input = file.floats({0, 1}, "SCALAR", 1), output = file.floats({0, 0, 0, 0, 0, 6}, "VEC3", 3);
  const std::string text =
      file.skinned("", R"(,"translation":[1,0,0])",
                   fmt::format(R"(,"animations":[{{"channels":[{{"sampler":0,"target":{{"node":1,"path":
"translation"}}}}],"samplers":[{{"input":{},"output":{}}}]}}])",
                               input, output));
  const Mesh mesh = object_mesh(good_scene(read_at(text, 0.5)));
  expect_near(mesh.positions[0], {0, 0, 3});
  expect_near(mesh.positions[1], {1, 0, 0});
  expect_near(mesh.positions[2], {0, 1, 1.5});
}

TEST(GltfAnimations, AreFoundByNameAndNumber) {
  PoseFile file;
  const int input = file.floats({0}, "SCALAR", 1), walk = file.floats({1, 0, 0}, "VEC3", 3),
            jump = file.floats({0, 0, 2}, "VEC3", 3);
  const auto animation = [&](std::string_view name, int output) {
    return fmt::format(
        R"({{{}"channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}],"samplers":[{{"input":{},"output":{}}}]}})",
        name, input, output);
  };
  const std::string text = file.text(fmt::format(R"("nodes":[{{"mesh":0}}],"animations":[{},{}])",
                                                 animation(R"("name":"walk",)", walk), animation("", jump)));
  const auto position = [&](const std::string& name) {
    return moved(good_scene(read_at(text, 0, name)).scene.objects.at(0), {0, 0, 0});
  };
  expect_near(position(""), {1, 0, 0});
  expect_near(position("walk"), {1, 0, 0});
  expect_near(position("1"), {1, 0, 0});
  expect_near(position("2"), {0, 0, 2});
  EXPECT_EQ(error_message(read_at(text, 0, "run")), "a.gltf: there is no animation run. It has 2 animations: walk, 2");
  EXPECT_EQ(error_message(read_at(file.text(R"("nodes":[{"mesh":0}])"), 0)),
            "a.gltf: the file has no animations: leave out --at and --animation");
}

TEST(GltfAnimations, ChannelsWithFaultsAreSkippedAndNamed) {
  PoseFile file;
  const int down = file.floats({1, 0}, "SCALAR", 1), one = file.floats({0}, "SCALAR", 1),
            output = file.floats({0, 0, 0, 1, 0, 0}, "VEC3", 3);
  const auto notice = [&](const std::string& sampler, const std::string& path = "translation",
                          const std::string& node = "") {
    const LoadedScene loaded = good_scene(read_at(
        file.text(fmt::format(
            R"("nodes":[{{"mesh":0{}}}],"animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"{}"}}}}],"samplers":[{}]}}])",
            node, path, sampler)),
        0));
    return all_of(loaded.faults.notices());
  };
  const std::string good = fmt::format(R"({{"input":{},"output":{}}})", one, file.floats({1, 2, 3}, "VEC3", 3));
  EXPECT_TRUE(says(notice(fmt::format(R"({{"input":{},"output":{}}})", down, output)),
                   "ascending times are expected. Its animation is skipped"));
  EXPECT_TRUE(says(notice(fmt::format(R"({{"input":{},"output":{}}})", one, output)),
                   "1 values are expected, got 2. Its animation is skipped"));
  EXPECT_TRUE(says(notice(fmt::format(R"({{"input":{},"output":{},"interpolation":"BEZIER"}})", one, output)),
                   "LINEAR, STEP or CUBICSPLINE is expected, got \"BEZIER\""));
  EXPECT_TRUE(says(notice(good, "visibility"), "\"visibility\" cannot be animated"));
  EXPECT_TRUE(says(notice(good, "translation", R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])"),
                   "a node with a matrix cannot be animated"));
}

}  // namespace
}  // namespace lightmill
