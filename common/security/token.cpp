#include "common/security/token.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>

#include "common/security/openssl_handles.h"

namespace lightmill {
namespace {

constexpr std::string_view kStart = "lightmill_";
constexpr std::size_t kIdDigits = 12, kSecretDigits = 64;

bool is_hex(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

}  // namespace

Result<NewToken> make_token() {
  std::array<unsigned char, (kIdDigits + kSecretDigits) / 2> random{};
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1) {
    return internal_error("cannot draw random numbers: {}", openssl::last_error());
  }
  std::string digits;
  for (const unsigned char byte : random) {
    digits += fmt::format("{:02x}", byte);
  }
  NewToken token;
  token.id = digits.substr(0, kIdDigits);
  token.text = fmt::format("{}{}_{}", kStart, token.id, digits.substr(kIdDigits));
  token.hash = sha256(token.text);
  return token;
}

Result<NewToken> token_of(std::string text) {
  LM_ASSIGN_OR_RETURN(std::string id, token_id(text));
  const Sha256 hash = sha256(text);
  return NewToken{std::move(text), std::move(id), hash};
}

Result<std::string> token_id(std::string_view text) {
  const bool fits = text.size() == kStart.size() + kIdDigits + 1 + kSecretDigits && text.starts_with(kStart) &&
                    text[kStart.size() + kIdDigits] == '_' && is_token_id(text.substr(kStart.size(), kIdDigits)) &&
                    is_hex(text.substr(kStart.size() + kIdDigits + 1));
  return fits ? Result<std::string>(std::string(text.substr(kStart.size(), kIdDigits)))
              : invalid_argument("that is not a token: `lightmill tokens create` prints one, which begins with {}",
                                 kStart);
}

bool is_token_id(std::string_view id) {
  return id.size() == kIdDigits && is_hex(id);
}

bool same_digest(const Sha256& a, const Sha256& b) {
  return CRYPTO_memcmp(a.bytes.data(), b.bytes.data(), a.bytes.size()) == 0;
}

}  // namespace lightmill
