// Values in the attributes of Mitsuba's XML elements.
#pragma once

#include <functional>
#include <map>

#include "common/scene_io/mitsuba/mitsuba_object.h"

namespace lightmill {

using MitsubaAttributes = std::map<std::string_view, std::string>;

/// Empty if it is not given.
std::string value_of(const MitsubaAttributes& given, std::string_view name);

/// The values of <default>, which stand for "$name" in attributes.
class MitsubaDefaults {
 public:
  /// The first definition of a name is used.
  Status add(const std::string& name, const std::string& value, const SourcePlace& place);
  /// `text` with values instead of names. The longest matching name is used. "\$" is a dollar sign.
  Result<std::string> substitute(std::string_view text, const SourcePlace& place);

 private:
  std::map<std::string, std::string, std::less<>> values_;
  std::size_t bytes_ = 0, steps_ = 0;  ///< of all texts so far
};

/// Sets the numbers or the text of a parameter whose type and place are set.
Status read_mitsuba_value(const MitsubaAttributes& given, MitsubaParameter& out);

/// A step of a transform: translate, rotate, scale, lookat or matrix.
Result<Transform> read_mitsuba_transform(std::string_view tag, const MitsubaAttributes& given,
                                         const SourcePlace& place);

}  // namespace lightmill
