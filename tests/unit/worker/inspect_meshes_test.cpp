// Uploaded glTF files with compressed meshes: read with the worker's decoder, within the worker's limits.
#include <gtest/gtest.h>

#include "common/scene/mesh.h"
#include "tests/support/draco_file.h"
#include "tests/support/error_message.h"
#include "tests/support/paths.h"
#include "tests/unit/scene_io/gltf_text.h"
#include "worker/inspect/inspect_scene.h"

namespace lightmill {
namespace {

/// A file with the positions of a grid of `side`² vertices.
std::string compressed_file(std::uint32_t side) {
  test::DracoSource grid = test::draco_grid(side);
  grid.attributes.resize(1);
  const std::string bytes = test::draco_file(grid, test::DracoMethod::edgebreaker);
  return test::gltf(fmt::format(
      R"("extensionsRequired":["KHR_draco_mesh_compression"],"buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}],
"bufferViews":[{{"buffer":0,"byteLength":{}}}],"accessors":[{{"count":{},"type":"VEC3","componentType":5126}},
{{"count":{},"type":"SCALAR","componentType":5125}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[
{{"attributes":{{"POSITION":0}},"indices":1,"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,
"attributes":{{"POSITION":0}}}}}}}}]}}])",
      bytes.size(), test::base64(bytes), bytes.size(), grid.vertices, 3 * grid.triangles.size()));
}

struct Found {
  Result<Inspection> inspection;
  std::map<Sha256, std::string> uploaded;
};

Found inspect(const std::string& file, const DecoderOptions& options, const SceneLimits& limits = {}) {
  DecoderProcess decoder(options);
  Found found{internal_error("not read"), {}};
  const InspectionRequest request{{{"a.gltf", sha256(file)}}, {"a.gltf"}, ""};
  found.inspection = inspect_scene(request, limits, decoder,
                                   {[&](const Sha256&) { return Result<std::string>(file); },
                                    [&](const auto& assets) {
                                      found.uploaded = assets;
                                      return ok_status();
                                    }});
  return found;
}

TEST(InspectMeshes, CompressedMeshesBecomeAssets) {
  const Found found = inspect(compressed_file(4), {.program = test::program("lightmill-image-decoder")});
  ASSERT_TRUE(found.inspection.ok()) << found.inspection.status();
  ASSERT_EQ(found.uploaded.size(), 2u) << "the mesh and the sky";
  const auto asset =
      std::ranges::find_if(found.uploaded, [](const auto& each) { return each.second.starts_with("LMM1"); });
  ASSERT_NE(asset, found.uploaded.end());
  const Result<Mesh> mesh = decode_mesh(as_byte_view(asset->second));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->positions.size(), 16u);
  EXPECT_EQ(mesh->triangles.size(), 18u);
}

TEST(InspectMeshes, AWorkerWithoutADecoderSaysThatItIsNotTheFile) {
  const Status status = inspect(compressed_file(2), {.program = "/nowhere"}).inspection.status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(
      message_of(status),
      "a.gltf: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: cannot start /nowhere: No such file or "
      "directory. Install it beside this program");
  const std::string damaged = test::gltf(R"("extensionsRequired":["none"])");
  EXPECT_EQ(inspect(damaged, {.program = "/nowhere"}).inspection.status().code(), StatusCode::kInvalidArgument);
}

TEST(InspectMeshes, AllMeshesTogetherHaveALimit) {
  SceneLimits limits;
  limits.bytes = 8 * 65536;
  const Status status =
      inspect(compressed_file(60), {.program = test::program("lightmill-image-decoder")}, limits).inspection.status();
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(
      message_of(status),
      "a.gltf: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: the scene's compressed meshes have more "
      "than 64.0 KiB, which is 1/8 of the worker's --scene-gib: `lightmill submit` reads them on your machine");
}

}  // namespace
}  // namespace lightmill
