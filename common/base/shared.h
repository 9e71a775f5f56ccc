// Immutable value that its copies share, for large parts of plain structs.
#pragma once

#include <concepts>
#include <initializer_list>
#include <memory>
#include <type_traits>
#include <utility>

namespace lightmill {

/// A copy has the same address and takes no memory. To change it, assign a new value. Thread-safe like a pointer to
/// const.
template <class T>
class Shared {
 public:
  Shared() : value_(empty()) {}
  Shared(T value) : value_(std::make_shared<const T>(std::move(value))) {}
  template <class U>
  requires(std::convertible_to<U, T> && !std::same_as<std::remove_cvref_t<U>, T>) Shared(U&& value)
      : Shared(T(std::forward<U>(value))) {}
  Shared(std::initializer_list<typename T::value_type> values) : Shared(T(values)) {}
  // Moving copies, so it leaves no object without a value.
  Shared(const Shared&) = default;
  Shared& operator=(const Shared&) = default;

  const T& operator*() const { return *value_; }
  const T* operator->() const { return value_.get(); }
  friend bool operator==(const Shared& a, const Shared& b) { return *a == *b; }

 private:
  static const std::shared_ptr<const T>& empty() {
    static const auto none = std::make_shared<const T>();
    return none;
  }

  std::shared_ptr<const T> value_;
};

}  // namespace lightmill
