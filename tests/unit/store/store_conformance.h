// Conformance tests of stores. A test program runs them by instantiating StoreConformance.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "tests/unit/store/stored_examples.h"

namespace lightmill::test {

/// The place of one store's state. It is empty at first, and is deleted with its owner.
class StorePlace {
 public:
  virtual ~StorePlace() = default;
  /// Opens the store again, as a restarted coordinator does, after the previous one has been destroyed.
  virtual std::unique_ptr<Store> open(bool accept_loss) = 0;
  /// Sets all stored pixels of the tile to zero. No store is open.
  virtual void damage_tile(std::uint32_t tile) = 0;
  /// Changes rows without the store. No store is open.
  virtual void execute(const std::string& sql) = 0;
  void update(const std::string& table, const std::string& change) {
    execute(fmt::format("UPDATE {} SET {}", table, change));
  }
};

struct StoreKind {
  std::string name;
  std::function<std::unique_ptr<StorePlace>()> make;

  friend void PrintTo(const StoreKind& kind, std::ostream* out) { *out << kind.name; }
};

class StoreConformance : public ::testing::TestWithParam<StoreKind> {
 protected:
  std::unique_ptr<Store> open() { return place_->open(false); }
  std::unique_ptr<Store> open_accepting_loss() { return place_->open(true); }
  /// Expects that the store is refused, and that the reason begins so.
  void expect_refused(const std::string& reason);
  static StoredState loaded(Store& store);
  static void commit(Store& store, const std::vector<StoreOp>& ops);
  std::unique_ptr<StorePlace> place_ = GetParam().make();
};

}  // namespace lightmill::test
