// What reads bytes from outside, called as where they arrive. Each returns whether it took them, and stops the program
// (LM_CHECK) where what came out is not sound. Tests and libFuzzer programs share them.
#pragma once

#include <string_view>

namespace lightmill::fuzz {

/// Image files that scenes name. The first byte chooses the file's ending.
bool try_image(std::string_view bytes);
/// Pictures of films, with the receipt that `lightmill verify` reads, and PNGs to compare with. The first byte chooses.
bool try_picture(std::string_view bytes);
/// Certificates and keys, tokens, roles, addresses, names. The first byte chooses.
bool try_credential(std::string_view bytes);
/// Profiles of lamps (IES).
bool try_profile(std::string_view bytes);

}  // namespace lightmill::fuzz
