#include "common/scene_io/gltf/json_node.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/text.h"

namespace lightmill {

void FirstError::add_fault(const std::string& path, std::string_view what, std::string_view remedy) {
  // Faults of one kind are at places that differ only in their indices.
  std::string kind = fmt::format("gltf {}", path);
  std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
  faults_.add(kind, fmt::format("{}: {}: {}", file_name_, path, what), remedy);
}

void JsonNode::fail(std::string_view what) const {
  if (tolerant_) {
    fault(what, "it is ignored");
  } else {
    errors_->add(invalid_argument("{}: {}", path_, what));
  }
}

void JsonNode::fail(const Status& error) const {
  if (tolerant_) {
    fail(message_of(error));
  } else {
    errors_->add(with_context(error, path_));
  }
}

JsonNode JsonNode::operator[](std::string_view key) const {
  const nlohmann::json* member = nullptr;
  if (present()) {
    if (!value_->is_object()) {
      fail(fmt::format("an object is expected, got {}", shown()));
    } else if (const auto found = value_->find(key); found != value_->end()) {
      member = &*found;
    }
  }
  return {member, path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key), *errors_, tolerant_};
}

JsonNode JsonNode::at(std::size_t index) const {
  return {&(*value_)[index], fmt::format("{}[{}]", path_, index), *errors_, tolerant_};
}

std::size_t JsonNode::size() const {
  if (!present()) {
    return 0;
  }
  if (!value_->is_array()) {
    fail(fmt::format("a list is expected, got {}", shown()));
    return 0;
  }
  return value_->size();
}

std::vector<std::string> JsonNode::keys() const {
  std::vector<std::string> out;
  if (present() && value_->is_object()) {
    for (const auto& [key, value] : value_->items()) {
      out.push_back(key);
    }
  } else if (present()) {
    fail(fmt::format("an object is expected, got {}", shown()));
  }
  return out;
}

double JsonNode::number(double fallback, double low, double high) const {
  if (!present()) {
    return fallback;
  }
  const double value = value_->is_number() ? value_->get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (high != kAnything && value > high && value <= high * (1 + 1e-4)) {
    return high;  // rounded by single precision
  }
  if (!(value >= low && value <= high)) {  // NaN too
    const std::string range = low == -kAnything && high == kAnything ? ""
                              : high == kAnything                    ? fmt::format(" of at least {}", low)
                                                                     : fmt::format(" from {} to {}", low, high);
    fail(fmt::format("a number{} is expected, got {}", range, shown()));
    return fallback;
  }
  return value;
}

std::uint64_t JsonNode::whole(std::uint64_t fallback, std::uint64_t low, std::uint64_t high) const {
  if (!present()) {
    return fallback;
  }
  // Some programs write 5.0 for 5.
  const double value = value_->is_number() ? value_->get<double>() : -1;
  if (value < 0 || value >= 9e15 || value != std::floor(value) || static_cast<std::uint64_t>(value) < low ||
      static_cast<std::uint64_t>(value) > high) {
    fail(fmt::format("a whole number from {} to {} is expected, got {}", low, high, shown()));
    return fallback;
  }
  return static_cast<std::uint64_t>(value);
}

bool JsonNode::boolean(bool fallback) const {
  if (present() && !value_->is_boolean()) {
    fail(fmt::format("true or false is expected, got {}", shown()));
    return fallback;
  }
  return present() ? value_->get<bool>() : fallback;
}

std::string JsonNode::text(std::string_view fallback) const {
  if (present() && !value_->is_string()) {
    fail(fmt::format("a string is expected, got {}", shown()));
    return std::string(fallback);
  }
  return present() ? value_->get<std::string>() : std::string(fallback);
}

std::optional<std::size_t> JsonNode::index(std::string_view what, std::size_t count) const {
  if (!present()) {
    return std::nullopt;
  }
  const double value = value_->is_number() ? value_->get<double>() : -1;
  if (value < 0 || value != std::floor(value) || value >= static_cast<double>(count)) {
    fail(fmt::format("an index into the {} {} is expected, got {}", count, what, shown()));
    return std::nullopt;
  }
  return static_cast<std::size_t>(value);
}

bool JsonNode::has_size(std::size_t size) const {
  if (this->size() == size) {
    return true;
  }
  fail(fmt::format("a list of {} is expected, got {}", size, shown()));
  return false;
}

std::string JsonNode::shown() const {
  constexpr std::size_t kShown = 40;
  if (value_->is_structured()) {
    return value_->is_array() ? fmt::format("a list of {}", value_->size()) : "an object";
  }
  return cut_text(value_->dump(-1, ' ', true), kShown);
}

}  // namespace lightmill
