#include "server/host_monitor.h"

#include <sys/stat.h>

#include <algorithm>

#include "common/base/log.h"
#include "common/base/number_text.h"

namespace lightmill {
namespace {

constexpr std::int64_t kDaySeconds = 24 * 60 * 60;
constexpr std::int64_t kSoonSeconds = 14 * kDaySeconds;
/// Work resumes at this multiple of the reserve, so it does not stop again at once.
constexpr double kRoom = 1.1;

}  // namespace

void HostMonitor::check(std::int64_t now_unix_s) {
  if (tls_.given()) {
    check_certificate(now_unix_s);
  }
  if (!data_.empty()) {
    check_disk();
  }
}

void HostMonitor::check_certificate(std::int64_t now_unix_s) {
  const Result<TlsTexts> texts = read_tls_files(tls_, now_unix_s);
  const std::string wrong = texts.ok() ? "" : message_of(texts.status());
  if (wrong != wrong_) {
    wrong_ = wrong;
    if (wrong.empty()) {
      spdlog::info("the files of the certificate are in order again");
    } else {
      spdlog::warn(
          "the new certificate files cannot be used: {}. New connections may fail, or use the earlier certificate. Correct "
          "the files. They are read again within seconds",
          wrong);
    }
  }
  if (texts.ok()) {
    tell_renewal(*texts);
  }
  if (!texts.ok() || now_unix_s - end_told_at_unix_s_ < kDaySeconds) {
    return;
  }
  const Result<std::vector<CertificateFacts>> facts = read_certificates(texts->certificate);
  if (facts.ok() && facts->front().until_unix_s - now_unix_s < kSoonSeconds) {
    end_told_at_unix_s_ = now_unix_s;
    spdlog::warn("{} {}: the certificate expires {}: renew it", kCertificateOption, tls_.certificate,
                 date_text(facts->front().until_unix_s));
  }
}

void HostMonitor::tell_renewal(const TlsTexts& texts) {
  const auto is_new = [](std::string& known, const std::string& text) {
    const std::string before = std::exchange(known, text);
    return !before.empty() && before != text;
  };
  if (is_new(certificate_, texts.certificate)) {
    if (const auto all = read_certificates(texts.certificate); all.ok()) {
      spdlog::info("read the new certificate of {} {}: '{}', valid until {}", kCertificateOption, tls_.certificate,
                   all->front().name, date_text(all->front().until_unix_s));
    }
  }
  if (is_new(authority_, texts.authority)) {
    std::vector<std::string> names;
    if (const auto all = read_certificates(texts.authority); all.ok()) {
      std::ranges::transform(*all, std::back_inserter(names), &CertificateFacts::name);
    }
    spdlog::info("read the new authorities of {} {}: {}", kAuthorityOption, tls_.authority, fmt::join(names, ", "));
  }
}

HostMonitor::Folder HostMonitor::folder_at(const std::filesystem::path& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 ? Folder(found.st_dev, found.st_ino) : Folder();
}

void HostMonitor::check_disk() {
  if (const std::string why = why_no_space(); why != no_space_) {
    no_space_ = why;
    set_space_(why);
  }
}

std::string HostMonitor::why_no_space() {
  // Open files outlive their folder, so that commits to it succeed and are lost.
  if (folder_at(data_) != folder_) {
    return fmt::format(
        "waits for its data: {} was moved or deleted while the coordinator ran. Put it back, or stop the coordinator and "
        "restore a backup",
        data_.string());
  }
  std::error_code error;
  const std::uint64_t free_bytes = std::filesystem::space(data_, error).available;
  if (error || reserve_bytes_ == 0) {
    return "";  // commits report the error
  }
  full_ = static_cast<double>(free_bytes) < static_cast<double>(reserve_bytes_) * (full_ ? kRoom : 1);
  return !full_
             ? ""
             : fmt::format(
                   "waits for space: the disk of {} has less than --reserve-gib {:g} left: delete ended jobs, or free "
                   "space. Work continues when a tenth more is free",
                   data_.string(), gib(reserve_bytes_));
}

}  // namespace lightmill
