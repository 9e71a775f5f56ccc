// Readers of bytes from outside, called as in the program. Each returns whether it accepted the bytes, and stops the
// program (LM_CHECK) if its result is invalid. Tests and libFuzzer programs share them.
#pragma once

#include <string_view>

namespace lightmill::fuzz {

/// Image files of scenes. The first byte chooses the file's extension.
bool try_image(std::string_view bytes);
/// Pictures of films, with the receipt that `lightmill verify` reads, and PNGs to compare with. The first byte chooses.
bool try_picture(std::string_view bytes);
/// Certificates and keys, tokens, roles, addresses, names. The first byte chooses.
bool try_credential(std::string_view bytes);
/// Light profiles (IES).
bool try_profile(std::string_view bytes);

}  // namespace lightmill::fuzz
