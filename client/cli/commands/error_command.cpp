// lightmill error IMAGE REFERENCE
#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/table.h"
#include "common/base/number_text.h"
#include "common/image/error_metrics.h"
#include "common/image/flip.h"
#include "common/image/picture_file.h"

namespace lightmill::cli {
namespace {

constexpr const char* kErrorFooter =
    "Reads EXR and PNG files. A crop in an EXR file is compared with its part of a reference of the whole frame. "
    "`lightmill help measures` explains the numbers.";

struct ErrorOptions {
  std::string image, reference;
};

struct Comparison {
  PictureError error;
  std::optional<ImageWindow> part;  ///< of the reference; none: all of it
  double flip = 0, flip_hdr = 0;
};

Result<Comparison> compare_files(const ErrorOptions& options) {
  LM_ASSIGN_OR_RETURN(const FramedPicture image, load_framed(options.image));
  LM_ASSIGN_OR_RETURN(FramedPicture reference, load_framed(options.reference));
  Comparison comparison;
  if (cut_to(image.data, image.display, reference)) {
    comparison.part = image.data;
  }
  LM_ASSIGN_OR_RETURN(comparison.error, compare_pictures(image.rgb, reference.rgb));
  LM_ASSIGN_OR_RETURN(const std::vector<float> shown, flip_map(image.rgb, reference.rgb));
  LM_ASSIGN_OR_RETURN(const std::vector<float> exposed, hdr_flip_map(image.rgb, reference.rgb));
  comparison.flip = mean_flip(shown);
  comparison.flip_hdr = mean_flip(exposed);
  return comparison;
}

/// [x, y, width, height]; null for the whole reference.
nlohmann::json part_json(const std::optional<ImageWindow>& part) {
  return part ? nlohmann::json{part->x, part->y, part->width, part->height} : nlohmann::json(nullptr);
}

bool is_png(const std::string& file) {
  return std::filesystem::path(file).extension() == ".png";
}

Result<ExitCode> show_error(const Console& console, const ErrorOptions& options) {
  const Result<Comparison> comparison = compare_files(options);
  if (!comparison.ok()) {
    return as_input_error(comparison.status());
  }
  if (is_png(options.image) != is_png(options.reference)) {
    const std::string& png = is_png(options.image) ? options.image : options.reference;
    console.notices(
        std::vector{fmt::format("{} has no values above white: where the other picture has some, they differ", png)});
  }
  if (const std::optional<ImageWindow>& part = comparison->part) {
    console.notices(
        std::vector{fmt::format("{} is a crop: it is compared with this part of the reference, {}x{} at {},{}",
                                options.image, part->width, part->height, part->x, part->y)});
  }
  const PictureError* const error = &comparison->error;
  console.object(nlohmann::json{{"image", options.image},
                                {"reference", options.reference},
                                {"rel_mse", error->rel_mse},
                                {"rel_mse_trimmed", error->rel_mse_trimmed},
                                {"energy_ratio", error->energy_ratio},
                                {"energy_ratio_rgb", error->energy_ratio_rgb},
                                {"smape", error->smape},
                                {"flip", comparison->flip},
                                {"flip_hdr", comparison->flip_hdr},
                                {"max_abs", error->max_abs},
                                {"part", part_json(comparison->part)}});
  if (error->max_abs == 0) {
    console.result("the pictures are equal: all pixels have the same values");
    return kDone;
  }
  Rows rows;
  for (const auto& [name, number, note] : {std::tuple{"relMSE", error->rel_mse, ""},
                                           {"trimmed", error->rel_mse_trimmed, "without the worst 0.1% of the pixels"},
                                           {"energy ratio", error->energy_ratio, ""},
                                           {"SMAPE", error->smape, ""},
                                           {"FLIP", comparison->flip, ""},
                                           {"HDR-FLIP", comparison->flip_hdr, "the worst of several exposures"},
                                           {"largest", error->max_abs, "the largest difference"}}) {
    rows.push_back({name, significant(number, 4), note});
  }
  print_table(console, rows);
  return kDone;
}

}  // namespace

void add_error_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<ErrorOptions>();
  CLI::App* command = app.add_subcommand("error", "Measure the error of a picture against a reference.");
  command->footer(kErrorFooter);
  command->add_option("IMAGE", options->image, "the picture")->type_name("FILE")->required();
  command->add_option("REFERENCE", options->reference, "the reference")->type_name("FILE")->required();
  add_json_option(*command, context);
  command->callback([&context, options] {
    context.run = [options](const Console& console) { return show_error(console, *options); };
  });
}

}  // namespace lightmill::cli
