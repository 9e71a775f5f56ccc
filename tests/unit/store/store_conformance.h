// Conformance tests of stores. A test program runs them by instantiating StoreConformance.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "server/store/store.h"

namespace lightmill::test {

/// The place of one store's state. It is empty at first, and is deleted with its owner.
class StorePlace {
 public:
  virtual ~StorePlace() = default;
  /// Opens the store again, as a restarted coordinator does, after the previous one has been destroyed.
  virtual std::unique_ptr<Store> open() = 0;
  /// Sets all stored pixels of the tile to zero. No store is open.
  virtual void damage_tile(std::uint32_t tile) = 0;
  /// Changes rows without the store: `UPDATE table SET change`. No store is open.
  virtual void update(const std::string& table, const std::string& change) = 0;
};

struct StoreKind {
  std::string name;
  std::function<std::unique_ptr<StorePlace>()> make;

  friend void PrintTo(const StoreKind& kind, std::ostream* out) { *out << kind.name; }
};

class StoreConformance : public ::testing::TestWithParam<StoreKind> {
 protected:
  std::unique_ptr<Store> open() { return place_->open(); }
  std::unique_ptr<StorePlace> place_ = GetParam().make();
};

/// A job with a distinct value in every field.
JobRecord full_record(std::uint64_t id);
/// A node of 2×2 pixels with recognizable values.
std::shared_ptr<const Node> small_node(std::uint32_t level, std::uint32_t index, float value);

/// The state in the stores of earlier formats that tests migrate (format_12.sql, format_6.sql).
StoredState state_of_the_format_before();

/// The store's state with the values of all films. Damaged nodes are listed with the damaged ones.
Result<StoredState> load_with_films(Store& store);

/// A store's whole content as text, in a fixed order. Equal states give equal texts.
std::string describe(const StoredState& state);

}  // namespace lightmill::test
