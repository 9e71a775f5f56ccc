// Prints a hash of every method's film of every atlas case, the shipped scenes included, and the fingerprint class. For
// changes that must not change a bit.
//
//   build/release/bench/film_hashes > before.txt    # a change and a build later: > after.txt, and compare the two
#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/base/digest.h"
#include "common/methods/fingerprint.h"
#include "common/methods/spec/method_spec.h"
#include "tests/atlas/cases/atlas_case.h"
#include "tests/support/read_image.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

/// Hash of all layers and meters of the method, or the refusal.
std::string hash_by(const std::shared_ptr<const CompiledScene>& scene, const std::string& name,
                    std::uint32_t max_bounces, std::uint32_t level) {
  if (max_bounces > 0 && !(method_bounces(name) && check_max_bounces(name, max_bounces).ok())) {
    max_bounces = 0;
  }
  const auto method = make_method(scene, {name, 1, max_bounces, all_layers(name, scene->light_groups())});
  if (!method.ok()) {
    return message_of(method.status());
  }
  const auto meters = method_reads_meters(name) ? static_cast<std::uint32_t>(scene->meters().size()) : 0;
  const TileGrid grid({0, 0, scene->film_width(), scene->film_height()}, meters);
  const auto workspace = (*method)->make_workspace();
  Xxh3Hasher hasher;
  for (std::uint32_t tile = 0; tile < grid.tile_count(); ++tile) {
    const Node node = (*method)->render(grid.tile_rect({tile}), {level, 0}, *workspace);
    const Hash128 hash = hash_of(node);
    hasher.append(std::as_bytes(std::span(&hash, 1)));
  }
  return hasher.finish().hex();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Prints a hash of every method's film of every atlas case, and the fingerprint class."};
  std::uint32_t level = 3;
  app.add_option("--level", level, "log2 of the samples per pixel")->check(CLI::Range(0u, 10u))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::printf("%-32s fingerprint class\n", fingerprint_class().c_str());
  for (const AtlasGroup& group : atlas_groups()) {
    for (const AtlasCase& what : group.cases()) {
      if (!what.refusal.empty()) {
        continue;
      }
      const std::shared_ptr<const CompiledScene> scene = scene_of(what, read_image).compiled();
      for (const std::string_view name : method_names()) {
        if (name != kAutoMethod) {
          std::printf("%-32s %s: %s by %s\n", hash_by(scene, std::string(name), what.max_bounces, level).c_str(),
                      what.subject.c_str(), what.name.c_str(), std::string(name).c_str());
          std::fflush(stdout);
        }
      }
    }
  }
  return 0;
}
