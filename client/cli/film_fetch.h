// A job's film as a picture, and pictures as files.
#pragma once

#include <string>
#include <vector>

#include "client/cli/farm_connection.h"
#include "client/cli/meter_report.h"
#include "common/base/digest.h"
#include "common/image/color.h"
#include "common/image/film_picture.h"

namespace lightmill::cli {

/// The film hash (common/film/film_hash.h) of a picture's halves and counts, as fetched or as read from its file.
Hash128 film_hash_of(const FilmPicture& picture);

/// A film and the job that it belongs to.
struct FetchedFilm {
  v1::Job job;
  FilmPicture picture;
  std::vector<NamedReading> meters;
};

/// The film as it stands now, with its receipt. DATA_LOSS if the farm sends something that cannot be a film.
Result<FetchedFilm> fetch_film(FarmConnection& connection, std::uint64_t id);

/// Whether each path can become a picture: it ends in .exr or .png and its folder exists and can be written to.
Status check_outputs(const std::vector<std::string>& paths);

/// Writes the picture to every path.
Status write_outputs(const FilmPicture& picture, const std::vector<std::string>& paths, const ViewSettings& view);

}  // namespace lightmill::cli
