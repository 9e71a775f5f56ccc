#include "server/store/asset_folder.h"

#include <fstream>

#include "tests/support/temporary_folder.h"
#include "tests/unit/store/asset_conformance.h"

namespace lightmill::test {
namespace {

class FolderPlace final : public AssetPlace {
 public:
  std::unique_ptr<AssetStore> open(AssetLimits limits) override { return open_asset_folder(assets_, limits).value(); }
  void leave_half_an_upload() override { std::ofstream(assets_ / "incoming" / "left-over") << "rubbish"; }
  void age(std::chrono::seconds by) override {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(assets_)) {
      std::filesystem::last_write_time(entry, entry.last_write_time() - by);
    }
  }
  bool has_halves() override { return !std::filesystem::is_empty(assets_ / "incoming"); }

 private:
  TemporaryFolder folder_;
  std::filesystem::path assets_ = folder_.path() / "assets";
};

INSTANTIATE_TEST_SUITE_P(Folder, AssetConformance,
                         ::testing::Values(AssetKind{"folder", [] { return std::make_unique<FolderPlace>(); }}),
                         [](const auto& info) { return info.param.name; });

TEST(AssetFolder, UploadsLeaveTheReserveFree) {
  const TemporaryFolder folder;
  const std::uint64_t free_bytes = std::filesystem::space(folder.path()).available;
  const auto code = [&](std::uint64_t reserve_bytes) {
    const auto store = open_asset_folder(folder.path() / "assets", {.reserve_bytes = reserve_bytes}).value();
    const Status status = store->start_upload(sha256("bytes")).value()->append(as_byte_view("bytes"));
    EXPECT_EQ(store->check_room(sha256("bytes"), "ada", 5).code(), status.code());
    EXPECT_TRUE(status.ok() || message_of(status).find("less than --reserve-gib") != std::string::npos) << status;
    EXPECT_EQ(store->total_bytes(), 0u);
    return status.code();
  };
  EXPECT_EQ(code(2 * free_bytes), StatusCode::kResourceExhausted);
  EXPECT_EQ(code(free_bytes / 2), StatusCode::kOk);
}

}  // namespace
}  // namespace lightmill::test
