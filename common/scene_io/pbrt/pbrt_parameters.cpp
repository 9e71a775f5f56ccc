#include "common/scene_io/pbrt/pbrt_parameters.h"

#include <algorithm>
#include <cmath>

#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

struct Type {
  std::string_view name, also;  ///< pbrt's name, and that of older files
  std::size_t group;            ///< numbers of a value
};
constexpr std::array<Type, 11> kNumbers{{{"float", "", 1},
                                         {"integer", "", 1},
                                         {"point2", "", 2},
                                         {"vector2", "", 2},
                                         {"point3", "point", 3},
                                         {"vector3", "vector", 3},
                                         {"normal3", "normal", 3},
                                         {"rgb", "color", 3},
                                         {"blackbody", "", 1},
                                         {"spectrum", "", 1},
                                         {"bool", "", 0}}};
constexpr std::array<std::string_view, 3> kStrings{"string", "texture", "spectrum"};

Status take_value(const PbrtToken& token, PbrtParameter& out) {
  if (token.quoted) {
    if (std::ranges::find(kStrings, out.type) == kStrings.end()) {
      return out.place.error("{} {}: a number is expected, got \"{}\"", out.type, out.name, token.text);
    }
    out.strings.emplace_back(token.text);
    return ok_status();
  }
  if (out.type == "bool") {
    if (token.text != "true" && token.text != "false") {
      return out.place.error("bool {}: true or false is expected, got {}", out.name, token.text);
    }
    out.boolean = token.text == "true";
    out.numbers.push_back(out.boolean);
    return ok_status();
  }
  const std::optional<double> value = parse_number(token.text);
  if (!value || out.type == "string" || out.type == "texture") {
    return out.place.error("{} {}: {} is expected, got {}", out.type, out.name,
                           value ? "a string in quotes" : "a number", token.text);
  }
  if (out.type == "integer" && (*value != std::floor(*value) || std::abs(*value) > 0x1p31)) {
    return out.place.error("integer {}: a whole number of 32 bits is expected, got {}", out.name, token.text);
  }
  out.numbers.push_back(*value);
  return ok_status();
}

Status check_type(PbrtParameter& parameter) {
  for (const Type& type : kNumbers) {
    if (parameter.type == type.name || (!type.also.empty() && parameter.type == type.also)) {
      parameter.type = type.name;
      return ok_status();
    }
  }
  if (std::ranges::find(kStrings, parameter.type) == kStrings.end()) {
    return parameter.place.error("unknown type \"{}\" of the parameter \"{}\"", parameter.type, parameter.name);
  }
  return ok_status();
}

/// Numbers of one value of the type.
std::size_t group_of(std::string_view type) {
  for (const Type& known : kNumbers) {
    if (known.name == type) {
      return std::max<std::size_t>(known.group, 1);
    }
  }
  return 1;
}

Result<std::shared_ptr<PbrtParameter>> read_parameter(PbrtTokens& tokens) {
  const PbrtToken declaration = *tokens.next();
  auto out = std::make_shared<PbrtParameter>();
  out->place = tokens.place_of(declaration);
  std::string_view words = declaration.text;
  out->type = take_word(words);
  out->name = take_word(words);
  if (out->name.empty()) {
    return out->place.error("a type and a name are expected, got \"{}\"", declaration.text);
  }
  LM_RETURN_IF_ERROR(check_type(*out));
  std::optional<PbrtToken> value = tokens.next();
  if (value && !value->quoted && value->text == "[") {
    for (value = tokens.next(); value && (value->quoted || value->text != "]"); value = tokens.next()) {
      LM_RETURN_IF_ERROR(take_value(*value, *out));
    }
    if (!value && tokens.status().ok()) {
      return out->place.error("the list of \"{}\" has no ]", out->name);
    }
  } else if (value) {
    LM_RETURN_IF_ERROR(take_value(*value, *out));
  }
  LM_RETURN_IF_ERROR(tokens.status());
  if (!value) {
    return out->place.error("{} {} has no value", out->type, out->name);
  }
  return out;
}

}  // namespace

Result<PbrtParameterList> read_pbrt_parameters(PbrtTokens& tokens) {
  PbrtParameterList out;
  while (tokens.peek() && tokens.peek()->quoted) {
    LM_ASSIGN_OR_RETURN(std::shared_ptr<PbrtParameter> parameter, read_parameter(tokens));
    out.push_back(std::move(parameter));
  }
  LM_RETURN_IF_ERROR(tokens.status());
  return out;
}

