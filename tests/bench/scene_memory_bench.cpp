// Memory that compiling a scene takes, compared with the estimate: grids of all kinds of triangles, copies of one,
// balls, and given documents. Each is compiled in its own process.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>

#include "common/image/exr.h"
#include "common/image/png.h"
#include "common/scene/compiled/compiled_scene.h"
#include "common/scene/compiled/scene_memory.h"
#include "common/scene/mesh.h"
#include "common/scene_io/load.h"
#include "tests/support/read_image.h"

namespace {

using namespace lightmill;
namespace fs = std::filesystem;

std::uint64_t status_kib(const std::string& name) {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(name)) {
      return std::stoull(line.substr(name.size() + 1));
    }
  }
  return 0;
}

struct Kind {
  std::string name;
  int side = 0;  ///< a grid with this many squares on a side
  bool normals = false, coordinates = false, emissive = false, moved = false;
  int copies = 1;
  int balls = 0;
};

/// A ball with an image: a texture or the sky.
LoadedScene with_image(const std::string& file, std::string bytes, bool sky) {
  LoadedScene loaded;
  Scene& scene = loaded.scene;
  const Sha256 digest = sha256(bytes);
  loaded.assets.emplace(digest, std::move(bytes));
  scene.materials.emplace_back().name = "grey";
  if (sky) {
    scene.lights.push_back(
        {"sky", EnvironmentLight{.orientation = {}, .file = file, .asset = digest, .has_image = true}});
  } else {
    scene.textures.push_back({"image", file, digest});
    scene.materials[0].kind = DiffuseMaterial{.reflectance = {{1, 1, 1}, 0}};
  }
  scene.objects.push_back({"ball", 0, SphereShape{{0, 0, 0}, 1}});
  scene.camera.eye = {5, 5, 50};
  return loaded;
}

std::string png_of(int width, int height) {
  std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] = static_cast<std::uint8_t>(i >> 8);
  }
  return encode_png(width, height, rgb).value();
}

std::string exr_of(int width, int height) {
  Image image{{0, 0, width, height}, {0, 0, width, height}, {}, {}};
  for (const char* name : {"R", "G", "B"}) {
    std::vector<float> values(static_cast<std::size_t>(image.data.pixel_count()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(i % 1000) * 1e-3f;
    }
    image.channels.push_back({name, std::move(values)});
  }
  return encode_exr(image).value();
}

LoadedScene made(const Kind& kind) {
  LoadedScene loaded;
  Scene& scene = loaded.scene;
  Material material;
  material.name = "grey";
  if (kind.emissive) {
    material.emission = {1, 1, 1};
  }
  scene.materials.push_back(material);
  if (kind.side > 0) {
    Mesh mesh;
    const auto n = static_cast<std::uint32_t>(kind.side);
    for (std::uint32_t y = 0; y <= n; ++y) {
      for (std::uint32_t x = 0; x <= n; ++x) {
        mesh.positions.push_back({x * 1.0, y * 1.0, std::sin(0.1 * x) * std::cos(0.07 * y)});
        if (kind.normals) {
          mesh.normals.push_back({0, 0, 1});
        }
        if (kind.coordinates) {
          mesh.texture_coordinates.push_back({static_cast<float>(x), static_cast<float>(y)});
        }
      }
    }
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t at = y * (n + 1) + x;
        mesh.triangles.push_back({at, at + 1, at + n + 2});
        mesh.triangles.push_back({at, at + n + 2, at + n + 1});
      }
    }
    std::string bytes = encode_mesh(mesh);
    const Sha256 digest = sha256(bytes);
    loaded.assets.emplace(digest, std::move(bytes));
    for (int i = 0; i < kind.copies; ++i) {
      Object object;
      object.name = fmt::format("grid {}", i);
      object.shape = MeshShape{"grid.obj", digest};
      if (kind.moved || kind.copies > 1) {
        object.transform[2][3] = i + 1;
      }
      scene.objects.push_back(object);
    }
  }
  for (int i = 0; i < kind.balls; ++i) {
    Object object;
    object.name = fmt::format("ball {}", i);
    object.shape = SphereShape{{1.0 * (i % 1000), 1.0 * (i / 1000), 0}, 0.4};
    scene.objects.push_back(object);
  }
  scene.camera.eye = {5, 5, 50};
  scene.camera.look_at = {5, 5, 0};
  return loaded;
}

void measure(const std::string& name, const LoadedScene& loaded) {
  const auto assets = [&](const Sha256& digest) -> Result<std::string> { return loaded.assets.at(digest); };
  const Result<SceneMemory> estimated = estimate_memory(loaded.scene, assets, read_size);
  std::ofstream("/proc/self/clear_refs") << 5;  // the peak counts from here
  const std::uint64_t before = status_kib("VmRSS:");
  const auto compiled = CompiledScene::compile(loaded.scene, assets, read_image, {});
  if (!estimated.ok() || !compiled.ok()) {
    fmt::print("{}: {}\n", name, message_of(estimated.ok() ? compiled.status() : estimated.status()));
    return;
  }
  const double mib = 1.0 / 1024, peak = static_cast<double>(status_kib("VmHWM:") - before) * mib,
               held = static_cast<double>(status_kib("VmRSS:") - before) * mib,
               estimate = static_cast<double>(estimated->bytes) * mib * mib;
  fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.2f} |\n", name, estimated->triangles, held,
             static_cast<double>((*compiled)->bytes()) * mib * mib, peak, estimate, estimate / peak);
}

/// Runs in a new process with untouched memory.
void apart(const std::function<void()>& what) {
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    what();
    std::fflush(stdout);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures the memory of scene compilation.");
  std::vector<std::string> documents;
  int side = 1000;
  app.add_option("DOCUMENT", documents, "scenes");
  app.add_option("--side", side, "squares on a side of the grids")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  fmt::print("| scene | triangles | held (MiB) | reported as held | peak | estimated | estimated / peak |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Kind& kind :
       {Kind{"flat", side}, Kind{"flat, moved", side, false, false, false, true}, Kind{"normals", side, true},
        Kind{"normals, coordinates", side, true, true}, Kind{"glowing", side / 2, false, false, true},
        Kind{"100 instances", side / 2, true, false, false, false, 100},
        Kind{"a million balls", 0, false, false, false, false, 1, 1'000'000}}) {
    apart([&] { measure(kind.name, made(kind)); });
  }
  const int width = 4 * side, height = 2 * side;
  const std::string png = png_of(width, height), exr = exr_of(width, height);
  const auto name = [&](const char* what) { return fmt::format("{} of {}x{}", what, width, height); };
  apart([&] { measure(name("a texture, 8 bits,"), with_image("a.png", png, false)); });
  apart([&] { measure(name("a texture, floats,"), with_image("a.exr", exr, false)); });
  apart([&] { measure(name("a sky, 8 bits,"), with_image("a.png", png, true)); });
  apart([&] { measure(name("a sky, floats,"), with_image("a.exr", exr, true)); });
  for (const std::string& document : documents) {
    apart([&] {
      const fs::path path = document;
      const Result<LoadedScene> loaded = load_scene(std::span(&path, 1));
      if (loaded.ok()) {
        measure(path.stem().string(), *loaded);
      } else {
        fmt::print("{}\n", message_of(loaded.status()));
      }
    });
  }
  return 0;
}
