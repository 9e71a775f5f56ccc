// Conformance tests of asset stores. A test program runs them by instantiating AssetConformance.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/store/asset_store.h"

namespace lightmill::test {

/// The place of an asset store's data. It is empty at first, and is deleted with its owner.
class AssetPlace {
 public:
  virtual ~AssetPlace() = default;
  /// Opens the store again, after the previous one has been destroyed.
  virtual std::unique_ptr<AssetStore> open(AssetLimits limits) = 0;
  /// Leaves the traces of a 7-byte upload whose coordinator was killed. No store is open.
  virtual void leave_half_an_upload() = 0;
  /// Makes all assets older by this time.
  virtual void age(std::chrono::seconds by) = 0;
  /// Whether there are parts of unfinished uploads.
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
