// lightmill verify IMAGE SCENE
#include <nlohmann/json.hpp>
#include <random>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/film_fetch.h"
#include "client/cli/follow.h"
#include "client/cli/picture_check.h"
#include "client/cli/progress.h"
#include "client/cli/scene_options.h"
#include "client/cli/submission.h"
#include "client/cli/units.h"
#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/wire/scene_proto.h"

namespace lightmill::cli {
namespace {

constexpr const char* kVerifyFooter =
    "SCENE is the scene of the render, with the same --camera, --at, --animation, --mtl and --sky. First the file and its receipt are\n"
    "checked. Then random tiles are rendered again and compared bit for bit. `lightmill help receipts` explains what\n"
    "this finds.";

constexpr std::uint64_t kMaxSeed = (std::uint64_t{1} << 53) - 1;  ///< every reader of JSON has such numbers exactly

struct VerifyOptions {
  std::string image;
  SceneOptions scene;
  std::string share = "1%";
  std::optional<std::uint64_t> seed;
  bool local = false;
  unsigned threads = 0;
};

/// A tile to render again.
struct TileRerender {
  PixelRect rect;
  std::uint64_t job = 0;
};

std::string new_request_id(std::uint64_t seed, const PixelRect& rect, std::uint64_t nonce) {
  return sha256(fmt::format("verify {} {} {} {}", seed, rect.x, rect.y, nonce)).hex();
}

/// Everything to render again.
struct Task {
  FilmPicture picture;
  PreparedJob job;  ///< of the whole picture
  std::vector<PixelRect> tiles;
};

/// A share of tiles; at least one tile is drawn.
Result<double> parse_tiles(std::string_view text) {
  LM_ASSIGN_OR_RETURN(const double share, parse_share(text));
  return share > 0 ? Result<double>(share) : invalid_argument("the share must be more than 0%, got '{}'", text);
}

Result<Task> prepare(const VerifyOptions& options, std::uint64_t seed, Signals& signals) {
  LM_ASSIGN_OR_RETURN(const double share, parse_share(options.share));
  LM_ASSIGN_OR_RETURN(FilmPicture picture, load_sound_picture(options.image));
  Task task{std::move(picture), {}, {}};
  LM_ASSIGN_OR_RETURN(task.job.scene, load_scene(options.scene, signals));
  FilmSettings& film = task.job.scene.scene.film;
  film.width = task.picture.display.width;
  film.height = task.picture.display.height;
  std::vector<Sha256> assets;
  for (const auto& [digest, bytes] : task.job.scene.assets) {
    assets.push_back(digest);
  }
  LM_ASSIGN_OR_RETURN(task.job.spec.settings, settings_of(task.picture, pack_scene(task.job.scene.scene), assets));
  const TileGrid grid(task.job.spec.settings.crop);
  for (const TileId tile : draw_tiles(task.picture, share, seed)) {
    task.tiles.push_back(grid.tile_rect(tile));
    LM_RETURN_IF_ERROR(samples_of(task.picture, task.tiles.back()).status());
  }
  return task;
}

Result<TileRerender> submit_tile(Farm& farm, const Task& task, const PixelRect& rect, std::uint64_t seed,
                                 std::uint64_t nonce, const Console& console) {
  PreparedJob job{task.job.spec, {}};
  job.scene.assets = task.job.scene.assets;
  job.spec.settings.crop = rect;
  job.spec.settings.meters = 0;
  LM_ASSIGN_OR_RETURN(job.spec.goal.samples, samples_of(task.picture, rect));
  job.spec.audit_share = 0;
  job.spec.request_id = new_request_id(seed, rect, nonce);
  job.spec.name = as_name(fmt::format("verify {}", task.picture.receipt.name));
  job.spec.owner = "verify";
  LM_ASSIGN_OR_RETURN(const v1::Job submitted, submit_job(*farm.connection, job, console));
  return TileRerender{rect, submitted.id()};
}

/// Returns the difference, or an empty text. An error means that the comparison was not possible.
Result<std::string> compare(Farm& farm, const Task& task, const TileRerender& rerender, Signals& signals,
                            const Console& console) {
  LM_ASSIGN_OR_RETURN(const v1::Job job,
                      follow_job(farm, rerender.job, false, signals, console, [](const v1::WatchJobResponse&) {}));
  if (job.state() != v1::JOB_STATE_DONE) {
    return make_error(StatusCode::kAborted, "job {} {}: {}", rerender.job, state_name(job.state()), job.reason());
  }
  if (job.fingerprint_class() != task.picture.receipt.fingerprint_class) {
    return failed_precondition(
        "the farm's workers are of fingerprint class {}, and the picture is of {}: their bits differ although both "
        "are correct",
        job.fingerprint_class(), task.picture.receipt.fingerprint_class);
  }
  LM_ASSIGN_OR_RETURN(const AssembledFilm film, fetch_film(*farm.connection, rerender.job));
  return compare_tile(task.picture, film.picture, rerender.rect);
}

Result<ExitCode> verify(Context& context, const Console& console, const VerifyOptions& options) {
  const std::uint64_t nonce = std::uint64_t{std::random_device{}()} << 32 | std::random_device{}();
  const std::uint64_t seed = options.seed.value_or(nonce & kMaxSeed);
  LM_ASSIGN_OR_RETURN(const Task task, prepare(options, seed, context.signals));
  if (task.picture.receipt.fingerprint_class == kMixedClass) {
    return failed_precondition(
        "{}: the file is unchanged, but workers of mixed fingerprint classes rendered it (--allow-mixed), so its "
        "tiles cannot be verified",
        options.image);
  }
  LM_ASSIGN_OR_RETURN(Farm farm,
                      choose_farm(context.common, options.local, {options.threads, options.scene.unsandboxed_images},
                                  context.signals, console));
  std::vector<TileRerender> tiles;
  Status status;
  nlohmann::json wrong = nlohmann::json::array();
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < task.tiles.size() && status.ok(); ++i) {
    const Result<TileRerender> rerender = submit_tile(farm, task, task.tiles[i], seed, nonce, console);
    status = rerender.status();
    if (rerender.ok()) {
      tiles.push_back(*rerender);
    }
  }
  for (std::size_t i = 0; i < tiles.size() && status.ok(); ++i) {
    const PixelRect& rect = tiles[i].rect;
    const Result<std::string> differs = compare(farm, task, tiles[i], context.signals, console);
    status = differs.status();
    if (differs.ok() && !differs->empty()) {
      wrong.push_back({{"x", rect.x}, {"y", rect.y}, {"differs", *differs}});
      lines.push_back(fmt::format("the {}x{} pixels at {}, {}: {}", rect.width, rect.height, rect.x, rect.y, *differs));
    }
  }
  for (const TileRerender& rerender : tiles) {  // a local farm's jobs end with it
    if (!farm.local_farm) {
      (void)farm.connection->delete_job(rerender.job, true);
    }
  }
  if (!status.ok()) {
    return console.fail(status);
  }
  const std::uint32_t all = TileGrid(task.job.spec.settings.crop).picture_tiles();
  nlohmann::json object{{"image", options.image}, {"film_hash", task.picture.receipt.film_hash},
                        {"tiles", all},           {"verified", tiles.size()},
                        {"wrong", wrong},         {"seed", seed}};
  if (!lines.empty()) {
    // A picture of an unfinished job may lack some of its earlier samples. No job can render exactly the remaining
    // samples again.
    const char* const why = task.picture.receipt.ended.empty()
                                ? ". The picture was fetched before its job had ended, which may be the reason: "
                                  "fetch it again"
                                : "";
    return console.fail(data_loss("{}: a new render differs in {} of {}: {}{}", options.image, lines.size(),
                                  counted(tiles.size(), "tile"), fmt::join(lines, "; "), why),
                        object);
  }
  console.object(object);
  console.result(fmt::format("{}: the file is unchanged. {} of {}: rendered again, same bits (--seed {})",
                             options.image, tiles.size(), counted(all, "tile"), seed));
  return kDone;
}

}  // namespace

void add_verify_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<VerifyOptions>();
  CLI::App* command =
      app.add_subcommand("verify", "Check a picture against its receipt, by rendering parts of it again.");
  command->footer(kVerifyFooter);
  command->add_option("IMAGE", options->image, "an EXR that Lightmill wrote")->type_name("FILE")->required();
  add_scene_options(*command, options->scene);
  command
      ->add_option("--share", options->share,
                   "share of the picture's tiles (64x64 pixels) to render again, at least one tile: 1%, all")
      ->type_name("SHARE")
      ->check(readable(parse_tiles))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "seed of the choice of tiles (default: random)")
      ->type_name("S")
      ->check(whole_number(0, kMaxSeed));
  add_local_farm_options(*command, options->local, options->threads);
  add_common_options(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return verify(context, console, *options); };
  });
}

}  // namespace lightmill::cli
