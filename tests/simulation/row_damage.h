// Damage to one row of a store's SQLite file, done through SQLite, so that the file itself is sound afterwards.
#pragma once

#include <filesystem>
#include <string>

#include "tests/simulation/random.h"

namespace lightmill::simulation {

/// Flips a bit of one value. Returns the table's name.
std::string flip_bit_in_row(const std::filesystem::path& database, Random& random);
/// Deletes a row. Returns the table's name.
std::string lose_row(const std::filesystem::path& database, Random& random);
/// Changes a sample of a node, and its hash to fit. Returns false if there is no node.
bool forge_node(const std::filesystem::path& database, Random& random);

}  // namespace lightmill::simulation
