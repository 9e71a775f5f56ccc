// Grants: proofs that the coordinator granted samples to a worker.
//
// A tag is an HMAC-SHA-256 over all fields of a grant of one tile. Its key derives from the store's secret. So no table
// of former leases is needed. Every coordinator of the farm recognises its tags, even after restarts and lost leases.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/farm/messages.h"

namespace lightmill {

class GrantSigner {
 public:
  /// `secret`: the store's.
  explicit GrantSigner(const Sha256& secret);

  /// Name of the farm. It reveals nothing about the secret.
  const Hash128& farm() const { return farm_; }
  /// Tag of samples `key` of a job with this render digest, which `lease` grants to the worker.
  Sha256 tag(const std::string& worker, LeaseId lease, const Sha256& render_digest, const NodeKey& key) const;
  /// Whether `tag` is the right tag. Constant time, wherever a wrong tag differs.
  bool verify(const Sha256& tag, const std::string& worker, LeaseId lease, const Sha256& render_digest,
              const NodeKey& key) const;

 private:
  Sha256 key_;
  Hash128 farm_;
};

}  // namespace lightmill
