// A job's film as a picture, and pictures as files.
#pragma once

#include <string>
#include <vector>

#include "client/cli/coordinator_client.h"
#include "common/image/color.h"
#include "common/wire/film_assembly.h"

namespace lightmill::cli {

/// The film as it is now, with its receipt. DATA_LOSS if what the farm sends cannot be a film.
Result<AssembledFilm> fetch_film(CoordinatorClient& connection, std::uint64_t id);

/// The files of a job's picture, and its processing.
struct PictureOutputs {
  std::vector<std::string> paths;
  ViewSettings view = {};      ///< of PNG files
  bool denoise = false;        ///< add the reconstructed picture
  std::string png_layer = {};  ///< the layer that PNG files show; empty: the picture
  /// The farm ends with the command. So if no EXR file can be written, one is written to the folder for temporary files.
  bool is_only_copy = false;
  std::string remedy = {};  ///< end of the error if a file cannot be written
};

/// Adds the reconstructed picture (common/film/reconstruct.h). FAILED_PRECONDITION if the film has no layer `features`.
Status denoise(FilmPicture& picture);

/// INVALID_ARGUMENT unless the file can be written.
Status check_output(const std::string& path);

/// The same for pictures: each path ends in .exr or .png, and is given once.
Status check_outputs(const std::vector<std::string>& paths);

/// Writes the picture to every path, also after an error. The error says which files are written. INVALID_ARGUMENT if
/// the picture does not have the layer of PNG files.
Status write_outputs(const FilmPicture& picture, const PictureOutputs& outputs);

}  // namespace lightmill::cli
