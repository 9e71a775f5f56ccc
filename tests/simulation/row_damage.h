// Damage to one row of a store's SQLite file. It is done through SQLite, so the file itself stays valid.
#pragma once

#include <filesystem>
#include <string>

#include "tests/simulation/random.h"

namespace lightmill::simulation {

/// Flips a bit of one value. Returns the table's name.
std::string flip_bit_in_row(const std::filesystem::path& database, Random& random);
/// Deletes a row. Returns the table's name.
std::string lose_row(const std::filesystem::path& database, Random& random);
/// Changes a sample of a node, and its hash and the sums over rows to match. False if there is no node.
bool forge_node(const std::filesystem::path& database, Random& random);

}  // namespace lightmill::simulation
