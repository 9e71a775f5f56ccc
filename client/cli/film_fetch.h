// A job's film as a picture, and pictures as files.
#pragma once

#include <string>
#include <vector>

#include "client/cli/farm_connection.h"
#include "common/image/color.h"
#include "common/wire/film_assembly.h"

namespace lightmill::cli {

/// The film as it stands now, with its receipt. DATA_LOSS if the farm sends something that cannot be a film.
Result<AssembledFilm> fetch_film(FarmConnection& connection, std::uint64_t id);

/// Whether each path can become a picture: it ends in .exr or .png and its folder exists and can be written to.
Status check_outputs(const std::vector<std::string>& paths);

/// Writes the picture to every path.
Status write_outputs(const FilmPicture& picture, const std::vector<std::string>& paths, const ViewSettings& view);

}  // namespace lightmill::cli
