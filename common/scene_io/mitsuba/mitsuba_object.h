// An object of a Mitsuba scene, with its parameters and nested objects.
#pragma once

#include <limits>
#include <vector>

#include "common/scene/document.h"
#include "common/scene_io/faults.h"
#include "common/scene_io/source_place.h"

namespace lightmill {

struct MitsubaParameter {
  std::string type, name;  ///< the type is the tag: "float"
  SourcePlace place = {};
  /// One of float, integer and boolean. Three of point, vector and rgb. Of a spectrum, one or pairs with wavelengths.
  std::vector<double> numbers = {};
  std::string text = {};  ///< of a string; of a spectrum, the name of its file
  Transform transform = kIdentityTransform;
  mutable bool used = false;
};

class MitsubaObject;

/// An object within another one.
struct MitsubaChild {
  std::string name;  ///< may be empty
  SourcePlace place = {};
  std::string id = {};  ///< of a reference
  const MitsubaObject* object = nullptr;
  mutable bool used = false;
};

/// An XML element such as <bsdf type="diffuse">. Getters always return a value: the default if there is none. A wrong
/// one is noted, and gives the default, too.
class MitsubaObject {
 public:
  static constexpr double kAnything = std::numeric_limits<double>::max();

  std::string tag, type, id;
  SourcePlace place;
  std::vector<MitsubaParameter> parameters;
  std::vector<MitsubaChild> children;

  /// "bsdf diffuse".
  std::string what() const { return type.empty() ? tag : tag + " " + type; }
  /// The id, else "diffuse of line 12".
  std::string label() const;

  bool has(std::string_view name) const;
  double number(std::string_view name, double fallback, double low = -kAnything, double high = kAnything) const;
  std::int64_t whole(std::string_view name, std::int64_t fallback, std::int64_t low, std::int64_t high) const;
  bool boolean(std::string_view name, bool fallback) const;
  std::string text(std::string_view name, std::string fallback) const;
  /// A point or vector.
  Point3d point(std::string_view name, const Point3d& fallback) const;
  Transform transform(std::string_view name) const;
  /// A parameter of any type, which counts as used. Null if there is none.
  const MitsubaParameter* find(std::string_view name) const;
  /// Counts these as used.
  void ignore(std::initializer_list<std::string_view> names) const;
  /// The nested object of this name, which counts as used. Null if there is none.
  const MitsubaObject* child(std::string_view name) const;
  /// All nested objects with this tag, which count as used.
  std::vector<const MitsubaObject*> nested(std::string_view tag) const;

  /// Notes an error at a parameter, a nested object of this name, or the object.
  void fail(std::string_view name, std::string_view what) const;
  void fail(Status status) const;
  /// The first error. A nested object that nothing has asked for is one. Such parameters are faults.
  Status finish(Faults& faults) const;

 private:
  const MitsubaParameter* find(std::string_view name, std::initializer_list<std::string_view> types) const;

  mutable Status first_;
};

}  // namespace lightmill
