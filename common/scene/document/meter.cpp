#include "common/scene/document/meter.h"

namespace lightmill {

const Patch* patch_of(const Meter& meter) {
  if (const auto* mean = std::get_if<PatchMeter>(&meter.kind)) {
    return &mean->patch;
  }
  const auto* flux = std::get_if<FluxMeter>(&meter.kind);
  return flux == nullptr ? nullptr : &flux->patch;
}

}  // namespace lightmill
