// Tables of enumerators and their codes in messages or rows, read in both directions.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>
#include <type_traits>
#include <utility>

#include "common/base/status.h"

namespace lightmill {

template <class Value, class Code, std::size_t kCount>
using EnumTable = std::array<std::pair<Value, Code>, kCount>;

/// The table has all values.
template <class Value, class Code, std::size_t kCount>
Code code_of(const EnumTable<Value, Code, kCount>& table, Value value) {
  return std::ranges::find(table, value, &std::pair<Value, Code>::first)->second;
}

/// INVALID_ARGUMENT if the code is unknown. `what` names the field.
template <class Value, class Code, std::size_t kCount>
Result<Value> value_of(const EnumTable<Value, Code, kCount>& table, std::type_identity_t<Code> code,
                       std::string_view what) {
  const auto found = std::ranges::find(table, code, &std::pair<Value, Code>::second);
  if (found != table.end()) {
    return found->first;
  }
  if constexpr (std::is_enum_v<Code>) {
    return invalid_argument("{}: unknown value {}", what, static_cast<int>(code));
  } else {
    return invalid_argument("{}: unknown value '{}'", what, code);
  }
}

}  // namespace lightmill
