// A record, beside the database, of the last commit that was acknowledged: shows that a database has lost commits.
//
// SQLite reads its journal up to the first damaged frame and drops the rest without a word, so one flipped bit could
// take acknowledged jobs. The record is written after each commit and before its acknowledgement.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// How far a store has come.
struct CommitMark {
  std::array<std::uint8_t, 16> store{};  ///< the store's id
  std::uint64_t commits = 0;
  Hash128 hash;                   ///< runs over all commits
  std::uint64_t highest_job = 0;  ///< id; ids are never given twice
  friend bool operator==(const CommitMark&, const CommitMark&) = default;
};

/// A file of two slots that are written in turn, so that one of them is whole whenever the power fails.
/// Not thread-safe.
class CommitChain {
 public:
  /// Opens or creates the file.
  static Result<CommitChain> open(const std::filesystem::path& path);
  CommitChain(CommitChain&& other) noexcept;
  CommitChain& operator=(CommitChain&& other) noexcept;
  ~CommitChain();

  /// The mark with the most commits that is sound; nothing in a new file, or where both slots are damaged.
  const std::optional<CommitMark>& last() const { return last_; }
  /// Durable when it returns.
  Status append(const CommitMark& mark);
  /// Forgets what was acknowledged before: this is the last mark now.
  Status restart(const CommitMark& mark);

 private:
  CommitChain(std::filesystem::path path, int file) : path_(std::move(path)), file_(file) {}

  std::filesystem::path path_;
  int file_ = -1;
  std::optional<CommitMark> last_;
};

/// FAILED_PRECONDITION, saying what is lost, unless a store that has come to `store` holds all that was acknowledged,
/// of which `chain` is the last. A store may be one commit ahead: it was not acknowledged yet.
Status check_chain(const std::optional<CommitMark>& chain, const CommitMark& store);
/// The same of a store that others write too, so that it may be further by any number of commits.
Status check_shared_chain(const std::optional<CommitMark>& chain, const CommitMark& store);

}  // namespace lightmill
