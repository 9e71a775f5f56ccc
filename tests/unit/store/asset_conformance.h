// What every store of assets must do: a test program that instantiates AssetConformance holds its store to it.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/store/asset_store.h"

namespace lightmill::test {

/// Where assets last; empty at first, and gone with its owner.
class AssetPlace {
 public:
  virtual ~AssetPlace() = default;
  /// Opens the store anew; the one before has been destroyed.
  virtual std::unique_ptr<AssetStore> open(AssetLimits limits) = 0;
  /// Leaves what an upload of 7 bytes does whose coordinator was killed; no store is open.
  virtual void leave_half_an_upload() = 0;
  /// All assets that are there came so much earlier.
  virtual void age(std::chrono::seconds by) = 0;
  /// Whether there is anything of unfinished uploads.
  virtual bool has_halves() = 0;
};

struct AssetKind {
  std::string name;
  std::function<std::unique_ptr<AssetPlace>()> make;

  friend void PrintTo(const AssetKind& kind, std::ostream* out) { *out << kind.name; }
};

class AssetConformance : public ::testing::TestWithParam<AssetKind> {
 protected:
  std::unique_ptr<AssetStore> open(AssetLimits limits = {}) { return place_->open(limits); }
  std::unique_ptr<AssetPlace> place_ = GetParam().make();
};

}  // namespace lightmill::test
