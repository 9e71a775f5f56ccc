// Counts and byte sizes as text for people.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lightmill {

/// "1 plane", "2 planes".
std::string counted(std::size_t number, std::string_view noun);

/// Three significant digits: "1.50", "45.6", "789".
std::string three_digits(double value);

/// "1.5 MiB".
std::string human_bytes(std::uint64_t bytes);

}  // namespace lightmill
