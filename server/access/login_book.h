// Who is logged in on the page: for whom the secret in a browser's cookie stands, and until when.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

/// Not thread-safe. Keeps of a secret its SHA-256 alone, in memory: a coordinator that starts knows nobody.
class LoginBook {
 public:
  /// A login ends after so long, or with the token that it was made with.
  static constexpr std::int64_t kLoginSeconds = std::int64_t{7} * 24 * 60 * 60;
  static constexpr std::size_t kMostLogins = 2'000;
  /// Of one token; an older one goes for a new one.
  static constexpr std::size_t kMostOfOne = 100;

  /// From now on the secret stands for `caller`, who has shown a token. Returns until when. RESOURCE_EXHAUSTED.
  Result<std::int64_t> add(std::string_view secret, const Identity& caller, std::int64_t now_unix_s);
  /// UNAUTHENTICATED of one that is unknown or has ended. Whether the token holds still is asked elsewhere.
  Result<Identity> identify(std::string_view secret, std::int64_t now_unix_s) const;
  /// Forgets those of callers of whom `holds` says no more.
  void keep(const std::function<bool(const Identity&)>& holds);
  /// The secret stands for nobody any more.
  void remove(std::string_view secret);
  std::size_t size() const { return logins_.size(); }

 private:
  struct Login {
    Identity caller;
    std::int64_t until_unix_s = 0;
    std::uint64_t number = 0;
  };
  void make_room(const Identity& caller, std::int64_t now_unix_s);

  std::map<Sha256, Login> logins_;
  std::uint64_t next_ = 1;
};

}  // namespace lightmill
