// What the cases of the failure atlas have in common.
#pragma once

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/base/check.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {

inline std::string also(const std::string& entry) {
  return fmt::format(", {}", entry);
}

/// One more object of a document.
inline std::string shape(const std::string& material, const std::string& kind, const std::string& transform = "") {
  return fmt::format(R"({{"material": "{}", {}{}}})", material, kind,
                     transform.empty() ? "" : fmt::format(R"(, "transform": {})", transform));
}
inline std::string plane_shape(const std::string& material, const std::string& point, const std::string& normal) {
  return shape(material, fmt::format(R"("plane": {{"point": {}, "normal": {}}})", point, normal));
}
inline std::string sky(double radiance) {
  return fmt::format(R"({{"environment": {{"radiance": {}}}}})", gray(radiance));
}

/// A picture without samples that are no numbers.
inline HalfImages clean_picture(const TestScene& scene, const std::string& method, std::uint32_t level,
                                std::uint32_t max_bounces = 0) {
  HalfImages image = scene.render({method, 70, max_bounces}, level);
  EXPECT_EQ(image.non_finite, 0u) << method;
  return image;
}

/// Every value of a picture is `exact`, but for a share `strays` of them at most.
inline void expect_even(const HalfImages& image, double exact, double tolerance, double strays = 0) {
  std::size_t off = 0;
  double worst = exact;
  for (const auto* half : {&image.a, &image.b}) {
    for (const double value : *half) {
      if (!(std::abs(value - exact) <= tolerance)) {
        ++off;
        worst = std::abs(value - exact) > std::abs(worst - exact) ? value : worst;
      }
    }
  }
  EXPECT_LE(static_cast<double>(off), strays * 2 * static_cast<double>(image.a.size()))
      << off << " values are off, such as " << worst;
}

/// Why a document is refused: its error without the folder; "" if it is not.
inline std::string refusal(const std::string& document, const std::map<std::string, std::string>& files = {},
                           const CompiledScene::ImageDecoder& images = nullptr) {
  namespace fs = std::filesystem;
  std::string folder = (fs::temp_directory_path() / "lightmill-test-XXXXXX").string();
  LM_CHECK(::mkdtemp(folder.data()) != nullptr);
  for (const auto& [name, text] : files) {
    std::ofstream(fs::path(folder) / name) << text;
  }
  const fs::path path = fs::path(folder) / "scene.json";
  std::ofstream(path) << document;
  std::string message;
  if (const auto loaded = load_scene(std::span(&path, 1)); !loaded.ok()) {
    message = message_of(loaded.status());
  } else {
    const auto compiled = CompiledScene::compile(
        loaded->scene, [&](const Sha256& digest) -> Result<std::string> { return loaded->assets.at(digest); }, images);
    message = compiled.ok() ? "" : message_of(compiled.status());
  }
  fs::remove_all(folder);
  for (std::size_t at = 0; (at = message.find(folder + "/")) != std::string::npos;) {
    message.erase(at, folder.size() + 1);
  }
  return message;
}

}  // namespace lightmill::test
