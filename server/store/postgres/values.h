// Parameters of statements and rows of results, in PostgreSQL's binary format.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/digest.h"
#include "server/store/row_source.h"

struct pg_result;

namespace lightmill::postgres {

/// The parameters $1, $2, … of one statement. The viewed data must outlive it.
class Parameters {
 public:
  template <class... Args>
  explicit Parameters(const Args&... args) {
    (add(args), ...);
  }
  Parameters(const Parameters&) = delete;
  Parameters& operator=(const Parameters&) = delete;

  int count() const { return count_; }
  const char* const* values() const { return values_.data(); }
  const int* lengths() const { return lengths_.data(); }
  /// All are binary.
  const int* formats() const;
  std::size_t size_bytes() const { return size_bytes_; }

 private:
  static constexpr int kMax = 32;
  void add(std::int64_t value);
  void add(std::uint64_t value) { add(static_cast<std::int64_t>(value)); }  // keeps its bits
  void add(std::int32_t value) { add(std::int64_t{value}); }
  void add(std::uint32_t value) { add(std::int64_t{value}); }
  void add(double value);
  /// PostgreSQL's texts allow only UTF-8 without zeros. printable() escapes other bytes.
  void add(std::string_view text);
  void add(const std::string& text) { add(std::string_view(text)); }
  void add(const char* text) { add(std::string_view(text)); }
  void add(ByteView bytes);
  void add_raw(const char* bytes, std::size_t size);

  int count_ = 0;
  std::size_t size_bytes_ = 0;
  std::array<std::uint64_t, kMax> numbers_;
  std::array<const char*, kMax> values_;
  std::array<int, kMax> lengths_;
  std::deque<std::string> texts_;
};

/// The rows of a query, in binary: BIGINT, DOUBLE PRECISION, BOOLEAN, TEXT and BYTEA columns without NULL.
class Rows {
 public:
  explicit Rows(pg_result* result) : result_(result) {}
  ~Rows();
  Rows(Rows&& other) noexcept : result_(std::exchange(other.result_, nullptr)) {}
  Rows& operator=(Rows&& other) noexcept {
    std::swap(result_, other.result_);
    return *this;
  }

  int size() const;
  std::int64_t integer(int row, int column) const { return static_cast<std::int64_t>(natural(row, column)); }
  std::uint64_t natural(int row, int column) const;
  double real(int row, int column) const;
  bool flag(int row, int column) const;
  std::string text(int row, int column) const { return std::string(view(row, column)); }
  /// Valid while the rows live.
  std::string_view view(int row, int column) const;

 private:
  pg_result* result_;
};

/// One of the rows.
class RowOf final : public stored::Row {
 public:
  RowOf(const Rows& rows, int row) : rows_(rows), row_(row) {}
  std::int64_t integer(int column) const override { return rows_.integer(row_, column); }
  double real(int column) const override { return rows_.real(row_, column); }
  std::string_view view(int column) const override { return rows_.view(row_, column); }

 private:
  const Rows& rows_;
  int row_;
};

}  // namespace lightmill::postgres
