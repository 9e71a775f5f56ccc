// Sensors of a Mitsuba scene.
#pragma once

#include "common/scene_io/load.h"
#include "common/scene_io/mitsuba/mitsuba_object.h"
#include "common/scene_io/notices.h"

namespace lightmill {

struct MitsubaView {
  NamedCamera camera;
  FilmSettings film;
};

/// A sensor with its film, pixel filter and sampler. An error names its place.
Result<MitsubaView> read_mitsuba_view(const MitsubaObject& sensor, Notices& notices, Faults& faults);

}  // namespace lightmill
