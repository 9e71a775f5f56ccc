// Grants: proof that the coordinator gave these samples to this worker.
//
// A tag is an HMAC-SHA-256 with a key from the store's secret, over all that a grant of one tile says. So no table of
// former leases is needed: every coordinator of the farm knows its own tags, after restarts and long after the lease is
// lost.
#pragma once

#include <string>

#include "common/base/digest.h"
#include "common/farm/messages.h"

namespace lightmill {

class Grants {
 public:
  /// `secret`: the store's.
  explicit Grants(const Sha256& secret);

  /// Names the farm. Says nothing of the secret.
  const Hash128& farm() const { return farm_; }
  /// Of samples `key` of a job with this render digest, which `lease` gives to the worker.
  Sha256 tag(const std::string& worker, LeaseId lease, const Sha256& render_digest, const NodeKey& key) const;
  /// Whether `tag` is that tag. Takes as long for a wrong one, wherever it differs.
  bool are_proven(const Sha256& tag, const std::string& worker, LeaseId lease, const Sha256& render_digest,
                  const NodeKey& key) const;

 private:
  Sha256 key_;
  Hash128 farm_;
};

}  // namespace lightmill
