// Powers that nothing could radiate, found before a worker does (compiled/light_builder.h).
#pragma once

#include "common/scene_io/load.h"

namespace lightmill {

/// INVALID_ARGUMENT, beginning with the path of the material, where one states a power and the surfaces that it is used
/// for have no area. A worker, which computes in single precision, may find that of slivers too.
Status check_powers(const LoadedScene& loaded);

}  // namespace lightmill
