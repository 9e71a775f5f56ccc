// What every store must do, whatever keeps it: the same tests run on each.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/store/store.h"

namespace lightmill::test {

/// Makes stores over one lasting place. Each call opens it anew, as a coordinator that starts again does; the store of
/// the call before has been destroyed.
using StoreFactory = std::function<std::unique_ptr<Store>()>;

/// A job with every field set to something of its own.
JobRecord full_record(std::uint64_t id);
/// A node of 2×2 pixels whose values tell it apart.
std::shared_ptr<const Node> small_node(std::uint32_t level, std::uint32_t index, float value);

/// Everything that a store holds as text, in an order of its own; equal states give equal texts.
std::string describe(const StoredState& state);

// Each fact is one function; a store's test file calls them all on fresh places.
void expect_starts_empty(const StoreFactory& open);
void expect_epochs_grow(const StoreFactory& open);
void expect_job_round_trips(const StoreFactory& open);
void expect_later_row_replaces(const StoreFactory& open);
void expect_chosen_method_is_kept(const StoreFactory& open);
void expect_forest_is_kept(const StoreFactory& open);
void expect_order_within_a_commit(const StoreFactory& open);
void expect_delete_forgets_all_but_the_id(const StoreFactory& open);
void expect_failed_commit_leaves_nothing(const StoreFactory& open);
void expect_coalescing_changes_nothing(const StoreFactory& open, const StoreFactory& open_other);

}  // namespace lightmill::test
