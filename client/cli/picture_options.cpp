#include "client/cli/picture_options.h"

#include <algorithm>

#include "client/cli/context.h"
#include "common/image/picture_file.h"

namespace lightmill::cli {

Result<PictureOutputs> PictureOptions::checked() const {
  PictureOutputs checked{outputs, {}, denoise, png_layer};
  checked.view.exposure_stops = exposure_stops;
  checked.view.gamma = gamma;
  const Result<View> known = parse_view(view);
  LM_RETURN_IF_ERROR(with_context(known.status(), "--view"));
  checked.view.view = *known;
  if (!png_option.empty() && png_outputs().empty()) {
    return invalid_argument("{} applies only to PNG files, and none is written: add -o FILE.png", png_option);
  }
  if (!is_shown_layer(png_layer)) {
    return invalid_argument("--png-layer {}: this layer is not a picture. It is in EXR files", png_layer);
  }
  if (denoise && !png_layer.empty() && png_outputs().size() == outputs.size()) {
    return invalid_argument(
        "--denoise has no effect with --png-layer, because PNG files then show a layer: leave out one of them, or add "
        "-o FILE.exr");
  }
  LM_RETURN_IF_ERROR(check_outputs(outputs));
  return checked;
}

std::vector<std::string> PictureOptions::png_outputs() const {
  std::vector<std::string> paths;
  std::ranges::copy_if(outputs, std::back_inserter(paths), [](const std::string& path) {
    return picture_format(path).value_or(PictureFormat::exr) == PictureFormat::png;
  });
  return paths;
}

void add_picture_options(CLI::App& command, PictureOptions& options) {
  command.option_defaults()->group("Output");
  command
      .add_option("-o,--output", options.outputs,
                  "output picture, .exr (linear, with all layers and the receipt) or .png; may be repeated")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command.add_flag(
      "--denoise", options.denoise,
      "reconstruct the picture with less noise: PNG files show it, and EXR files have it beside the raw one "
      "(`lightmill help denoise`)");
  const auto note = [&options](const char* name) {
    return [&options, name](const std::string&) { options.png_option = name; };
  };
  command
      .add_option("--png-layer", options.png_layer,
                  "PNG: show this layer instead of the picture, such as albedo, normal, depth or light:NAME "
                  "(`lightmill help layers`)")
      ->type_name("LAYER")
      ->each(note("--png-layer"));
  command.add_option("--exposure", options.exposure_stops, "PNG: exposure in stops (0.5, -2)")
      ->type_name("STOPS")
      ->check(real_number(-64, 64))
      ->each(note("--exposure"));
  command
      .add_option("--view", options.view, "PNG: tone curve, plain (clipped at white) or filmic (highlights roll off)")
      ->type_name("plain|filmic")
      ->capture_default_str()
      ->each(note("--view"));
  command
      .add_option("--gamma", options.gamma,
                  "PNG: gamma; above 1 brightens dark tones (values to the power of 1/G), below 1 darkens them")
      ->type_name("G")
      ->capture_default_str()
      ->check(real_number(0.01, kMaxGamma))
      ->each(note("--gamma"));
  command.option_defaults()->group("Options");
}

}  // namespace lightmill::cli
