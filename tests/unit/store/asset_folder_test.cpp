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

}  // namespace
}  // namespace lightmill::test
