// Checks before a job or a scene's files are accepted.
#include <gtest/gtest.h>

#include <fstream>

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
  const Sha256 large = put_hollow_asset(folder.path(), "large", handlers::kMostInspectedBytes);
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

}  // namespace
}  // namespace lightmill::test
