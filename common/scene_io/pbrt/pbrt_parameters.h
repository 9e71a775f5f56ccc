// Parameter lists of pbrt's directives.
#pragma once

#include <initializer_list>
#include <limits>
#include <memory>
#include <vector>

#include "common/scene/document.h"
#include "common/scene_io/faults.h"
#include "common/scene_io/pbrt/pbrt_tokens.h"

namespace lightmill {

struct PbrtParameter {
  std::string type, name;
  SourcePlace place;
  std::vector<double> numbers;
  std::vector<std::string> strings;
  bool boolean = false;        ///< of the type bool
  bool may_be_unused = false;  ///< an attribute of several directives
  mutable bool used = false;
};
using PbrtParameterList = std::vector<std::shared_ptr<const PbrtParameter>>;

/// Reads parameters up to the next directive. Their values have the form of their type.
Result<PbrtParameterList> read_pbrt_parameters(PbrtTokens& tokens);

/// The parameters of a directive. Getters always return a value: the default if there is none. A wrong one is noted,
/// and gives the default, too.
class PbrtParameters {
 public:
  static constexpr double kAnything = std::numeric_limits<double>::max();

  /// `what` names the directive: "Shape sphere".
  PbrtParameters(PbrtParameterList list, SourcePlace place, std::string what)
      : list_(std::move(list)), place_(place), what_(std::move(what)) {}

  const SourcePlace& place() const { return place_; }
  const std::string& what() const { return what_; }

  bool has(std::string_view name) const;
  bool has_texture() const;
  double number(std::string_view name, double fallback, double low = -kAnything, double high = kAnything) const;
  std::int64_t whole(std::string_view name, std::int64_t fallback, std::int64_t low, std::int64_t high) const;
  bool boolean(std::string_view name, bool fallback) const;
  std::string text(std::string_view name, std::string fallback) const;
  /// One of the type point3, vector3 or normal3.
  Point3d point(std::string_view name, const Point3d& fallback) const;
  /// All numbers of a parameter in groups of `group`. Empty if there is none.
  std::vector<double> numbers(std::string_view name, std::initializer_list<std::string_view> types,
                              std::size_t group = 1) const;
  std::vector<std::string> strings(std::string_view name) const;
  /// A parameter of any type, which counts as used. Null if there is none.
  const PbrtParameter* find(std::string_view name) const;

  /// Notes an error at a parameter, or at the directive.
  void fail(std::string_view name, std::string_view what) const;
  void fail(Status status) const;

  /// The first error. Parameters that nothing has asked for are faults.
  Status finish(Faults& faults) const;

 private:
  const PbrtParameter* find(std::string_view name, std::initializer_list<std::string_view> types) const;
  /// The only number of a parameter, or nothing.
  std::optional<double> one(std::string_view name, std::string_view type) const;

  PbrtParameterList list_;
  SourcePlace place_;
  std::string what_;
  mutable Status first_;
};

}  // namespace lightmill
