// Assembly of a film from the messages of GetFilm: the picture with its receipt, and the readings of its meters.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "common/film/layers.h"
#include "common/film/tile_grid.h"
#include "common/image/film_picture.h"
#include "common/scene/meter_reading.h"
#include "lightmill/v1/farm.pb.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill {

/// A meter of the scene and its reading.
struct NamedReading {
  Meter meter;
  MeterReading reading;
};

/// A film and its job.
struct AssembledFilm {
  v1::Job job;
  FilmPicture picture;
  std::vector<NamedReading> meters;
};

/// The film hash (common/film/film_hash.h) of a picture's halves and counts, as assembled or as read from its file.
Hash128 film_hash_of(const FilmPicture& picture);

/// Takes the header, then every tile, then gives the film. Not thread-safe. DATA_LOSS for messages that cannot be a
/// film.
class FilmAssembly {
 public:
  /// `now_unix_ms` is the picture's date if the job has not ended.
  static Result<FilmAssembly> begin(const v1::FilmHeader& header, std::int64_t now_unix_ms);
  Status add(const v1::FilmTile& tile);
  /// Call once. An error if no tile came.
  Result<AssembledFilm> finish();

 private:
  FilmAssembly(AssembledFilm film, NodeLayout layout) : film_(std::move(film)), layout_(layout) {}
  Status add_meter(std::uint32_t meter, const v1::FilmTile& tile, std::span<const float> sums);

  AssembledFilm film_;
  NodeLayout layout_;
  PictureIds ids_;
  std::uint64_t least_ = std::numeric_limits<std::uint64_t>::max(), most_ = 0;
};

/// The readings as JSON: [{"name", "quantity", "value", "half_width", "unit", "photometric", "photometric_half_width",
/// "photometric_unit", "rgb", "samples"}]. Numbers are null if there are no samples. Half widths have 95 % confidence.
nlohmann::json to_json(const std::vector<NamedReading>& readings);

}  // namespace lightmill
