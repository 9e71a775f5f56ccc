// Sums over all rows of a store. They show that rows are lost, left over, or of an earlier commit.
//
// A row with a correct checksum may be an old one: a disk can lose the write of a page, or return an earlier version of
// it. So each commit writes the sums of the hashes of all rows beside its number. The order of rows does not matter, so
// a commit changes the sums only by the rows that it writes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/store/records.h"
#include "server/store/store.h"

namespace lightmill::stored {

/// One sum for each small table, and some for the rows of films. If one of these differs, only its tiles are rendered
/// again.
class RowSums {
 public:
  static constexpr std::uint64_t kFilmSums = 128;

  /// Sums from the output of bytes(). DATA_LOSS if the size differs.
  static Result<RowSums> from_bytes(std::string_view bytes);
  std::string bytes() const { return {reinterpret_cast<const char*>(sums_.data()), sizeof(sums_)}; }

  /// Adds a row if it is `there`; removes it otherwise. Values are as in the row, which may be damaged.
  void count(Table table, const Key& key, std::int64_t checksum, bool there);
  void count_node(JobId job, const FilmPosition& place, std::string_view hash, bool there);
  void count_result(JobId job, const FilmPosition& place, std::int64_t checksum, bool there);

  /// FAILED_PRECONDITION unless the small tables have what was `written`. Names those that differ.
  Status check_tables(const RowSums& written) const;
  /// Whether the sum that has a film's tile is as `written`.
  bool has_tile(const RowSums& written, JobId job, std::int64_t tile) const;
  friend bool operator==(const RowSums&, const RowSums&) = default;

 private:
  void add(std::size_t index, ByteView row, bool there);
  void add_to_film(JobId job, const FilmPosition& place, std::uint64_t table, std::uint64_t value, bool there);

  std::array<std::uint64_t, kTableCount + kFilmSums> sums_{};
};

}  // namespace lightmill::stored
