#include "tests/atlas/cases/light_scenes.h"

#include <random>

#include "common/image/exr.h"

namespace lightmill::test {

ManyPoints many_points(int count) {
  ManyPoints made;
  made.lights.reserve(static_cast<std::size_t>(count) * 120);
  std::mt19937 random(71);  // the standard defines its numbers
  const auto number = [&] { return static_cast<double>(random()) * 0x1p-32; };
  for (int i = 0; i < count; ++i) {
    const double x = 40 * number() - 20, y = 0.5 + 4 * number(), z = 40 * number() - 20, intensity = number();
    fmt::format_to(std::back_inserter(made.lights),
                   R"({}{{"point":{{"position":[{:.9g},{:.9g},{:.9g}],"intensity":{{"rgb":[{:.9g},0,1]}}}}}})",
                   i == 0 ? "" : ",", x, y, z, intensity);
    made.radiance += intensity * y / std::pow(x * x + y * y + z * z, 1.5) / M_PI;
  }
  return made;
}

std::string glaring_and_dim() {
  return R"({"point": {"position": [0, 4, 0], "intensity": {"rgb": [100, 100, 100]}}},
            {"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, 1, 1]}}})";
}

std::string one_pixel(int width, int height, int x, int y, float value, float other) {
  Image image;
  image.display = image.data = {0, 0, width, height};
  std::vector<float> values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), other);
  values[static_cast<std::size_t>(y * width + x)] = value;
  for (const char* const name : {"R", "G", "B"}) {
    image.channels.push_back({name, values});
  }
  return *encode_exr(image);
}

double irradiance_of_pixel(int width, int height, int px, int py, double value, const Vec3d& n, double turn) {
  constexpr int kSteps = 400;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double x = px + 0.5 + 2 * ((i + 0.5) / kSteps) - 1, y = py + 0.5 + 2 * ((j + 0.5) / kSteps) - 1;
      if (y < 0 || y > height) {
        continue;
      }
      const double at_pole = (py == 0 && y < 0.5) || (py == height - 1 && y > height - 0.5) ? 1 : 0;
      const double weight = (1 - std::abs(x - px - 0.5)) * (at_pole > 0 ? 1 : 1 - std::abs(y - py - 0.5));
      const double phi = 2 * M_PI * (x / width - 0.5) - turn, theta = M_PI * y / height;
      const Vec3d d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
      sum += weight * std::max(0.0, glm::dot(d, n)) * std::sin(theta);
    }
  }
  return M_PI + (value - 1) * sum * (2.0 / kSteps) * (2.0 / kSteps) * (2 * M_PI / width) * (M_PI / height);
}

std::string mirror_ball_in_a_sky(const std::string& look_at) {
  return document(fmt::format(R"("eye": [0, 0, 0], "look_at": {}, "up": [0, 0, 1])", look_at), 120, 16,
                  R"({"name": "mirror", "mirror": {}})", sphere("mirror", "[0, 0, 2]", 1),
                  R"({"environment": {"file": "sky.exr", "rotation_degrees": 17}})");
}

}  // namespace lightmill::test
