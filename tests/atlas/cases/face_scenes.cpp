#include "tests/atlas/cases/face_scenes.h"

namespace lightmill::test {

std::string degenerate_floor(double side) {
  return plane(side, 0, true) + plane(side, 0, true) +
         "f 1 1 1\nf 1 2 2\nf 1 2 1\nv 0 0 0\nv 0.1 0 0.1\nv 0.2 0 0.2\nf 9 10 11\n"
         "v -3 0 -0.01\nv 3 0 -0.01\nv 3 0 -0.010000001\nf 12 13 14\nv 3 0 -0.0100000000001\n"
         "f 12 13 15\n";
}

AtlasCase blocks_in_a_furnace() {
  AtlasCase made{.subject = "coplanar faces",
                 .name = "blocks on the floor, against walls, in each other",
                 .files = {{"room.obj",
                            // faces inwards
                            "v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nv -1 0 1\nv 1 0 1\n"
                            "v 1 2 1\nv -1 2 1\nf 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 4 3 7 8\n"
                            "f 1 4 8 5\nf 2 6 7 3\n"},
                           {"a.obj", box(-0.8, -0.2, 0, 1, -0.8, 0)},
                           {"b.obj", box(-0.2, 0.3, 0, 1, -0.8, 0)},
                           {"c.obj", box(-0.5, 0.1, 0.5, 0.9, -0.6, -0.1)},
                           {"d.obj", box(0.4, 1, 0, 0.6, -1, -0.5)},
                           {"e.obj", box(0.5, 0.9, 0.6, 0.9, -0.9, -0.6)},
                           {"d2.obj", box(0.4, 1, 0, 0.6, -1, -0.5)},
                           {"hair.obj", box(-0.3, 0.3, 1.9998, 1.9999, 0.2, 0.6)}},
                 .exact = 2,
                 .gathered = 0.01,  // corners and gaps within every disc
                 .level = 2};
  std::string objects;
  for (const auto& [name, text] : made.files) {
    objects += (objects.empty() ? "" : ", ") + mesh("wall", name);
  }
  made.document =
      document(R"("eye": [0.3, 1.2, 0.9], "look_at": [-0.1, 0.5, -0.5])", 80, 32, diffuse("wall", 0.5, 1), objects);
  return made;
}

AtlasCase emitter_below_a_ceiling(double gap, const std::string& view) {
  return {.subject = "coplanar faces",
          .name = fmt::format("a lamp {} below a ceiling", gap),
          .document =
              document(view, 0.01, 8, diffuse("wall", 1) + also(diffuse("lamp", 0, 1)),
                       mesh("wall", "floor.obj") + also(mesh("wall", "ceiling.obj")) + also(mesh("lamp", "lamp.obj"))),
          .files = {{"floor.obj", plane(20, 0, true)},
                    {"ceiling.obj", plane(20, 1 + gap, false)},
                    {"lamp.obj", horizontal_square(1, 1, false)}},
          .exact = 0.2394565,
          .max_bounces = 1,
          .level = 5};
}

double standing_form_factor(double a, double b, double c) {
  const double d = std::sqrt(a * a + c * c);
  return (std::atan(b / c) - c / d * std::atan(b / d)) / M_PI;
}

AtlasCase door_ajar(double width) {
  const auto upright = [](double x, double y0, double y1, double z0, double z1) {
    return polygon({{x, y0, z1}, {x, y0, z0}, {x, y1, z0}, {x, y1, z1}});  // faces +x
  };
  return {.subject = "door ajar",
          .name = fmt::format("a gap {} wide", width),
          .document = document(R"("eye": [1, 0.5, 0.01], "look_at": [1, 0, 0])", 1e-3, 8,
                               diffuse("floor", 1) + also(diffuse("wall", 0)) + also(diffuse("lamp", 0, 1)),
                               plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(mesh("lamp", "lamp.obj")) +
                                   also(mesh("wall", "left.obj")) + also(mesh("wall", "right.obj")) +
                                   also(mesh("wall", "top.obj"))),
          .files = {{"lamp.obj", upright(-1, 0, 3, -2, 2)},
                    {"left.obj", upright(0, 0, 1, -9, -width / 2)},
                    {"right.obj", upright(0, 0, 1, width / 2, 9)},
                    {"top.obj", upright(0, 1, 9, -9, 9)}},
          .exact = standing_form_factor(1, width / 2, 1),
          .max_bounces = 1,
          .level = 7};
}

AtlasCase room_without_losses() {
  return {.subject = "albedo 1 in a closed room and .99",
          .name = "albedo 1, to the limit of 1000 bounces",
          .document = document(
              kInside, 60, 2, diffuse("wall", 1), sphere("wall", "[0, 0, 0]", 1, true),
              R"({"point": {"position": [0, 0, 0], "intensity": {"rgb": [3.14159265, 3.14159265, 3.14159265]}}})"),
          .exact = 1000,
          .level = 1,
          .long_by = "vcm"};  // photons meet a thousand surfaces, and each is a vertex
}

AtlasCase room_of_albedo(double albedo) {
  return {.subject = "albedo 1 in a closed room and .99",
          .name = fmt::format("albedo {}", albedo),
          .document = document(kInside, 60, 4, diffuse("wall", albedo, 1), sphere("wall", "[0, 0, 0]", 1, true)),
          .exact = 1 / (1 - albedo),
          .level = 4,
          .long_by = "vcm"};  // for the same reason
}

}  // namespace lightmill::test
