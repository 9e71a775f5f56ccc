// Scenes of faces that both the map and tests of their own look at.
#pragma once

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

/// A white floor with the same floor again, points, lines, and needles thinner than single precision can tell.
std::string degenerate_floor(double side);
/// In a closed room whose every surface sends out 1 and reflects a half, there is radiance 2 whatever stands in it;
/// behind faces, which send out nothing backwards, there would be less. Blocks on the floor, against each other and
/// the walls, one in others, with faces that are there twice.
AtlasCase blocks_in_a_furnace();
/// A unit square of radiance 1 so far below a ceiling, and 1 above the floor; `view` of the floor under its middle.
AtlasCase lamp_below_a_ceiling(double gap, const std::string& view = R"("eye": [0, 0.5, 1], "look_at": [0, 0, 0])");
/// A door's gap 1 high in a wall, all of which glows that is seen through it from a distance of 1.
AtlasCase door_ajar(double width);
/// What goes in never comes out: the sum over a thousand bounces is finite, and that is what is shown.
AtlasCase room_without_losses();
/// A furnace of radiance 1 / (1 − albedo).
AtlasCase room_of_albedo(double albedo);

/// Form factor of a wall a high and b to either side that stands on a floor, seen from the floor at distance c from its
/// foot's middle (Siegel & Howell, C-5).
double standing_form_factor(double a, double b, double c);

}  // namespace lightmill::test
