#include "server/domain/grant_signer.h"

namespace lightmill {
namespace {

/// Each use of the secret has a key of its own.
Sha256 key_for(const Sha256& secret, std::string_view use) {
  return hmac_sha256(secret, as_byte_view(use));
}

void append(std::string& text, std::uint64_t value) {
  for (int shift = 0; shift < 64; shift += 8) {
    text.push_back(static_cast<char>(value >> shift));
  }
}

}  // namespace

GrantSigner::GrantSigner(const Sha256& secret) : key_(key_for(secret, "lightmill grant")) {
  const Sha256 name = key_for(secret, "lightmill farm");
  for (int i = 0; i < 8; ++i) {
    farm_.high = farm_.high << 8 | name.bytes[i];
    farm_.low = farm_.low << 8 | name.bytes[8 + i];
  }
}

Sha256 GrantSigner::tag(const std::string& worker, LeaseId lease, const Sha256& render_digest,
                        const NodeKey& key) const {
  std::string text;
  for (const std::uint64_t value : {lease.value, key.job.value, std::uint64_t{key.tile.value},
                                    std::uint64_t{key.range.level}, std::uint64_t{key.range.index}}) {
    append(text, value);
  }
  text.append(render_digest.bytes.begin(), render_digest.bytes.end());
  text += worker;  // the only part whose length varies comes last
  return hmac_sha256(key_, as_byte_view(text));
}

bool GrantSigner::verify(const Sha256& tag, const std::string& worker, LeaseId lease, const Sha256& render_digest,
                         const NodeKey& key) const {
  const Sha256 right = this->tag(worker, lease, render_digest, key);
  unsigned different = 0;
  for (std::size_t i = 0; i < right.bytes.size(); ++i) {
    different |= static_cast<unsigned>(right.bytes[i] ^ tag.bytes[i]);
  }
  return different == 0;
}

}  // namespace lightmill
