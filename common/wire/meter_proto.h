// Conversion of virtual meters between lightmill.v1.Meter and values. Errors begin with the path of the field.
#pragma once

#include <string>

#include "common/scene/document.h"

namespace lightmill::v1 {
class Meter;
}  // namespace lightmill::v1

namespace lightmill {

void to_wire_meter(const Meter& meter, v1::Meter* out);
Result<Meter> meter_from_wire(const std::string& path, const v1::Meter& meter);

}  // namespace lightmill
