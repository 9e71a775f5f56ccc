#include "common/scene_io/mitsuba/mitsuba_object.h"

#include <algorithm>

namespace lightmill {

std::string MitsubaObject::label() const {
  constexpr std::size_t kMaxBytes = 500;  // each use has a copy
  return cut_text(id.empty() ? fmt::format("{} of line {}", type, place.line) : id, kMaxBytes);
}

bool MitsubaObject::has(std::string_view name) const {
  return std::ranges::any_of(parameters, [&](const auto& parameter) { return parameter.name == name; });
}

const MitsubaParameter* MitsubaObject::find(std::string_view name) const {
  for (const MitsubaParameter& parameter : parameters) {
    if (parameter.name == name) {
      parameter.used = true;
      return &parameter;
    }
  }
  return nullptr;
}

void MitsubaObject::ignore(std::initializer_list<std::string_view> names) const {
  for (const std::string_view name : names) {
    find(name);
  }
}

const MitsubaParameter* MitsubaObject::find(std::string_view name,
                                            std::initializer_list<std::string_view> types) const {
  const MitsubaParameter* found = find(name);
  if (found == nullptr) {
    if (child(name) != nullptr) {
      fail(name, fmt::format("the type {} is expected", *types.begin()));
    }
    return nullptr;
  }
  if (std::ranges::find(types, found->type) != types.end()) {
    return found;
  }
  fail(name, fmt::format("the type {} is expected", *types.begin()));
  return nullptr;
}

double MitsubaObject::number(std::string_view name, double fallback, double low, double high) const {
  const MitsubaParameter* found = find(name, {"float", "integer"});
  if (found == nullptr) {
    return fallback;
  }
  const double value = found->numbers[0];
  if (!(value >= low && value <= high)) {
    fail(name, fmt::format("must be from {} to {}, got {}", low, high, value));
    return fallback;
  }
  return value;
}

std::int64_t MitsubaObject::whole(std::string_view name, std::int64_t fallback, std::int64_t low,
                                  std::int64_t high) const {
  const MitsubaParameter* found = find(name, {"integer"});
  if (found == nullptr) {
    return fallback;
  }
  const double value = found->numbers[0];
  if (!(value >= static_cast<double>(low) && value <= static_cast<double>(high))) {
    fail(name, fmt::format("must be from {} to {}, got {}", low, high, value));
    return fallback;
  }
  return static_cast<std::int64_t>(value);
}

bool MitsubaObject::boolean(std::string_view name, bool fallback) const {
  const MitsubaParameter* found = find(name, {"boolean"});
  return found == nullptr ? fallback : found->numbers[0] != 0;
}

std::string MitsubaObject::text(std::string_view name, std::string fallback) const {
  const MitsubaParameter* found = find(name, {"string"});
  return found == nullptr ? fallback : found->text;
}

Point3d MitsubaObject::point(std::string_view name, const Point3d& fallback) const {
  const MitsubaParameter* found = find(name, {"point", "vector"});
  return found == nullptr ? fallback : Point3d{found->numbers[0], found->numbers[1], found->numbers[2]};
}

Transform MitsubaObject::transform(std::string_view name) const {
  const MitsubaParameter* found = find(name, {"transform"});
  return found == nullptr ? kIdentityTransform : found->transform;
}

const MitsubaObject* MitsubaObject::child(std::string_view name) const {
  for (const MitsubaChild& one : children) {
    if (one.name == name) {
      one.used = true;
      return one.object;
    }
  }
  return nullptr;
}

std::vector<const MitsubaObject*> MitsubaObject::nested(std::string_view wanted) const {
  std::vector<const MitsubaObject*> out;
  for (const MitsubaChild& one : children) {
    if (one.object->tag == wanted) {
      one.used = true;
      out.push_back(one.object);
    }
  }
  return out;
}

void MitsubaObject::fail(std::string_view name, std::string_view problem) const {
  if (const MitsubaParameter* parameter = find(name)) {
    return fail(parameter->place.error("{}: {} {}: {}", what(), parameter->type, name, problem));
  }
  const auto named = std::ranges::find(children, name, &MitsubaChild::name);
  const SourcePlace& at = named == children.end() || name.empty() ? place : named->place;
  fail(at.error("{}: {}: {}", what(), name, problem));
}

void MitsubaObject::fail(Status status) const {
  if (first_.ok()) {
    first_ = std::move(status);
  }
}

Status MitsubaObject::finish(Faults& faults) const {
  for (const MitsubaParameter& parameter : parameters) {
    if (!parameter.used) {
      parameter.used = true;
      const std::string name = cut_text(printable(parameter.name), 80);
      faults.add(
          fmt::format("parameter {} {}", what(), name),
          fmt::format("{}: {}: unknown parameter {} \"{}\"", parameter.place.text(), what(), parameter.type, name),
          "it is left out");
    }
  }
  for (const MitsubaChild& one : children) {
    if (!one.used) {
      fail(one.place.error("{}: the {}{} is not read here", what(), one.object->what(),
                           one.name.empty() ? "" : fmt::format(" \"{}\"", one.name)));
    }
  }
  return first_;
}

}  // namespace lightmill
