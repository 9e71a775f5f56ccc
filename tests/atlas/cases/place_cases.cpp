// Scenes of any size and at any place, and cameras at difficult places, all with a light over a mirror.
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/light_over_mirror.h"

namespace lightmill::test {

std::vector<AtlasCase> place_cases() {
  std::vector<AtlasCase> cases;
  for (const double distance : {1e2, 1e4, 1e6}) {
    cases.push_back(LightOverMirror{.subject = "scene moved to 1e2 ... 1e6",
                                    .name = fmt::format("by {}", distance),
                                    .offset = {distance, -0.7 * distance, 0.3 * distance}}
                        .made());
  }
  for (const double scale : {1e-4, 1e-2, 1e2, 1e4}) {
    cases.push_back(
        LightOverMirror{.subject = "scene scaled 1e-4 ... 1e4", .name = fmt::format("by {}", scale), .scale = scale}
            .made());
  }
  for (const double height : {1e-3, 1e-6}) {
    cases.push_back(LightOverMirror{.subject = "camera on a surface",
                                    .name = fmt::format("{} above a mirror", height),
                                    .view = {.eye = {-1, height, 0}, .look_at = {1, 0.5, 0}}}
                        .made());
  }
  return cases;
}

}  // namespace lightmill::test
