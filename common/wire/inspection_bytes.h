// Inspections as bytes, for a process of the same program.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/farm/inspection.h"

namespace lightmill {

std::string pack_request(const InspectionRequest& request);
/// INVALID_ARGUMENT if the bytes are damaged or exceed the limits of a message.
Result<InspectionRequest> unpack_request(std::string_view bytes);

std::string pack_inspection(const Inspection& inspection);
/// INVALID_ARGUMENT if the bytes are damaged or exceed the limits of a message.
Result<Inspection> unpack_inspection(std::string_view bytes);

}  // namespace lightmill
