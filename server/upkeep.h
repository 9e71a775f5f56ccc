// What a coordinator looks at again and again while it runs: its certificate's files, and the space on its disk.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "common/security/tls_files.h"

namespace lightmill {

/// Not thread-safe.
class Upkeep {
 public:
  /// `disk`: a folder on it; empty: none. `set_space` is told why no more is to be stored there; empty: it may.
  Upkeep(TlsFiles tls, std::filesystem::path disk, std::uint64_t reserve_bytes,
         std::function<void(const std::string&)> set_space)
      : tls_(std::move(tls)), disk_(std::move(disk)), reserve_bytes_(reserve_bytes), set_space_(std::move(set_space)) {}

  void look(std::int64_t now_unix_s);

 private:
  void look_at_certificate(std::int64_t now_unix_s);
  void look_at_disk();

  const TlsFiles tls_;
  const std::filesystem::path disk_;
  const std::uint64_t reserve_bytes_;
  const std::function<void(const std::string&)> set_space_;
  std::string wrong_;                    ///< with the certificate, as last told
  std::int64_t end_told_at_unix_s_ = 0;  ///< when it was last said that it ends soon
  bool full_ = false;
};

}  // namespace lightmill
