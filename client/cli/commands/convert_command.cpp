// lightmill convert FILE
#include <filesystem>

#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/film_fetch.h"
#include "client/cli/picture_options.h"
#include "common/base/file.h"
#include "common/image/exr.h"
#include "common/image/picture_file.h"

namespace lightmill::cli {
namespace {

constexpr const char* kConvertMore =
    "Needs no farm. The picture is that of `lightmill fetch` with the same options. --png-layer and --denoise need an EXR "
    "file that has these layers (`lightmill help layers`, `lightmill help denoise`).\n"
    "Of EXR files by other programs, it shows the channels R, G and B, or Y. So it does with files of Lightmill that another program "
    "has saved.";

struct ConvertOptions {
  std::string input;
  PictureOptions picture;
};

/// The picture of a file that another program has saved. It has no layers and no receipt.
Result<FilmPicture> foreign_picture(const Image& image, const ConvertOptions& options) {
  const std::vector<std::string> png = options.picture.png_outputs();
  if (png.size() < options.picture.outputs.size() || options.picture.denoise || !options.picture.png_layer.empty()) {
    return invalid_argument(
        "another program has saved it, so only its R, G and B can be made a PNG file: leave out -o FILE.exr, --denoise and "
        "--png-layer");
  }
  LM_ASSIGN_OR_RETURN(const FramedPicture framed, framed_picture(image));
  FilmPicture picture(framed.display, framed.data);
  picture.beauty = framed.rgb.values;
  return picture;
}

Result<FilmPicture> read_picture(ByteView bytes, const ConvertOptions& options, const Console& console) {
  if (!is_exr(bytes)) {
    return invalid_argument("this is not an EXR file: give an .exr file");
  }
  LM_ASSIGN_OR_RETURN(const Image image, decode_exr(bytes));
  if (image.text(kFileChecksum).empty()) {
    return foreign_picture(image, options);
  }
  Result<FilmPicture> own = from_image(image);
  if (own.ok()) {
    return own;
  }
  LM_ASSIGN_OR_RETURN(FilmPicture picture, foreign_picture(image, options));
  console.notice(fmt::format("{}: {}. Only its R, G and B are shown", options.input, message_of(own.status())));
  return picture;
}

Result<ExitCode> convert(const Console& console, const ConvertOptions& options) {
  LM_ASSIGN_OR_RETURN(const PictureOutputs outputs, options.picture.checked());
  for (const std::string& path : outputs.paths) {
    std::error_code error;
    if (std::filesystem::equivalent(options.input, path, error)) {
      return as_input_error(invalid_argument("{}: this is the file to convert. Give the picture another name", path));
    }
  }
  LM_ASSIGN_OR_RETURN(const std::string bytes, read_file(options.input));
  Result<FilmPicture> picture = with_context(read_picture(as_byte_view(bytes), options, console), options.input);
  if (!picture.ok()) {
    return as_input_error(picture.status());
  }
  if (!outputs.denoise) {
    picture->denoised.clear();
  } else if (picture->denoised.empty()) {
    LM_RETURN_IF_ERROR(denoise(*picture));
  }
  LM_RETURN_IF_ERROR(write_outputs(*picture, outputs));
  console.object({{"input", options.input}, {"outputs", outputs.paths}, {"denoised", outputs.denoise}});
  console.result(fmt::format("{} -> {}", options.input, fmt::join(outputs.paths, ", ")));
  return kDone;
}

}  // namespace

void add_convert_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<ConvertOptions>();
  CLI::App* command = app.add_subcommand("convert", "Make PNG files of an EXR file, or denoise it.");
  command->footer(kConvertMore);
  command->add_option("FILE", options->input, "the EXR file")->type_name("FILE")->required();
  add_picture_options(*command, options->picture);
  command->get_option("--output")->required();
  add_json_option(*command, context);
  command->callback(
      [&context, options] { context.run = [options](const Console& console) { return convert(console, *options); }; });
}

}  // namespace lightmill::cli
