// Tokens: secrets by which programs and people without a certificate show who they are.
#pragma once

#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// "lightmill_ID_SECRET", with an id of 12 and a secret of 64 hex digits (256 random bits). The farm keeps the SHA-256
/// of the text alone: a secret so long cannot be found by trying, so nothing slower is needed.
struct NewToken {
  std::string text, id;
  Sha256 hash;
};

/// From the system's random numbers.
Result<NewToken> make_token();
/// One that was made before, of its text. INVALID_ARGUMENT as token_id.
Result<NewToken> token_of(std::string text);

/// The id within a token's text; INVALID_ARGUMENT unless it has the form above. Does not repeat the text.
Result<std::string> token_id(std::string_view text);

/// Whether `id` can be one.
bool is_token_id(std::string_view id);

/// Takes as long for any two digests.
bool same_digest(const Sha256& a, const Sha256& b);

}  // namespace lightmill
