#include "server/store/row_sums.h"

#include <fmt/ranges.h>

#include <cstring>
#include <vector>

#include "server/store/row_values.h"

namespace lightmill::stored {
namespace {

/// Tiles of a job that share a sum. They are neighbours in the tables, so a page has rows of few sums.
constexpr std::int64_t kTilesTogether = 64;

std::size_t index_of(JobId job, std::int64_t tile) {
  const std::array<std::uint64_t, 2> place{job.value, static_cast<std::uint64_t>(tile / kTilesTogether)};
  return kTableCount + xxh3_128(view_of(place)).low % RowSums::kFilmSums;
}

}  // namespace

Result<RowSums> RowSums::from_bytes(std::string_view bytes) {
  RowSums sums;
  if (bytes.size() != sizeof(sums.sums_)) {
    return data_loss("the sums over its rows have {} bytes, not {}", bytes.size(), sizeof(sums.sums_));
  }
  std::memcpy(sums.sums_.data(), bytes.data(), bytes.size());
  return sums;
}

void RowSums::add(std::size_t index, ByteView row, bool there) {
  const std::uint64_t hash = xxh3_128(row).low;
  sums_[index] += there ? hash : 0 - hash;
}

void RowSums::count(Table table, const Key& key, std::int64_t checksum, bool there) {
  const std::array<std::uint64_t, 3> row{key.number, xxh3_128(as_byte_view(key.name)).low,
                                         static_cast<std::uint64_t>(checksum)};
  add(static_cast<std::size_t>(table), view_of(row), there);
}

void RowSums::add_to_film(JobId job, const FilmPosition& place, std::uint64_t table, std::uint64_t value, bool there) {
  const std::array<std::uint64_t, 6> row{table,
                                         job.value,
                                         static_cast<std::uint64_t>(place.tile),
                                         static_cast<std::uint64_t>(place.level),
                                         static_cast<std::uint64_t>(place.index),
                                         value};
  add(index_of(job, place.tile), view_of(row), there);
}

void RowSums::count_node(JobId job, const FilmPosition& place, std::string_view hash, bool there) {
  add_to_film(job, place, 0, xxh3_128(as_byte_view(hash)).low, there);
}

void RowSums::count_result(JobId job, const FilmPosition& place, std::int64_t checksum, bool there) {
  add_to_film(job, place, 1, static_cast<std::uint64_t>(checksum), there);
}

Status RowSums::check_tables(const RowSums& written) const {
  std::vector<std::string_view> names;
  for (std::size_t table = 0; table < kTableCount; ++table) {
    if (sums_[table] != written.sums_[table]) {
      names.emplace_back(kTables[table].name);
    }
  }
  const bool one = names.size() == 1;
  return names.empty()
             ? ok_status()
             : failed_precondition("its table{} {} {} lost rows, or {} rows of an earlier commit", one ? "" : "s",
                                   fmt::join(names, ", "), one ? "has" : "have", one ? "has" : "have");
}

bool RowSums::has_tile(const RowSums& written, JobId job, std::int64_t tile) const {
  const std::size_t index = index_of(job, tile);
  return sums_[index] == written.sums_[index];
}

}  // namespace lightmill::stored
