#include "client/cli/scene_options.h"

#include <new>
#include <set>

#include "client/cli/blender.h"
#include "client/cli/console.h"
#include "client/cli/context.h"
#include "common/base/out_of_memory.h"
#include "common/scene_io/picture_notices.h"

namespace lightmill::cli {
namespace {

Result<LoadedScene> load_within_memory(const std::vector<std::filesystem::path>& paths, bool blend, int bake_size,
                                       const LoadOptions& options, Signals& signals) {
  try {
    return blend ? load_blend(paths[0], bake_size, options, signals) : lightmill::load_scene(paths, options);
  } catch (const std::bad_alloc&) {
    return as_input_error(out_of_memory(fmt::format("{}: reading it", paths[0].string())));
  }
}

}  // namespace

void add_scene_options(CLI::App& command, SceneOptions& options) {
  command.option_defaults()->group("Scene");
  command
      .add_option(
          "SCENE", options.scenes,
          "a scene document (.json), Wavefront OBJ files, a glTF, PLY or STL file, a pbrt or Mitsuba scene, or a .blend file "
          "(`lightmill help scenes`)")
      ->type_name("FILE")
      ->required();
  command
      .add_option("--camera", options.camera,
                  "a camera of the scene, by its name or number, a JSON file with a camera, or auto: a view of all")
      ->type_name("NAME|N|FILE|auto");
  command
      .add_option("--mtl", options.mtl,
                  "meaning of Ka in MTL files: emission (course), or ambient light, which is ignored (standard)")
      ->type_name("course|standard");
  command
      .add_option(
          "--sky", options.sky,
          "on adds a uniform white sky, off none, and auto a soft sky to OBJ, glTF, PLY and STL files without a light "
          "source")
      ->type_name("auto|on|off")
      ->capture_default_str();
  command.add_option("--at", options.at, "show a glTF file at this moment of its animation (default: 0)")
      ->type_name("SECONDS")
      ->check(real_number(0, 1e9));
  command
      .add_option("--animation", options.animation,
                  "animation for --at, by name or by number from 1 (default: the first)")
      ->type_name("NAME|N");
  command
      .add_option(
          "--bake-size", options.bake_size,
          fmt::format("Blender: texels along each side of the images that Cycles bakes from procedural textures "
                      "(default {})",
                      kBakeSize))
      ->type_name("N")
      ->check(whole_number(16, kMaxBakeSize));
  command.add_flag("--strict", options.strict,
                   "refuse OBJ, MTL, glTF, pbrt and Mitsuba files with faults, such as odd lines and missing files");
  command.add_flag(
      kUnsandboxedImages, options.unsandboxed_images,
      "decode images and compressed meshes even if the kernel refuses the sandbox (seccomp). Only for scenes from people "
      "you trust");
  command.option_defaults()->group("Options");
}

Result<LoadedScene> load_scene(const SceneOptions& options, Signals& signals) {
  LoadOptions load_options;
  load_options.camera = options.camera;
  load_options.strict = options.strict;
  if (options.mtl == "course") {
    load_options.ka = KaMeaning::emission;
  } else if (options.mtl == "standard") {
    load_options.ka = KaMeaning::ambient;
  } else if (!options.mtl.empty()) {
    return invalid_argument("--mtl must be course or standard, got '{}'", options.mtl);
  }
  if (options.sky != "auto" && options.sky != "on" && options.sky != "off") {
    return invalid_argument("--sky must be auto, on or off, got '{}'", options.sky);
  }
  load_options.sky = options.sky == "on" ? SkyChoice::on : options.sky == "off" ? SkyChoice::off : SkyChoice::automatic;
  if (options.at || !options.animation.empty()) {
    load_options.moment = AnimationMoment{options.animation, options.at.value_or(0)};
  }
  const std::vector<std::filesystem::path> paths(options.scenes.begin(), options.scenes.end());
  for (const std::filesystem::path& path : paths) {
    if (lower_ending(path) == ".exr" || lower_ending(path) == ".png") {
      return invalid_argument("{} is a picture, not a scene. To write it, put -o before its name", path.string());
    }
    if (!options.mtl.empty() && lower_ending(path) != ".obj") {
      return invalid_argument("--mtl applies only to OBJ files, and {} is not one: leave out --mtl", path.string());
    }
    if (load_options.moment && lower_ending(path) != ".gltf" && lower_ending(path) != ".glb") {
      return invalid_argument("--at and --animation apply only to glTF files, and {} is not one: leave them out",
                              path.string());
    }
  }
  const auto is_blend = [](const std::filesystem::path& path) { return lower_ending(path) == ".blend"; };
  const bool blend = std::ranges::any_of(paths, is_blend);
  if (options.bake_size && !blend) {
    return invalid_argument("--bake-size applies only to .blend files, and {} is not one: leave it out",
                            paths[0].string());
  }
  if (blend && paths.size() > 1) {
    return invalid_argument("a .blend file cannot be combined with other files, got {} files", paths.size());
  }
  DecoderProcess decoder({.unsandboxed = options.unsandboxed_images});
  bool meshes = false;
  load_options.decode_mesh = [&](ByteView bytes, const MeshRequest& request) {
    meshes = true;
    return signals.interrupted() ? Result<DecodedMesh>(cancelled("interrupted")) : decoder.decode_mesh(bytes, request);
  };
  Result<LoadedScene> loaded =
      load_within_memory(paths, blend, options.bake_size.value_or(kBakeSize), load_options, signals);
  if (!loaded.ok()) {
    return as_input_error(loaded.status());
  }
  if (options.unsandboxed_images && (meshes || !loaded->images.empty())) {
    loaded->notices.push_back(
        "images and compressed meshes are decoded without a sandbox where the kernel refuses it (--unsandboxed-images)");
  }
  LM_RETURN_IF_ERROR(as_input_error(check_images(decoder, *loaded, signals)));
  return loaded;
}

namespace {

std::uint64_t negative_pixels(const Texels& texels) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i + 3 < texels.floats.size(); i += 4) {
    const float* rgb = &texels.floats[i];
    count += rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0 ? 1 : 0;
  }
  for (std::size_t pixel = 0; texels.half && pixel < texels.words.size(); ++pixel) {
    const auto negative = [&](std::size_t channel) {
      constexpr std::uint32_t kMinusZero = 0x8000;
      return component(texels, pixel, channel) > kMinusZero;
    };
    count += negative(0) || negative(1) || negative(2) ? 1 : 0;
  }
  return count;
}

