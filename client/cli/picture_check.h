// Checks of a picture against its receipt: the file alone, and parts of it rendered again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/image/film_picture.h"

namespace lightmill::cli {

/// Reads a picture from an EXR of Lightmill. INVALID_ARGUMENT if it is another file. DATA_LOSS, with the difference, if
/// the file is truncated or damaged, or if a pixel or an attribute was changed. It compares the file's form
/// (check_exr_form), its checksum (file_checksum), the film hash and the counts.
Result<FilmPicture> load_sound_picture(const std::string& path);

/// The settings with which the picture was rendered, if it is of `scene` (packed by pack_scene) and these assets.
/// DATA_LOSS if scene or assets differ, or if the receipt contradicts itself: its render digest does not
/// match its fields.
Result<RenderSettings> settings_of(const FilmPicture& picture, const std::string& scene,
                                   const std::vector<Sha256>& assets);

/// A random `share` (0 to 1) of the picture's tiles, at least one, drawn by `seed`. Every set is equally likely.
/// Ascending.
std::vector<TileId> draw_tiles(const FilmPicture& picture, double share, std::uint64_t seed);

/// The samples per pixel of a tile. FAILED_PRECONDITION unless all its pixels have samples [0, n) for one n > 0. A job
/// that had not ended may have gaps.
Result<std::uint64_t> samples_of(const FilmPicture& picture, const PixelRect& rect);

/// Compares all channels of `again`, which covers `rect` alone, with the picture, bit for bit. Returns the difference,
/// or an empty text.
std::string compare_tile(const FilmPicture& picture, const FilmPicture& again, const PixelRect& rect);

}  // namespace lightmill::cli
