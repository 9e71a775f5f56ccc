// Periodic checks of a running coordinator: its certificate's files, its data folder, and the space on its disk.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "common/security/tls_files.h"

namespace lightmill {

/// Not thread-safe.
class HostMonitor {
 public:
  /// `data`: the data folder; empty: none. `set_space` receives the reason why nothing more may be stored there. Empty:
  /// there is space.
  HostMonitor(TlsFiles tls, std::filesystem::path data, std::uint64_t reserve_bytes,
              std::function<void(const std::string&)> set_space)
      : tls_(std::move(tls)),
        data_(std::move(data)),
        folder_(folder_at(data_)),
        reserve_bytes_(reserve_bytes),
        set_space_(std::move(set_space)) {}

  void check(std::int64_t now_unix_s);

 private:
  void check_certificate(std::int64_t now_unix_s);
  void tell_renewal(const TlsTexts& texts);
  /// Device and number of the folder at a path; zeros if there is none.
  using Folder = std::pair<std::uint64_t, std::uint64_t>;
  static Folder folder_at(const std::filesystem::path& path);
  void check_disk();
  std::string why_no_space();

  const TlsFiles tls_;
  const std::filesystem::path data_;
  const Folder folder_;
  const std::uint64_t reserve_bytes_;
  const std::function<void(const std::string&)> set_space_;
  std::string wrong_;                    ///< problem with the certificate, as last reported
  std::string certificate_, authority_;  ///< as last read, PEM
  std::int64_t end_told_at_unix_s_ = 0;  ///< when its coming expiry was last reported
  bool full_ = false;
  std::string no_space_;  ///< as last reported
};

}  // namespace lightmill
