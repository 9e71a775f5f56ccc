// What every store must do, whatever keeps it: a test program that instantiates StoreConformance holds its store to it.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "server/store/store.h"

namespace lightmill::test {

/// Where one store's state lasts; empty at first, and gone with its owner.
class StorePlace {
 public:
  virtual ~StorePlace() = default;
  /// Opens the store anew, as a coordinator that starts again does; the one before has been destroyed.
  virtual std::unique_ptr<Store> open() = 0;
  /// Makes zeros of all stored pixels of the tile; no store is open.
  virtual void damage_tile(std::uint32_t tile) = 0;
  /// Changes rows behind the store's back: `UPDATE table SET change`; no store is open.
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

/// A job with every field set to something of its own.
JobRecord full_record(std::uint64_t id);
/// A node of 2×2 pixels whose values tell it apart.
std::shared_ptr<const Node> small_node(std::uint32_t level, std::uint32_t index, float value);

/// What the stores of earlier formats hold that tests migrate (format_12.sql, format_6.sql).
StoredState state_of_the_format_before();

/// What the store loads, with the values of all films. Damaged nodes are among the damaged ones.
Result<StoredState> load_with_films(Store& store);

/// Everything that a store holds as text, in an order of its own; equal states give equal texts.
std::string describe(const StoredState& state);

}  // namespace lightmill::test
