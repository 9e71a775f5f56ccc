#include "server/store/postgres/values.h"

#include <libpq-fe.h>

#include <bit>
#include <cstring>

#include "common/base/check.h"
#include "common/base/text.h"

namespace lightmill::postgres {

const int* Parameters::formats() const {
  static constexpr auto kBinary = [] {
    std::array<int, kMax> formats{};
    formats.fill(1);
    return formats;
  }();
  return kBinary.data();
}

void Parameters::add(std::int64_t value) {
  LM_CHECK(count_ < kMax);
  numbers_[count_] = __builtin_bswap64(static_cast<std::uint64_t>(value));
  add_raw(reinterpret_cast<const char*>(&numbers_[count_]), sizeof(std::uint64_t));
}

void Parameters::add(double value) {
  add(std::bit_cast<std::int64_t>(value));
}

void Parameters::add(std::string_view text) {
  const std::string& kept = texts_.emplace_back(printable(text, true));
  add_raw(kept.data(), kept.size());
}

void Parameters::add(ByteView bytes) {
  add_raw(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

void Parameters::add_raw(const char* bytes, std::size_t size) {
  LM_CHECK(count_ < kMax && size <= INT32_MAX);
  values_[count_] = size == 0 ? "" : bytes;  // null would be NULL
  lengths_[count_] = static_cast<int>(size);
  size_bytes_ += size;
  ++count_;
}

Rows::~Rows() {
  PQclear(result_);
}

int Rows::size() const {
  return PQntuples(result_);
}

std::uint64_t Rows::natural(int row, int column) const {
  LM_CHECK(PQgetlength(result_, row, column) == 8, "column {}", column);
  std::uint64_t value = 0;
  std::memcpy(&value, PQgetvalue(result_, row, column), sizeof(value));
  return __builtin_bswap64(value);
}

double Rows::real(int row, int column) const {
  return std::bit_cast<double>(natural(row, column));
}

bool Rows::flag(int row, int column) const {
  LM_CHECK(PQgetlength(result_, row, column) == 1, "column {}", column);
  return *PQgetvalue(result_, row, column) != 0;
}

std::string_view Rows::view(int row, int column) const {
  return {PQgetvalue(result_, row, column), static_cast<std::size_t>(PQgetlength(result_, row, column))};
}

}  // namespace lightmill::postgres
