#include "client/cli/render_options.h"

#include <pwd.h>
#include <unistd.h>

#include <cstdlib>
#include <limits>
#include <random>

#include "client/cli/context.h"
#include "client/cli/units.h"
#include "common/base/address.h"
#include "common/base/text.h"
#include "common/farm/job_rules.h"
#include "common/film/reconstruct.h"
#include "common/film/sample_range.h"
#include "common/methods/spec/method_spec.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/picture_notices.h"
#include "common/wire/scene_proto.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

std::string user_name() {
  const passwd* entry = ::getpwuid(::geteuid());
  if (entry != nullptr && entry->pw_name != nullptr) {
    return entry->pw_name;
  }
  const char* user = std::getenv("USER");
  return user == nullptr ? "" : user;
}

/// 128 random bits: two submissions never share an id by chance.
std::string new_request_id() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

Result<PixelRect> checked_crop(const std::string& text, int width, int height) {
  if (text.empty()) {
    return PixelRect{0, 0, width, height};
  }
  LM_ASSIGN_OR_RETURN(const PixelRect crop, parse_crop(text));
  if (!check_crop(width, height, crop).ok()) {
    return invalid_argument("--crop {} does not lie within the picture of {}x{} pixels", text, width, height);
  }
  return crop;
}

Result<Goal> checked_goal(Goal goal) {
  if (goal.samples == 0 && goal.seconds == 0 && goal.error == 0) {
    goal.samples = kDefaultSamples;
  }
  // The options check each limit alone. Only an adaptive job may have fewer samples.
  LM_RETURN_IF_ERROR(with_context(check_goal(goal), "--spp with --adaptive"));
  return goal;
}

Result<MethodSpec> checked_method(const RenderSettings& settings) {
  LM_ASSIGN_OR_RETURN(MethodSpec method, with_context(parse_method(settings.method), "--method"));
  if (settings.max_bounces > 0 && !method_bounces(method.name)) {
    return invalid_argument("--max-bounces has no effect with {}, which traces no light paths", method.name);
  }
  LM_RETURN_IF_ERROR(with_context(check_max_bounces(method.name, settings.max_bounces), "--max-bounces"));
  return method;
}

Result<std::vector<LayerSpec>> make_layers(const RenderOptions& options, std::string_view method) {
  const std::string_view text = options.layers;
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= text.size() && !text.empty();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    names.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  const auto add = [&](std::string_view name) {
    if (std::ranges::find(names, name) == names.end()) {
      names.emplace_back(name);
    }
  };
  if (options.denoise) {
    add(kFeaturesLayer);
  }
  if (!options.png_layer.empty()) {
    add(options.png_layer);
  }
  const std::string_view given = options.png_layer.empty() ? "--layers" : "--layers and --png-layer";
  LM_ASSIGN_OR_RETURN(std::vector<LayerSpec> layers, with_context(film_layers(names), given));
  LM_RETURN_IF_ERROR(with_context(check_method_layers(method, layers), given));
  return layers;
}

/// An option with a text that `parse` reads.
template <class T>
CLI::Option* add_parsed(CLI::App& command, const std::string& flags, T& value, Result<T> (*parse)(std::string_view),
                        const std::string& about) {
  return command
      .add_option_function<std::string>(
          flags, [&value, parse](const std::string& text) { value = parse(text).value(); }, about)
      ->check(readable(parse));
}

}  // namespace

