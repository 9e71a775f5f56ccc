// Whether a picture is what its receipt says: what the file alone shows, and what rendering parts of it again shows.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/image/film_picture.h"

namespace lightmill::cli {

/// A picture read from an EXR of Lightmill's. INVALID_ARGUMENT if it is none; DATA_LOSS, saying what differs, if the
/// file is truncated or damaged, or if a pixel or an attribute is not what it was when the file was written: the file's
/// form (check_exr_form), its checksum (file_checksum), the film hash and the counts are compared.
Result<FilmPicture> load_sound_picture(const std::string& path);

/// The settings that the picture was rendered with, as far as it is made of `scene` (packed by pack_scene) and these
/// assets. INVALID_ARGUMENT if it is not: another scene, another asset. DATA_LOSS if the receipt contradicts itself:
/// its render digest is not that of what it says.
Result<RenderSettings> settings_of(const FilmPicture& picture, const std::string& scene,
                                   const std::vector<Sha256>& assets);

/// `share` (0 to 1) of the picture's tiles, at least one, drawn by `seed`: each set as likely as any other. Ascending.
std::vector<TileId> draw_tiles(const FilmPicture& picture, double share, std::uint64_t seed);

/// The samples per pixel of a tile. FAILED_PRECONDITION unless all of its pixels have samples [0, n) for one n > 0: of
/// a job that had not ended yet they may have gaps.
Result<std::uint64_t> samples_of(const FilmPicture& picture, const PixelRect& rect);

/// Compares all channels of `again`, which covers `rect` alone, with the picture's, bit for bit. Empty, or what
/// differs.
std::string compare_tile(const FilmPicture& picture, const FilmPicture& again, const PixelRect& rect);

}  // namespace lightmill::cli
