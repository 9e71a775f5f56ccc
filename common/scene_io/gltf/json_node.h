// A place in a JSON file, with its path for messages. It has a value, or none.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/scene_io/faults.h"

namespace lightmill {

/// The first error of a file, and its faults, which are no errors. After an error, readers continue with a default and
/// check now and then.
class FirstError {
 public:
  explicit FirstError(std::string file_name) : file_name_(std::move(file_name)) {}
  void add(Status status) {
    if (first_.ok()) {
      first_ = std::move(status);
    }
  }
  void add_fault(const std::string& path, std::string_view what, std::string_view remedy);
  const Status& status() const { return first_; }
  const Faults& faults() const { return faults_; }

 private:
  std::string file_name_;
  Status first_;
  Faults faults_;
};

/// A cheap view. The document and the FirstError must outlive it. Getters always return a value within their bounds:
/// the default if the value is missing. A wrong value is noted as an error, and gives the default or the nearest bound:
/// "meshes[0].primitives[2].mode: a whole number from 0 to 6 is expected, got "x"".
class JsonNode {
 public:
  static constexpr double kAnything = std::numeric_limits<double>::max();

  JsonNode(const nlohmann::json* value, std::string path, FirstError& errors, bool tolerant = false)
      : value_(value), path_(std::move(path)), errors_(&errors), tolerant_(tolerant) {}

  /// The same node, at which wrong values are faults. So they are below it.
  JsonNode tolerant() const { return {value_, path_, *errors_, true}; }

  bool present() const { return value_ != nullptr; }
  const std::string& path() const { return path_; }
  void fail(std::string_view what) const;
  /// Notes this error with its code.
  void fail(const Status& error) const;
  /// Adds a fault that is no error.
  void fault(std::string_view what, std::string_view remedy) const { errors_->add_fault(path_, what, remedy); }

  /// A member of an object. Not present if there is none.
  JsonNode operator[](std::string_view key) const;
  /// An element of an array. `index` must be less than size().
  JsonNode at(std::size_t index) const;
  /// The size of an array. 0 if it is missing.
  std::size_t size() const;
  /// The names of an object's members. None if it is missing.
  std::vector<std::string> keys() const;

  double number(double fallback, double low = -kAnything, double high = kAnything) const;
  std::uint64_t whole(std::uint64_t fallback, std::uint64_t low, std::uint64_t high) const;
  bool boolean(bool fallback) const;
  std::string text(std::string_view fallback = "") const;
  /// An index below `count` into the file's list `what`. Nothing if it is missing or wrong.
  std::optional<std::size_t> index(std::string_view what, std::size_t count) const;
  /// `n` numbers, each within the bounds.
  template <std::size_t n>
  std::array<double, n> numbers(const std::array<double, n>& fallback, double low = -kAnything,
                                double high = kAnything) const {
    std::array<double, n> out = fallback;
    if (present() && has_size(n)) {
      for (std::size_t i = 0; i < n; ++i) {
        out[i] = at(i).number(fallback[i], low, high);
      }
    }
    return out;
  }

 private:
  /// Whether it is an array of this size. Notes an error if not.
  bool has_size(std::size_t size) const;
  std::string shown() const;

  const nlohmann::json* value_;
  std::string path_;
  FirstError* errors_;
  bool tolerant_;
};

}  // namespace lightmill
