// Reconstruction of a film's picture: less noise from the same samples, at the price of bias that is not estimated.
//
// Feature regression in the manner of NFOR (Bitterli et al. 2016, "Nonlinearly Weighted First-order Regression for
// Denoising Monte Carlo Renderings"). Around every second pixel of every second row, linear models of albedo, normal
// and 1/depth are fitted to each half. The weights of one half are the similarity of pixels in the other half. A pixel
// is the weighted mean of what the models around it predict. Then it is mixed with its raw mean (raw_mix.h).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace lightmill {

/// Albedo, normal and 1/depth of the first surfaces, and their squared lengths, by half.
inline constexpr std::string_view kFeaturesLayer = "features";

/// Planes of a film as in its EXR: `[channel][pixel]`, rows from the top.
struct ReconstructionInput {
  int width = 0, height = 0;
  std::span<const float> half_a, half_b;                ///< means of beauty
  std::span<const std::uint32_t> samples_a, samples_b;  ///< per pixel
  std::span<const float> features;                      ///< the layer `features`
};

struct ReconstructionSettings {
  /// Tolerance of the similarity, in standard deviations of the noise. With a very large one, all pixels are alike.
  float tolerance = 0.5f;
  int threads = 1;  ///< do not affect the bits
};

/// Planar R, G, B. Pixels with a value that is not finite, or without samples in both halves, have no effect on others
/// and keep their mean (0 if it is not finite). Takes about 110 bytes a pixel, and 0.5 MiB and 600 bytes a column for
/// each thread.
std::vector<float> reconstruct(const ReconstructionInput& film, const ReconstructionSettings& settings = {});
/// The same without the mix.
std::vector<float> regress(const ReconstructionInput& film, const ReconstructionSettings& settings = {});

}  // namespace lightmill
