// A look through SQLite's journal (WAL) before SQLite reads it.
//
// SQLite takes frames up to the first one whose checksum does not fit, and drops the others without a word. Such a
// frame may be the torn end of a transaction that was never acknowledged, or damage in the middle. Format:
// https://www.sqlite.org/fileformat.html#walformat
#pragma once

#include <cstdint>
#include <filesystem>

namespace lightmill::sqlite {

struct JournalScan {
  std::uint64_t frames = 0;        ///< of the journal's current run, sound or not
  std::uint64_t sound_frames = 0;  ///< those that SQLite takes
  bool damaged = false;  ///< the header is, or frames of the current run follow one whose checksum does not fit
};

/// Zeros if there is no journal.
JournalScan scan_journal(const std::filesystem::path& journal);

}  // namespace lightmill::sqlite
