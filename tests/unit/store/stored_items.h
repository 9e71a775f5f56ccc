// Items of a store for tests that damage it: each one is there, or the store names it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/farm/job.h"
#include "server/domain/stored_rows.h"

namespace lightmill::test {

/// Writes of a job, and of an entry of the log, a token and a quarantine. The crop is part of four tiles of a picture of
/// 128×128 pixels.
std::vector<StoreOp> writes_of_job(std::uint64_t id, const PixelRect& crop = {0, 0, 128, 128});
inline constexpr std::size_t kItemsOfAJob = 12;

/// Contents of a loaded store, item by item.
std::map<std::string, std::string> items_of(const StoredState& state);

/// Checks that everything that is missing or changed is named.
void expect_named(const StoredState& state, const std::map<std::string, std::string>& before);
bool names_damage(const StoredState& state);

}  // namespace lightmill::test
