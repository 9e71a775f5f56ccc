#include "client/cli/film_fetch.h"

#include <unistd.h>

#include <algorithm>
#include <set>
#include <thread>

#include "client/cli/console.h"
#include "common/base/clock.h"
#include "common/base/file.h"
#include "common/film/reconstruct.h"
#include "common/image/picture_file.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

/// What to do if the layer is missing. Empty if the film has it, or if no film can have it.
std::string layer_advice(const FilmPicture& picture, const std::string& layer) {
  const bool missing = std::ranges::find(picture.layers, layer, &PictureLayer::name) == picture.layers.end();
  return missing && film_layers(std::vector{layer}).ok() ? fmt::format(". Submit the job again with --layers {}", layer)
                                                         : "";
}

Status write_output(const FilmPicture& picture, const PictureOutputs& outputs, const std::string& path) {
  LM_ASSIGN_OR_RETURN(const PictureFormat format, picture_format(path));
  const Result<std::string> bytes = encode_picture(picture, format, outputs.view, outputs.png_layer);
  return bytes.ok() ? as_output_error(write_file_atomically(path, as_byte_view(*bytes)))
                    : make_error(bytes.status().code(), "{}{}", message_of(bytes.status()),
                                 layer_advice(picture, outputs.png_layer));
}

/// Writes an EXR file to the folder for temporary files. Returns a sentence that says where it is.
std::string keep_picture(const FilmPicture& picture) {
  std::error_code error;
  fs::path folder = fs::temp_directory_path(error);
  if (error) {
    folder = "/tmp";
  }
  const std::string path = (folder / fmt::format("lightmill-{:.16}.exr", picture.receipt.film_hash)).string();
  const Status status = write_output(picture, {}, path);
  return status.ok() ? fmt::format(". The picture is kept in {}", path) : fmt::format(". {}", message_of(status));
}

}  // namespace

Result<AssembledFilm> fetch_film(CoordinatorClient& connection, std::uint64_t id) {
  std::optional<FilmAssembly> film;
  LM_RETURN_IF_ERROR(connection.get_film(id, [&](const v1::GetFilmResponse& part) -> Status {
    if (part.has_header()) {
      LM_ASSIGN_OR_RETURN(FilmAssembly begun, FilmAssembly::begin(part.header(), system_clock().unix_milliseconds()));
      film.emplace(std::move(begun));
      return ok_status();
    }
    return film ? film->add(part.tile()) : data_loss("the farm sent a tile before the film's header");
  }));
  return film ? film->finish() : data_loss("the farm sent no film for job {}", id);
}

Status denoise(FilmPicture& picture) {
  const auto features = std::ranges::find(picture.layers, kFeaturesLayer, &PictureLayer::name);
  if (features == picture.layers.end()) {
    return failed_precondition(
        "the picture cannot be denoised, because its film has no layer \"features\": render it with --denoise");
  }
  const ReconstructionInput film{picture.data.width, picture.data.height, picture.half_a,  picture.half_b,
                                 picture.samples_a,  picture.samples_b,   features->values};
  picture.denoised = reconstruct(film, {.threads = static_cast<int>(std::thread::hardware_concurrency())});
  return ok_status();
}

Status check_output(const std::string& text) {
  const fs::path path(text);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return invalid_argument("cannot write {}: there is no folder {}", text, folder.string());
  }
  if (fs::is_directory(path, error)) {
    return invalid_argument("cannot write {}: it is a folder", text);
  }
  if (const Status status = check_can_write(path); !status.ok()) {
    return invalid_argument("{}", message_of(status));
  }
  return ok_status();
}

Status check_outputs(const std::vector<std::string>& paths) {
  std::set<fs::path> given;
  for (const std::string& text : paths) {
    const fs::path path(text);
    if (!given.insert(path.lexically_normal()).second) {
      return invalid_argument("-o {} is given twice: give each output once", text);
    }
    LM_RETURN_IF_ERROR(picture_format(path).status());
    LM_RETURN_IF_ERROR(check_output(text));
  }
  return ok_status();
}

Status write_outputs(const FilmPicture& picture, const PictureOutputs& outputs) {
  Status failure;
  std::vector<std::string> written;
  for (const std::string& path : outputs.paths) {
    if (const Status status = write_output(picture, outputs, path); status.ok()) {
      written.push_back(path);
    } else {
      failure.Update(status);
    }
  }
  if (failure.ok()) {
    return ok_status();
  }
  const bool kept = std::ranges::any_of(
      written, [](const std::string& path) { return picture_format(path).value() == PictureFormat::exr; });
  return make_error(failure.code(), "{}{}{}{}", message_of(failure),
                    written.empty() ? "" : fmt::format(". Written: {}", fmt::join(written, ", ")),
                    outputs.is_only_copy && !kept ? keep_picture(picture) : "", outputs.remedy);
}

}  // namespace lightmill::cli
