// The picture of a film with its receipt, and its form as an EXR file.
//
// Channels: `R G B` (mean of all samples), `A.R A.G A.B` and `B.R B.G B.B` (means of the two independent halves),
// `StdErr.R StdErr.G StdErr.B` (standard error of the mean, smoothed), `samples`, `A.samples` and `B.samples` (per
// pixel), and those of the other layers (picture_layers.h). All float32 or uint32, compressed without loss. The receipt
// stands in attributes named `lightmill.*`.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/image/image.h"
#include "common/image/picture_layers.h"

namespace lightmill {

/// What a picture says about how it was made; digests as hex.
struct Receipt {
  std::string render_digest, scene_digest;
  std::vector<std::string> asset_digests;
  std::string film_hash;  ///< of the stored halves and counts: see common/film/film_hash.h
  std::string renderer_version, fingerprint_class;
  std::string method;
  std::vector<std::string> method_reasons, notices;  ///< why it was chosen, if it was; what of the light is missing
  std::uint32_t max_bounces = 0;                     ///< 0: the method's own limit, and no attribute
  std::uint64_t seed = 0;
  std::uint64_t job = 0;
  std::string name, owner, host;
  std::uint64_t min_samples = 0, max_samples = 0;  ///< per pixel, over tiles
  double rel_mse = -1, rel_mse_half_width = -1;    ///< negative: not known
  std::string ended;                               ///< what ended it: which limit is reached; empty before
  double seconds = 0;                              ///< during which it was being rendered
  double worker_seconds = 0;                       ///< sum of the workers' thread seconds
  std::vector<std::string> meter_hashes;           ///< of the virtual meters' tiles: see common/film/film_hash.h
  std::string capture_date;                        ///< "YYYY:MM:DD HH:MM:SS", local time, as OpenEXR's capDate wants it
};

/// Planar RGB means over the data window: `values[channel * pixels + pixel]`.
struct FilmPicture {
  ImageWindow display, data;
  std::vector<float> beauty, half_a, half_b;
  std::vector<std::uint32_t> samples_a, samples_b;   ///< per pixel
  std::vector<PictureLayer> layers;                  ///< in the film's order
  std::map<std::string, ImageAttribute> attributes;  ///< of the EXR, besides those of the receipt
  Receipt receipt;

  /// Black, with no samples.
  FilmPicture(ImageWindow display, ImageWindow data);
  std::size_t pixels() const { return samples_a.size(); }
};

/// Puts a tile's sums into the picture. `sums[(half * channels + channel) * tile pixels + pixel]`, half A over
/// `count_a` samples and half B over `count_b`; the channels are beauty's, then those of each mean layer. `rect` lies
/// within the data window.
void place_sums(FilmPicture& picture, const ImageWindow& rect, std::uint64_t count_a, std::uint64_t count_b,
                std::span<const float> sums);

/// How many channels that are.
std::size_t summed_channels(const FilmPicture& picture);

/// Radius of the window over which the variance is averaged, pixels.
inline constexpr int kErrorSmoothingRadius = 4;

/// The standard error of every beauty value, planar. With means a, b of n_a, n_b independent samples, (a−b)² n_a n_b /
/// n² is an unbiased estimate of the variance of their common mean ((a−b)²/4 for equal halves); it has one degree of
/// freedom, so it is averaged over the (2r+1)² pixels around, as far as they lie in the window and have both halves.
/// Zero where none has.
std::vector<float> smoothed_standard_error(const FilmPicture& picture);

/// The attribute of an EXR that holds its file_checksum.
inline constexpr const char* kFileChecksum = "lightmill.fileChecksum";

/// SHA-256, as hex, over the windows, the channels by name and the attributes by name, but for the checksum itself and
/// what OpenEXR adds: it shows whether a file still holds what was written. Whoever changes a file can also change
/// this; against them, parts of the picture are rendered again.
std::string file_checksum(const Image& image);

/// The picture's EXR form, and back (what is not there stays empty or zero). from_image fails if a channel of the film
/// is missing.
Image to_image(const FilmPicture& picture);
Result<FilmPicture> from_image(const Image& image);

/// The beauty of the data window.
RgbImage cropped_frame(const FilmPicture& picture);

}  // namespace lightmill
