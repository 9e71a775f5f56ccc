// Periodic checks of a running coordinator: its certificate's files, and the space on its disk.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "common/security/tls_files.h"

namespace lightmill {

/// Not thread-safe.
class HostMonitor {
 public:
  /// `disk`: a folder on the disk; empty: none. `set_space` receives the reason why nothing more may be stored there.
  /// Empty: there is space.
  HostMonitor(TlsFiles tls, std::filesystem::path disk, std::uint64_t reserve_bytes,
              std::function<void(const std::string&)> set_space)
      : tls_(std::move(tls)), disk_(std::move(disk)), reserve_bytes_(reserve_bytes), set_space_(std::move(set_space)) {}

  void check(std::int64_t now_unix_s);

 private:
  void check_certificate(std::int64_t now_unix_s);
  void tell_renewal(const TlsTexts& texts);
  void check_disk();

  const TlsFiles tls_;
  const std::filesystem::path disk_;
  const std::uint64_t reserve_bytes_;
  const std::function<void(const std::string&)> set_space_;
  std::string wrong_;                    ///< problem with the certificate, as last reported
  std::string certificate_, authority_;  ///< as last read, PEM
  std::int64_t end_told_at_unix_s_ = 0;  ///< when its coming expiry was last reported
  bool full_ = false;
};

}  // namespace lightmill
