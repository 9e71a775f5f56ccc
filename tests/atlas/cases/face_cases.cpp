// Several faces: coplanar, touching and near ones, thin walls, gaps and closed rooms.
#include "tests/atlas/cases/face_scenes.h"
#include "tests/atlas/cases/light_over_mirror.h"

namespace lightmill::test {
namespace {

/// A room with a wall across. A light and a mirror ball are on the far side. This side is black, also in a second
/// mirror ball.
AtlasCase dark_side(const std::string& name, const std::string& wall) {
  return {.subject = "thin wall lit on one side (leaks)",
          .name = name,
          .document = document(R"("eye": [0.8, 1.4, 0.5], "look_at": [0.3, 0.2, -0.1])", 60, 32,
                               diffuse("wall", 0.8) + also(named("mirror", R"("mirror": {})")),
                               mesh("wall", "room.obj") + also(mesh("wall", "wall.obj")) +
                                   also(sphere("mirror", "[-0.5, 0.4, 0]", 0.3)) +
                                   also(sphere("mirror", "[0.5, 0.3, -0.2]", 0.25)),
                               R"({"point": {"position": [-0.3, 1.5, 0.2], "intensity": {"rgb": [1, 1, 1]}}})"),
          .files = {{"room.obj", box(-1, 1, 0, 2, -1, 1)}, {"wall.obj", wall}},
          .exact = 0,
          .gathered = 0.02,
          .unit = 0.3,
          .level = 3};
}

/// A slab of glass just above a floor of albedo ½ under a sun of irradiance π, seen from above.
AtlasCase slab_on_a_floor(double gap) {
  return {.subject = "1e-4 gaps",
          .name = fmt::format("glass {} above a floor, the sun above", gap),
          .document = document(
              R"("eye": [0.01, 3, 0.02], "look_at": [0, 0, 0])", 10, 32,
              named("glass", R"("dielectric": {"ior": 1.5})") + also(diffuse("floor", 0.5)),
              plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(mesh("glass", "slab.obj")),
              fmt::format(R"({{"directional": {{"direction": [0, -1, 0], "irradiance": {}}}}})", gray(kPiDouble))),
          .files = {{"slab.obj", box(-30, 30, gap, 1 + gap, -30, 30)}},
          .exact = 0.9230769 * 0.5004331,
          .tolerance = 3e-3,
          .gathered = 3e-3,
          .level = 3};
}

}  // namespace

std::vector<AtlasCase> face_cases() {
  std::vector<AtlasCase> cases;
  for (const double thickness : {0.1, 1e-3, 1e-5}) {
    cases.push_back(dark_side(fmt::format("{} thick", thickness), box(0, thickness, -0.1, 2.1, -1.1, 1.1)));
  }
  cases.push_back(
      dark_side("without thickness", polygon({{0, -0.1, 1.1}, {0, -0.1, -1.1}, {0, 2.1, -1.1}, {0, 2.1, 1.1}})));
  {
    LightOverMirror worse{.subject = "needle, zero-area, duplicate triangles", .name = "as a mirror"};
    worse.mirror = mesh("mirror", "mirror.obj");
    worse.files = {{"mirror.obj", degenerate_floor(40)}};
    cases.push_back(worse.made());
  }
  cases.push_back(blocks_in_a_furnace());
  for (const double gap : {1e-2, 1e-4, 1e-5}) {
    cases.push_back(emitter_below_a_ceiling(gap));
  }
  for (const double width : {0.5, 0.1, 0.01}) {
    cases.push_back(door_ajar(width));
  }
  for (const double gap : {1e-2, 1e-4}) {
    cases.push_back(slab_on_a_floor(gap));
  }
  cases.push_back(room_without_losses());
  cases.push_back(room_of_albedo(0.99));
  return cases;
}

}  // namespace lightmill::test