Status check_image(DecoderProcess& decoder, const ImageAsset& image, LoadedScene& loaded) {
  const ByteView bytes = as_byte_view(loaded.assets.at(image.asset));
  LM_ASSIGN_OR_RETURN(const ImageSize size, with_context(decoder.size(bytes, image.name), image.place));
  LM_ASSIGN_OR_RETURN(const Texels texels, with_context(decoder.decode(bytes, image.name), image.place));
  LM_RETURN_IF_ERROR(check_image_header(image, size, loaded.notices));
  if (const std::uint64_t negative = negative_pixels(texels); negative > 0) {
    loaded.notices.push_back(fmt::format("{}: {}: negative values count as 0 (pixels: {} of {})", image.place,
                                         image.name, negative, std::int64_t{texels.width} * texels.height));
  }
  return ok_status();
}

}  // namespace

Status check_images(DecoderProcess& decoder, LoadedScene& loaded, const Signals& signals) {
  std::set<std::tuple<Sha256, std::string, bool>> checked;
  for (const ImageAsset& image : loaded.images) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    if (checked.emplace(image.asset, image.name, image.environment).second) {
      LM_RETURN_IF_ERROR(check_image(decoder, image, loaded));
    }
  }
  return ok_status();
}

}  // namespace lightmill::cli