const PbrtParameter* PbrtParameters::find(std::string_view name) const {
  const PbrtParameter* found = nullptr;
  for (const auto& parameter : list_) {
    if (parameter->name == name) {
      parameter->used = true;
      found = found == nullptr ? parameter.get() : found;
    }
  }
  return found;
}

bool PbrtParameters::has(std::string_view name) const {
  return std::ranges::any_of(list_, [&](const auto& parameter) { return parameter->name == name; });
}

bool PbrtParameters::has_texture() const {
  return std::ranges::any_of(list_, [](const auto& parameter) { return parameter->type == "texture"; });
}

const PbrtParameter* PbrtParameters::find(std::string_view name, std::initializer_list<std::string_view> types) const {
  const PbrtParameter* found = find(name);
  if (found == nullptr || std::ranges::find(types, found->type) != types.end()) {
    return found;
  }
  fail(name, fmt::format("the type {} is expected", *types.begin()));
  return nullptr;
}

std::optional<double> PbrtParameters::one(std::string_view name, std::string_view type) const {
  // A whole number is a number.
  const PbrtParameter* found = type == "float" ? find(name, {"float", "integer"}) : find(name, {type});
  if (found == nullptr) {
    return std::nullopt;
  }
  if (found->numbers.size() != 1) {
    fail(name, fmt::format("one value is expected, got {}", found->numbers.size()));
    return std::nullopt;
  }
  return found->numbers[0];
}

double PbrtParameters::number(std::string_view name, double fallback, double low, double high) const {
  const std::optional<double> value = one(name, "float");
  if (value && !(*value >= low && *value <= high)) {
    fail(name, fmt::format("must be from {} to {}, got {}", low, high, *value));
    return fallback;
  }
  return value.value_or(fallback);
}

std::int64_t PbrtParameters::whole(std::string_view name, std::int64_t fallback, std::int64_t low,
                                   std::int64_t high) const {
  const std::optional<double> value = one(name, "integer");
  if (value && !(*value >= static_cast<double>(low) && *value <= static_cast<double>(high))) {
    fail(name, fmt::format("must be from {} to {}, got {}", low, high, *value));
    return fallback;
  }
  return value ? static_cast<std::int64_t>(*value) : fallback;
}

bool PbrtParameters::boolean(std::string_view name, bool fallback) const {
  return one(name, "bool").value_or(fallback) != 0;
}

std::vector<std::string> PbrtParameters::strings(std::string_view name) const {
  const PbrtParameter* found = find(name, {"string"});
  return found == nullptr ? std::vector<std::string>() : found->strings;
}

std::string PbrtParameters::text(std::string_view name, std::string fallback) const {
  if (!has(name)) {
    return fallback;
  }
  std::vector<std::string> all = strings(name);
  if (all.size() != 1) {
    fail(name, fmt::format("one string is expected, got {}", all.size()));
    return fallback;
  }
  return all[0];
}

Point3d PbrtParameters::point(std::string_view name, const Point3d& fallback) const {
  const std::vector<double> all = numbers(name, {"point3", "vector3", "normal3"}, 3);
  if (all.size() > 3) {
    fail(name, "three numbers are expected");
  }
  return all.size() == 3 ? Point3d{all[0], all[1], all[2]} : fallback;
}

std::vector<double> PbrtParameters::numbers(std::string_view name, std::initializer_list<std::string_view> types,
                                            std::size_t group) const {
  const PbrtParameter* found = find(name, types);
  if (found == nullptr) {
    return {};
  }
  if (found->numbers.size() % std::max(group, group_of(found->type)) != 0) {
    fail(name, fmt::format("the number of values must be a multiple of {}, got {}", group, found->numbers.size()));
    return {};
  }
  return found->numbers;
}

void PbrtParameters::fail(std::string_view name, std::string_view what) const {
  const PbrtParameter* found = find(name);
  fail(found == nullptr ? place_.error("{}: {}: {}", what_, name, what)
                        : found->place.error("{}: {} {}: {}", what_, found->type, name, what));
}

void PbrtParameters::fail(Status status) const {
  if (first_.ok()) {
    first_ = std::move(status);
  }
}

Status PbrtParameters::finish(Faults& faults) const {
  for (const auto& parameter : list_) {
    if (!parameter->used && !parameter->may_be_unused) {
      parameter->used = true;
      const std::string name = cut_text(printable(parameter->name), 80);
      faults.add(
          fmt::format("parameter {} {}", what_, name),
          fmt::format("{}: {}: unknown parameter \"{} {}\"", parameter->place.text(), what_, parameter->type, name),
          "it is left out");
    }
  }
  return first_;
}

}  // namespace lightmill
