// Picture of a film with its receipt, and its form as an EXR file.
//
// Channels, all float32 or uint32 with lossless compression:
//   R, G, B                           mean of all samples
//   A.R … A.B, B.R … B.B              means of the two independent halves
//   StdErr.R … StdErr.B               standard error of the mean, smoothed
//   samples, A.samples, B.samples     per pixel
//   channels of other layers          picture_layers.h
//   Denoised.R … Denoised.B           if the picture was reconstructed
// The receipt is in attributes named `lightmill.*`.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/image/image.h"
#include "common/image/picture_layers.h"

namespace lightmill {

/// Receipt: how a picture was made. Digests are hex.
struct Receipt {
  std::string render_digest, scene_digest;
  std::vector<std::string> asset_digests;
  std::string film_hash;  ///< of the stored halves and counts; see common/film/film_hash.h
  std::string renderer_version, fingerprint_class;
  std::string method;
  std::vector<std::string> method_reasons, notices;  ///< why the method was chosen, if it was; what light is missing
  std::uint32_t max_bounces = 0;                     ///< 0: the method's own limit, and no attribute
  std::uint64_t seed = 0;
  std::uint64_t job = 0;
  std::string name, owner, host;
  std::uint64_t min_samples = 0, max_samples = 0;  ///< per pixel, over tiles
  double rel_mse = -1, rel_mse_half_width = -1;    ///< negative: unknown
  std::string ended;                               ///< the limit that ended the job; empty before
  double seconds = 0;                              ///< time during which it was rendered
  double worker_seconds = 0;                       ///< sum of the workers' thread seconds
  std::vector<std::string> meter_hashes;           ///< of the virtual meters' tiles; see common/film/film_hash.h
  std::string capture_date;                        ///< "YYYY:MM:DD HH:MM:SS", local time, as in OpenEXR's capDate
};

/// Planar RGB means over the data window: `values[channel * pixels + pixel]`.
struct FilmPicture {
  ImageWindow display, data;
  std::vector<float> beauty, half_a, half_b;
  std::vector<std::uint32_t> samples_a, samples_b;   ///< per pixel
  std::vector<PictureLayer> layers;                  ///< in the film's order
  std::vector<float> denoised;                       ///< the reconstructed picture; empty without
  std::map<std::string, ImageAttribute> attributes;  ///< of the EXR, without the receipt's
  Receipt receipt;

  /// A black picture without samples.
  FilmPicture(ImageWindow display, ImageWindow data);
  std::size_t pixels() const { return samples_a.size(); }
};

/// Stores a tile's sums in the picture. `sums[(half * channels + channel) * tile pixels + pixel]`, with half A over
/// `count_a` samples and half B over `count_b`. The channels are beauty's, then those of each mean layer. `rect` must
/// lie within the data window.
void place_sums(FilmPicture& picture, const ImageWindow& rect, std::uint64_t count_a, std::uint64_t count_b,
                std::span<const float> sums);

/// Number of these channels.
std::size_t summed_channels(const FilmPicture& picture);

/// Radius of the window over which the variance is averaged, in pixels.
inline constexpr int kErrorSmoothingRadius = 4;

/// The standard error of every beauty value, planar. For means a, b of n_a, n_b independent samples, (a−b)² n_a n_b /
/// n² is an unbiased estimate of the variance of their common mean ((a−b)²/4 for equal halves). It has one degree of
/// freedom, so it is averaged over the (2r+1)² pixels around. Only pixels in the window with both halves count. Zero if
/// there are none.
std::vector<float> smoothed_standard_error(const FilmPicture& picture);

/// EXR attribute with the file's file_checksum.
inline constexpr const char* kFileChecksum = "lightmill.fileChecksum";

/// SHA-256, as hex, over the windows, the channels by name and the attributes by name, without the checksum itself and
/// OpenEXR's own attributes. It detects damage. A forger can also change the checksum. To detect forgery, parts of the
/// picture must be rendered again.
std::string file_checksum(const Image& image);

/// The picture as an EXR image, and back. Missing parts stay empty or zero. from_image fails if a channel of the film
/// is missing.
Image to_image(const FilmPicture& picture);
Result<FilmPicture> from_image(const Image& image);

/// The beauty of the data window.
RgbImage cropped_frame(const FilmPicture& picture);

/// The reconstructed picture, if there is one, else beauty.
RgbImage shown_frame(const FilmPicture& picture);

/// A layer as linear RGB for the plain view. Colours are the layer's own. Components of normals from -1 to 1 are shown
/// as bytes from 0 to 255. Depth is the smallest depth divided by the pixel's: near is bright. INVALID_ARGUMENT if the
/// picture does not have the layer, or it cannot be shown (`features`, `id`). The message names those that can.
Result<RgbImage> layer_frame(const FilmPicture& picture, std::string_view layer);

}  // namespace lightmill
