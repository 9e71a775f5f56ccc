// Commit chain: a mark of the last acknowledged commit, in a file of its own. It shows when a database has lost commits.
//
// SQLite reads its journal up to the first damaged frame and drops the rest silently. So one flipped bit could lose
// acknowledged jobs. The mark is written after each commit, before its acknowledgement.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// How many commits a store has.
struct CommitMark {
  std::array<std::uint8_t, 16> store{};  ///< the store's id
  std::uint64_t commits = 0;
  Hash128 hash;                   ///< running hash of all commits
  std::uint64_t highest_job = 0;  ///< highest id of a job; ids are never reused
  friend bool operator==(const CommitMark&, const CommitMark&) = default;
};

/// A file with two slots that are written in turn, so a power failure leaves one of them intact. Not thread-safe.
class CommitChain {
 public:
  /// Opens or creates the file.
  static Result<CommitChain> open(const std::filesystem::path& path);
  CommitChain(CommitChain&& other) noexcept;
  CommitChain& operator=(CommitChain&& other) noexcept;
  ~CommitChain();

  /// The intact mark with the most commits. Empty if the file is new, or both slots are damaged.
  const std::optional<CommitMark>& last() const { return last_; }
  /// The mark is durable when it returns.
  Status append(const CommitMark& mark);
  /// Replaces all earlier marks.
  Status restart(const CommitMark& mark);

 private:
  CommitChain(std::filesystem::path path, int file) : path_(std::move(path)), file_(file) {}

  std::filesystem::path path_;
  int file_ = -1;
  std::optional<CommitMark> last_;
};

/// OK if a store at mark `store` has all acknowledged commits; `chain` is the mark of the last one. Otherwise
/// FAILED_PRECONDITION, which says what is lost. A store may be one commit ahead, which is not acknowledged yet.
Status check_chain(const std::optional<CommitMark>& chain, const CommitMark& store);
/// Like check_chain(), for a store that several coordinators write: it may be ahead by any number of commits.
Status check_shared_chain(const std::optional<CommitMark>& chain, const CommitMark& store);

}  // namespace lightmill
