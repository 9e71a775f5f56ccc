// Tokens: secrets that authenticate programs and people without a certificate.
#pragma once

#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// "lightmill_ID_SECRET": an id of 12 and a secret of 64 hex digits (256 random bits). The farm keeps only the SHA-256
/// of the text. The secret is too long to be guessed, so no slower hash is needed.
struct NewToken {
  std::string text, id;
  Sha256 hash;
};

/// A new token, from the system's random numbers.
Result<NewToken> make_token();
/// An existing token, from its text. INVALID_ARGUMENT as in token_id.
Result<NewToken> token_of(std::string text);

/// The id in a token's text. INVALID_ARGUMENT unless it has the form above. The error does not contain the text.
Result<std::string> token_id(std::string_view text);

/// Whether `id` has the form of a token's id.
bool is_token_id(std::string_view id);

/// Compares in constant time.
bool same_digest(const Sha256& a, const Sha256& b);

}  // namespace lightmill
