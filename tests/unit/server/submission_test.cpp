// Checks before a job or a scene's files are accepted.
#include <gtest/gtest.h>

#include <fstream>

#include "common/wire/farm_messages.h"
#include "server/operations/handlers.h"
#include "server/store/asset_folder.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

/// An asset of `bytes` that take no room on the disk. Nothing reads them, so any digest will do.
Sha256 put_hollow_asset(const std::filesystem::path& assets, const std::string& name, std::uint64_t bytes) {
  const Sha256 digest = sha256(name);
  const std::filesystem::path file = assets / digest.hex().substr(0, 2) / digest.hex().substr(2);
  std::filesystem::create_directories(file.parent_path());
  std::ofstream{file};
  std::filesystem::resize_file(file, bytes);
  return digest;
}

TEST(CheckFiles, RefusesMissingAndTooLargeFiles) {
  const TemporaryFolder folder;
  const Sha256 large = put_hollow_asset(folder.path(), "large", handlers::kMaxInspectedBytes);
  const Sha256 small = put_hollow_asset(folder.path(), "small", 1);
  const auto assets = open_asset_folder(folder.path(), {}).value();

  InspectionRequest request;
  request.files = {{"a.obj", large}};
  EXPECT_TRUE(handlers::check_files(request, *assets).ok());
  request.files.push_back({"a.mtl", small});
  const Status too_large = handlers::check_files(request, *assets);
  EXPECT_EQ(too_large.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(message_of(too_large).find("512 MiB"), std::string::npos) << message_of(too_large);

  request.files = {{"b\x1b.obj", sha256("nowhere")}};
  const Status missing = handlers::check_files(request, *assets);
  EXPECT_EQ(missing.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(message_of(missing).find('\x1b'), std::string::npos);
  EXPECT_NE(message_of(missing).find(sha256("nowhere").hex()), std::string::npos) << message_of(missing);
}

TEST(FillDefaults, ASceneAndASizeMakeACompleteJob) {
  v1::SubmitJobRequest request;
  request.set_request_id("r");
  request.mutable_job()->mutable_goal()->set_samples(1);
  v1::RenderSettings& settings = *request.mutable_job()->mutable_settings();
  settings.set_width(6);
  settings.set_height(4);
  EXPECT_FALSE(from_wire(request).ok());
  handlers::fill_defaults(settings);
  const JobSpec spec = from_wire(request).value();
  EXPECT_EQ(spec.settings.crop, (PixelRect{0, 0, 6, 4}));
  EXPECT_EQ(spec.settings.layers, std::vector<LayerSpec>{LayerSpec{}});
  EXPECT_EQ(spec.settings.method, "auto");
  EXPECT_EQ(spec.settings.renderer_version, kRendererVersion);
}

TEST(FillDefaults, GivenValuesStay) {
  v1::RenderSettings settings;
  settings.set_width(6);
  settings.set_height(4);
  settings.mutable_crop()->set_width(1);
  settings.add_layers()->set_name("normal");
  settings.set_method("path");
  settings.set_renderer_version("other");
  const std::string before = settings.SerializeAsString();
  handlers::fill_defaults(settings);
  EXPECT_EQ(settings.SerializeAsString(), before);
}

}  // namespace
}  // namespace lightmill::test
