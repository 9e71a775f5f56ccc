#include "server/store/sqlite/journal_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <span>
#include <vector>

namespace lightmill::sqlite {
namespace {

constexpr std::size_t kHeaderBytes = 32, kFrameHeaderBytes = 24;
constexpr std::uint32_t kMagic = 0x377f0682;  ///< 1 more if checksums are of big-endian words

std::uint32_t big_endian(const unsigned char* at) {
  return std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 | at[3];
}

/// Running checksum of the header and all frames.
class Checksum {
 public:
  explicit Checksum(bool big_endian_words) : big_(big_endian_words) {}
  void add(std::span<const unsigned char> bytes) {
    for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
      first_ += word(&bytes[i]) + second_;
      second_ += word(&bytes[i + 4]) + first_;
    }
  }
  bool is(const unsigned char* stored) const {
    return big_endian(stored) == first_ && big_endian(stored + 4) == second_;
  }

 private:
  std::uint32_t word(const unsigned char* at) const {
    const std::uint32_t value = big_endian(at);
    return big_ ? value : __builtin_bswap32(value);
  }
  bool big_;
  std::uint32_t first_ = 0, second_ = 0;
};

bool read(std::istream& file, std::span<unsigned char> bytes) {
  return static_cast<bool>(
      file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())));
}

}  // namespace

JournalScan scan_journal(const std::filesystem::path& journal) {
  JournalScan scan;
  std::ifstream file(journal, std::ios::binary);
  std::array<unsigned char, kHeaderBytes> header{};
  if (!read(file, header) || (big_endian(header.data()) & ~1u) != kMagic) {
    return scan;
  }
  Checksum checksum(big_endian(header.data()) == kMagic + 1);
  checksum.add(std::span(header).first(24));
  const std::uint32_t page_bytes = big_endian(&header[8]);
  constexpr std::uint32_t kMaxPageBytes = 65536;
  bool sound = checksum.is(&header[24]) && page_bytes >= 512 && page_bytes <= kMaxPageBytes;
  if (!sound) {
    scan.damaged = true;
    return scan;  // SQLite ignores the whole journal
  }
  std::vector<unsigned char> frame(kFrameHeaderBytes + page_bytes);
  while (read(file, frame)) {
    if (std::memcmp(&frame[8], &header[16], 8) != 0) {  // other salts: an earlier run, which is in the database already
      sound = false;
      continue;
    }
    checksum.add(std::span(frame).first(8));
    checksum.add(std::span(frame).subspan(kFrameHeaderBytes));
    ++scan.frames;
    scan.damaged = scan.damaged || !sound;
    sound = sound && checksum.is(&frame[16]);
    scan.sound_frames += sound ? 1 : 0;
  }
  return scan;
}

std::string problem_of(const JournalScan& journal) {
  if (journal.damaged) {
    return fmt::format(" Its journal is damaged at frame {} of {}.", journal.sound_frames + 1,
                       std::max(journal.frames, journal.sound_frames + 1));
  }
  return journal.frames == 0 ? " Its journal (-wal) is missing or empty." : "";
}

}  // namespace lightmill::sqlite