void add_render_options(CLI::App& command, RenderOptions& options) {
  JobSpec& spec = options.spec;
  RenderSettings& settings = spec.settings;
  add_scene_options(command, options.scene);
  command.option_defaults()->group("Limits");
  command
      .add_option("--spp", spec.goal.samples, "stop at N samples per pixel (default: 64, if no other limit is given)")
      ->type_name("N")
      ->check(whole_number(1, kMaxSamples));
  add_parsed(command, "--seconds", spec.goal.seconds, parse_seconds,
             "stop after this rendering time (90, 1.5m, 2h). Each pixel gets at least one sample")
      ->type_name("T");
  add_parsed(
      command, "--error", spec.goal.error, parse_error,
      "stop when the picture's error (relMSE) is at most E with 95% confidence: 0.01 is ±10% and slightly noisy, "
      "0.001 smooth")
      ->type_name("E");
  command.add_flag("--adaptive", spec.goal.adaptive,
                   "adaptive sampling: noisy tiles get up to 4 times the samples, smooth tiles down to a quarter "
                   "(`lightmill help limits`)");
  command.option_defaults()->group("Picture");
  command.add_option("--size", options.size, "picture size in pixels, instead of the scene's")
      ->type_name("WxH")
      ->check(readable(parse_size));
  command.add_option("--crop", options.crop, "render only this part of the picture")
      ->type_name("X,Y,W,H")
      ->check(readable(parse_crop));
  command
      .add_option("--method", settings.method,
                  fmt::format("rendering method: {} (`lightmill help methods`)", method_list()))
      ->type_name("M[:PARAMETER,...]")
      ->capture_default_str();
  command.add_flag("--brute-force", options.brute_force,
                   "test every triangle for every ray, to measure what the BVH saves");
  command
      .add_option("--layers", options.layers,
                  "more layers in the EXR: direct, indirect, caustic, bias, albedo, normal, features, depth, id, "
                  "and light:NAME for a light group (`lightmill help layers`)")
      ->type_name("A,B,...");
  command
      .add_option(
          "--max-bounces", settings.max_bounces,
          "limit of scatterings of a light path (default: 1000; whitted: 128). Only dense white fog reaches the default")
      ->type_name("N")
      ->check(whole_number(1, kMaxBounces));
  command.add_option("--seed", settings.seed, "the same seed gives the same picture, bit for bit")
      ->type_name("S")
      ->check(whole_number(0, std::numeric_limits<std::uint64_t>::max()))
      ->capture_default_str();
  command.option_defaults()->group("Job");
  command.add_option("--priority", spec.priority, "jobs with a higher priority go first")
      ->type_name("P")
      ->check(signed_whole_number(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()))
      ->capture_default_str();
  add_parsed(command, "--audit", spec.audit_share, parse_share,
             "share of the results that another identity renders again, to find workers with wrong results: 1%, 0.1%, "
             "all, none (`lightmill help audits`)")
      ->type_name("SHARE")
      ->default_str("1%");
  command.add_flag(
      "--allow-mixed", spec.allow_mixed,
      "let workers of all fingerprint classes render it, even if they round differently. Then its bits cannot be "
      "reproduced");
  command.add_option("--name", spec.name, "name of the job (default: the scene's name)")->type_name("NAME");
  command
      .add_option("--owner", spec.owner,
                  "owner of the job (default: you). A farm that authenticates users takes their name instead")
      ->type_name("NAME");
  command.option_defaults()->group("Options");
}

Result<PreparedJob> make_job(const RenderOptions& options, Signals& signals) {
  PreparedJob job{options.spec, {}};
  RenderSettings& settings = job.spec.settings;
  LM_RETURN_IF_ERROR(check_name("--name", job.spec.name));
  LM_RETURN_IF_ERROR(check_name("--owner", job.spec.owner));
  LM_ASSIGN_OR_RETURN(job.spec.goal, checked_goal(job.spec.goal));
  LM_ASSIGN_OR_RETURN(const MethodSpec spec, checked_method(settings));
  LM_RETURN_IF_ERROR(with_context(check_method_error(spec.name, job.spec.goal.error), "--error"));
  LM_ASSIGN_OR_RETURN(settings.layers, make_layers(options, spec.name));
  LM_ASSIGN_OR_RETURN(job.scene, load_scene(options.scene, signals));
  LM_RETURN_IF_ERROR(with_context(check_method_media(spec.name, has_scattering_media(job.scene.scene)), "--method"));
  LM_RETURN_IF_ERROR(with_context(check_light_groups(settings.layers, light_groups_of(job.scene.scene)), "--layers"));
  FilmSettings& film = job.scene.scene.film;
  if (!options.size.empty()) {
    LM_ASSIGN_OR_RETURN(std::tie(film.width, film.height), parse_size(options.size));
  }
  LM_ASSIGN_OR_RETURN(settings.crop, checked_crop(options.crop, film.width, film.height));
  settings.scene = pack_scene(job.scene.scene);
  std::vector<Sha256> digests;
  for (const auto& [digest, bytes] : job.scene.assets) {
    digests.push_back(digest);  // from a map: sorted, without duplicates
  }
  settings.assets = std::move(digests);
  settings.width = film.width;
  settings.height = film.height;
  if (options.brute_force && !spec.brute_force) {
    settings.method += settings.method.find(':') == std::string::npos ? ":brute-force" : ",brute-force";
  }
  settings.meters = method_reads_meters(spec.name) ? static_cast<std::uint32_t>(job.scene.scene.meters.size()) : 0;
  if (const std::size_t meters = job.scene.scene.meters.size(); meters > settings.meters) {
    job.scene.notices.push_back(fmt::format("left out: the scene's {}, which method {} does not support (path does)",
                                            meters == 1 ? "meter" : fmt::format("{} meters", meters), spec.name));
  }
  const bool scatters = spec.name == "path" || spec.name == kAutoMethod;
  const std::uint32_t longest_path = settings.max_bounces > 0 ? settings.max_bounces : kDefaultBounces;
  append_notices(picture_notices(job.scene, method_needs_light(spec.name), scatters ? longest_path : 0),
                 job.scene.notices);
  settings.renderer_version = kRendererVersion;
  job.spec.request_id = new_request_id();
  const std::string& scene_name = job.scene.scene.name;
  if (job.spec.name.empty()) {
    job.spec.name = as_name(!scene_name.empty() ? scene_name : fs::path(options.scene.scenes.front()).stem().string());
  }
  if (job.spec.owner.empty()) {
    job.spec.owner = as_name(user_name());
  }
  job.spec.host = as_name(host_name());
  return job;
}

}  // namespace lightmill::cli
