// Scan of SQLite's journal (WAL) before SQLite reads it.
//
// SQLite takes frames up to the first one with a wrong checksum, and drops the rest silently. Such a frame is either
// the torn end of an unacknowledged transaction, or damage in the middle. Format:
// https://www.sqlite.org/fileformat.html#walformat
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace lightmill::sqlite {

struct JournalScan {
  std::uint64_t frames = 0;        ///< of the journal's current run, intact or not
  std::uint64_t sound_frames = 0;  ///< frames that SQLite takes
  bool damaged = false;  ///< the header is damaged, or frames of the current run follow one with a wrong checksum
};

/// Zeros if there is no journal.
JournalScan scan_journal(const std::filesystem::path& journal);

/// A sentence after a space: that the journal is damaged, or has no frames. Empty if it is sound.
std::string problem_of(const JournalScan& journal);

}  // namespace lightmill::sqlite
