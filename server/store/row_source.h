// Rows of a query, whichever database they come from.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/base/status.h"

namespace lightmill::stored {

/// One row. It is valid until the next one is read.
class Row {
 public:
  virtual std::int64_t integer(int column) const = 0;
  virtual double real(int column) const = 0;
  /// The bytes of a text or blob.
  virtual std::string_view view(int column) const = 0;
  std::uint64_t natural(int column) const { return static_cast<std::uint64_t>(integer(column)); }
  std::string text(int column) const { return std::string(view(column)); }

 protected:
  ~Row() = default;
};

/// Runs statements without parameters. Not thread-safe.
class RowSource {
 public:
  /// Calls `read` for each row of a SELECT. Memory: one row. `read` does not use the database.
  virtual Status for_each(const std::string& select, const std::function<void(const Row&)>& read) = 0;
  /// Runs statements and ignores their rows.
  virtual Status execute(const std::string& sql) = 0;

 protected:
  ~RowSource() = default;
};

/// Reads the columns of a row into variables, from the first column on.
template <class... Values>
void read_columns(const Row& row, Values&... values) {
  const auto value_of = [&row]<class T>(int column, T& value) {
    if constexpr (std::is_same_v<T, std::string>) {
      value = row.text(column);
    } else if constexpr (std::is_same_v<T, double>) {
      value = row.real(column);
    } else {
      value = static_cast<T>(row.integer(column));
    }
  };
  int column = 0;
  (value_of(column++, values), ...);
}

}  // namespace lightmill::stored
