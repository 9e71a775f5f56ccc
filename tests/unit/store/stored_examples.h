// Example records of stores, and a store's content as text.
#pragma once

#include <memory>
#include <string>

#include "server/store/store.h"

namespace lightmill::test {

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
