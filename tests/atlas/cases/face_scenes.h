// Scenes of faces that the map and other tests share.
#pragma once

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

/// A white floor with duplicates of its faces, points, lines, and needles too thin for single precision.
std::string degenerate_floor(double side);
/// A closed room with radiance 2. Every surface emits 1 and reflects a half. Faces emit nothing backwards, so light
/// behind a face would be darker. Blocks stand on the floor, against each other and the walls, and in each other. Some
/// faces are there twice.
AtlasCase blocks_in_a_furnace();
/// A unit square of radiance 1, `gap` below a ceiling and 1 above the floor. `view` shows the floor below its middle.
AtlasCase emitter_below_a_ceiling(double gap, const std::string& view = R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])");
/// A gap of height 1 in a wall. Everything seen through it from a distance of 1 glows.
AtlasCase door_ajar(double width);
/// A room that absorbs nothing. The sum over a thousand bounces is finite, and the picture shows it.
AtlasCase room_without_losses();
/// A furnace of radiance 1 / (1 − albedo).
AtlasCase room_of_albedo(double albedo);

/// Form factor of a wall of height a and half width b that stands on a floor, seen from the floor at distance c from
/// the middle of its foot (Siegel & Howell, C-5).
double standing_form_factor(double a, double b, double c);

}  // namespace lightmill::test
