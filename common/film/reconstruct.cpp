#include "common/film/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include "common/base/check.h"
#include "common/film/raw_mix.h"
#include "common/film/reconstruction_planes.h"
#include "common/math/exp_log.h"

namespace lightmill {
namespace {

constexpr int kRadius = 7;  ///< of the window around a model's center
constexpr int kPatch = 2;   ///< radius of the patches whose similarity weighs a pixel
constexpr int kSide = 2 * kRadius + 1;
constexpr int kOffsets = kSide * kSide;  ///< pixels of a window
constexpr int kTerms = kFeatures + 1;    ///< of a model: its value at the center, and slopes
constexpr float kMinWeight = 1e-3f;      ///< smaller ones count as 0
constexpr float kOwnWeight = 0.3f;       ///< of a pixel's mean, beside the models
constexpr float kRidge = 2e-3f;          ///< variance that every feature has at least
constexpr float kDarkness = 0.02f;       ///< noise below this part of the picture's brightness is not resolved
constexpr float kInverseDepthScale = 4;  ///< makes changes of 1/depth comparable with those of normals

static_assert(kPad % 2 == 0 && kPad >= kRadius + kPatch);

/// Weighted normal equations of eight centers: the lower triangle of the matrix, and a column for each color.
struct Equations {
  F8 matrix[kTerms * (kTerms + 1) / 2];
  F8 right[kTerms][3];

  void add(F8 weight, const F8 (&z)[kTerms], const F8 (&color)[3]) {
    F8* entry = matrix;
    for (int i = 0; i < kTerms; ++i) {
      const F8 wz = weight * z[i];
      for (int j = 0; j <= i; ++j, ++entry) {
        *entry += wz * z[j];
      }
      for (int c = 0; c < 3; ++c) {
        right[i][c] += wz * color[c];
      }
    }
  }

  /// Replaces `right` by the solution. LDLᵀ decomposition; `noise` is added to the variance of each feature.
  void solve(const F8 (&noise)[kTerms]) {
    const auto at = [&](int i, int j) -> F8& { return matrix[i * (i + 1) / 2 + j]; };
    const F8 total = max(at(0, 0), F8(1e-6f));
    at(0, 0) = total;
    F8 pivot[kTerms];
    for (int j = 0; j < kTerms; ++j) {
      F8 scaled[kTerms];  // L · D of row j
      const F8 floor = j == 0 ? total : total * (F8(kRidge) + noise[j]);
      F8 d = j == 0 ? total : at(j, j) + floor;
      for (int k = 0; k < j; ++k) {
        scaled[k] = at(j, k) * pivot[k];
        d = d - at(j, k) * scaled[k];
      }
      pivot[j] = max(d, floor * F8(0.5f));  // rounding can make it smaller
      const F8 inverse = F8(1.0f) / pivot[j];
      for (int i = j + 1; i < kTerms; ++i) {
        F8 sum = at(i, j);
        for (int k = 0; k < j; ++k) {
          sum = sum - at(i, k) * scaled[k];
        }
        at(i, j) = sum * inverse;
      }
    }
    for (int c = 0; c < 3; ++c) {
      for (int i = 0; i < kTerms; ++i) {
        for (int k = 0; k < i; ++k) {
          right[i][c] = right[i][c] - at(i, k) * right[k][c];
        }
      }
      for (int i = kTerms - 1; i >= 0; --i) {
        right[i][c] = right[i][c] / pivot[i];
        for (int k = i + 1; k < kTerms; ++k) {
          right[i][c] = right[i][c] - at(k, i) * right[k][c];
        }
      }
    }
  }
};

/// Predictions for the pixels around one row of blocks: sums of weighted colors, and of the weights.
struct Band {
  PaddedPlaces places;
  std::array<PaddedPlane, 4> sums;

  explicit Band(int width) : places(width, 2 * kCenterRows) {}
  void clear() {
    for (PaddedPlane& plane : sums) {
      plane.assign(places.size(), 0.0f);
    }
  }
};

/// Fits and evaluates the models of one block of centers at a time. One for each thread.
class BlockFilter {
 public:
  BlockFilter(const ReconstructionPlanes& planes, float tolerance, int width)
      : planes_(planes),
        tolerance_(F8(tolerance) * F8(tolerance)),
        least_noise_(std::max(kDarkness * planes.brightness * (kDarkness * planes.brightness), 1e-30f)),
        band_(width),
        weights_(std::size_t{2} * kOffsets * kCenterRows * kCenterColumns) {}

  /// Fills the band of the block row whose first pixel row is `y`.
  const Band& filter(int y, int width) {
    band_.clear();
    for (int x = 0; x < width; x += 2 * kCenterColumns) {
      for (int offset = 0; offset < kOffsets; ++offset) {
        weigh(x, y, offset);
      }
      for (int row = 0; row < kCenterRows; ++row) {
        for (int column = 0; column < kCenterColumns && x + 2 * column < width; column += 8) {
          fit(x, y, row, column);
        }
      }
    }
    return band_;
  }

 private:
  static int dx(int offset) { return offset % kSide - kRadius; }
  static int dy(int offset) { return offset / kSide - kRadius; }
  float* weight(int half, int offset, int row, int column) {
    return &weights_[static_cast<std::size_t>(((half * kOffsets + offset) * kCenterRows + row) * kCenterColumns +
                                              column)];
  }

  /// The weights of one offset for all centers of the block at (x, y).
  void weigh(int x, int y, int offset) {
    constexpr int kRows = 2 * kCenterRows + 2 * kPatch, kColumns = kCenterColumns + 8;
    float distance[2][kRows][2][kColumns];  // [half][row][parity][column], from column x − 2 on
    const PaddedPlaces& places = planes_.places;
    const float* const variance = planes_.variance.data();
    for (int row = 0; row < kRows; ++row) {
      for (int parity = 0; parity < 2; ++parity) {
        const std::size_t p = places.at(x - kPatch + parity, y - kPatch + row);
        const std::size_t q = places.at(x - kPatch + parity + dx(offset), y - kPatch + row + dy(offset));
        for (std::size_t k = 0; k < kColumns; k += 8) {
          const F8 vp = F8::load(variance + p + k), vq = F8::load(variance + q + k);
          const F8 expected = vp + min(vp, vq);
          const F8 inverse = F8(1.0f) / (least_noise_ + tolerance_ * (vp + vq));
          for (int half = 0; half < 2; ++half) {
            F8 squares = F8(0.0f);
            for (const PaddedPlane& plane : planes_.halves[half]) {
              const F8 difference = F8::load(&plane[p + k]) - F8::load(&plane[q + k]);
              squares += difference * difference;
            }
            ((squares - expected) * inverse).store(&distance[half][row][parity][k]);
          }
        }
      }
    }
    const float* const known = &planes_.known[places.at(x + dx(offset), y + dy(offset))];
    for (int half = 0; half < 2; ++half) {
      for (int row = 0; row < kCenterRows; ++row) {
        float columns[2][kColumns];
        for (int parity = 0; parity < 2; ++parity) {
          for (std::size_t k = 0; k < kColumns; k += 8) {
            F8 sum = F8(0.0f);
            for (int v = 0; v <= 2 * kPatch; ++v) {
              sum += F8::load(&distance[half][2 * row + v][parity][k]);
            }
            sum.store(&columns[parity][k]);
          }
        }
        for (int column = 0; column < kCenterColumns; column += 8) {
          const float *even = &columns[0][column], *odd = &columns[1][column];
          const F8 sum =
              (F8::load(even) + F8::load(even + 1) + F8::load(even + 2)) + (F8::load(odd) + F8::load(odd + 1));
          constexpr float kPatchPixels = (2 * kPatch + 1) * (2 * kPatch + 1);
          const F8 similar = exp(min(F8(0.0f) - sum * F8(1 / kPatchPixels), F8(0.0f)));
          const F8 at = F8::load(known + 2 * static_cast<std::size_t>(row) * places.stride + column);
          // One half's weights come from the other half, so that noise does not choose them.
          masked(similar >= F8(kMinWeight), similar * at).store(weight(1 - half, offset, row, column));
        }
      }
    }
  }

  /// Features of the pixels at q relative to their centers at p.
  void features_at(std::size_t p, std::size_t q, F8 scale, F8 (&z)[kTerms]) const {
    z[0] = F8(1.0f);
    for (int f = 0; f < kFeatures; ++f) {
      z[f + 1] = F8::load(&planes_.features[f][q]) - F8::load(&planes_.features[f][p]);
    }
    z[kFeatures] *= scale;
  }

  /// Fits the models of eight centers to each half, and adds what they predict.
  void fit(int x, int y, int row, int column) {
    const PaddedPlaces& places = planes_.places;
    const int cx = x + 2 * column, cy = y + 2 * row;
    const std::size_t p = places.at(cx, cy);
    const F8 is_center = F8::load(&planes_.known[p]);
    const F8 inverse_depth = F8::load(&planes_.features[kFeatures - 1][p]);
    const F8 scale = F8(kInverseDepthScale) / max(inverse_depth, F8(1e-6f));
    F8 noise[kTerms];
    for (int f = 0; f < kFeatures; ++f) {
      noise[f + 1] = F8::load(&planes_.feature_noise[f / 3][p]);
    }
    noise[kFeatures] *= scale * scale;
    Equations equations[2]{};
    for (int offset = 0; offset < kOffsets; ++offset) {
      const F8 w[2] = {F8::load(weight(0, offset, row, column)), F8::load(weight(1, offset, row, column))};
      if (((w[0] + w[1]) > F8(0.0f)).none()) {
        continue;
      }
      const std::size_t q = places.at(cx + dx(offset), cy + dy(offset));
      F8 z[kTerms];
      features_at(p, q, scale, z);
      for (int half = 0; half < 2; ++half) {
        const auto& planes = planes_.halves[half];
        const F8 color[3] = {F8::load(&planes[0][q]), F8::load(&planes[1][q]), F8::load(&planes[2][q])};
        equations[half].add(w[half], z, color);
      }
    }
    equations[0].solve(noise);
    equations[1].solve(noise);
    for (int offset = 0; offset < kOffsets; ++offset) {
      const F8 w[2] = {F8::load(weight(0, offset, row, column)) * is_center,
                       F8::load(weight(1, offset, row, column)) * is_center};
      const F8 total = w[0] + w[1];
      if ((total > F8(0.0f)).none()) {
        continue;
      }
      const std::size_t q = places.at(cx + dx(offset), cy + dy(offset));
      const std::size_t to = band_.places.at(cx + dx(offset), 2 * row + dy(offset));
      F8 z[kTerms];
      features_at(p, q, scale, z);
      for (int c = 0; c < 3; ++c) {
        F8 sum = F8::load(&band_.sums[c][to]);
        for (int half = 0; half < 2; ++half) {
          F8 value = equations[half].right[0][c];
          for (int term = 1; term < kTerms; ++term) {
            value += equations[half].right[term][c] * z[term];
          }
          sum += w[half] * value;
        }
        sum.store(&band_.sums[c][to]);
      }
      (F8::load(&band_.sums[3][to]) + total).store(&band_.sums[3][to]);
    }
  }

  const ReconstructionPlanes& planes_;
  F8 tolerance_, least_noise_;
  Band band_;
  PaddedPlane weights_;  ///< [half][offset][row][column]
};

/// The predictions, and the brightness of the picture.
std::pair<std::vector<float>, float> predictions(const ReconstructionInput& film,
                                                 const ReconstructionSettings& settings) {
  const auto pixels = static_cast<std::size_t>(film.width) * static_cast<std::size_t>(film.height);
  LM_CHECK(film.width > 0 && film.height > 0 && film.half_a.size() == 3 * pixels && film.half_b.size() == 3 * pixels &&
           film.samples_a.size() == pixels && film.samples_b.size() == pixels &&
           film.features.size() == 2 * kFeaturePlanes * pixels);
  const ReconstructionPlanes planes(film);
  const PaddedPlaces& places = planes.places;
  std::array<PaddedPlane, 4> sums;
  for (PaddedPlane& plane : sums) {
    plane.resize(places.size());
  }
  // Bands overlap. They are added in their order, so that threads do not affect the bits.
  std::vector<BlockFilter> filters(static_cast<std::size_t>(std::max(settings.threads, 1)),
                                   BlockFilter(planes, settings.tolerance, film.width));
  constexpr int kBandRows = 2 * kCenterRows;
  for (int first = 0; first < film.height; first += kBandRows * static_cast<int>(filters.size())) {
    std::vector<const Band*> bands(filters.size());
    {
      std::vector<std::jthread> threads;
      for (std::size_t i = 0; i < filters.size(); ++i) {
        const int y = first + static_cast<int>(i) * kBandRows;
        const auto work = [&, i, y] { bands[i] = &filters[i].filter(y, film.width); };
        if (y < film.height && i + 1 < filters.size()) {
          threads.emplace_back(work);
        } else if (y < film.height) {
          work();
        }
      }
    }
    for (std::size_t i = 0; i < bands.size() && bands[i] != nullptr; ++i) {
      const int y = first + static_cast<int>(i) * kBandRows;
      for (int row = -kRadius; row < kBandRows + kRadius; ++row) {
        for (int parity = 0; parity < 2; ++parity) {
          const std::size_t from = bands[i]->places.at(parity - kPad, row), to = places.at(parity - kPad, y + row);
          for (std::size_t plane = 0; plane < 4; ++plane) {
            for (std::size_t k = 0; k < places.stride; ++k) {
              sums[plane][to + k] += bands[i]->sums[plane][from + k];
            }
          }
        }
      }
    }
  }
  std::vector<float> out(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t at = places.at(static_cast<int>(i) % film.width, static_cast<int>(i) / film.width);
    const auto a = static_cast<float>(film.samples_a[i]), b = static_cast<float>(film.samples_b[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      const float sum = film.half_a[c * pixels + i] * a + film.half_b[c * pixels + i] * b;
      const float mean = a + b > 0 && std::isfinite(sum) ? sum / (a + b) : 0.0f;
      out[c * pixels + i] =
          planes.known[at] > 0 ? std::max((sums[c][at] + kOwnWeight * mean) / (sums[3][at] + kOwnWeight), 0.0f) : mean;
    }
  }
  return {std::move(out), planes.brightness};
}

}  // namespace

std::vector<float> regress(const ReconstructionInput& film, const ReconstructionSettings& settings) {
  return predictions(film, settings).first;
}

std::vector<float> reconstruct(const ReconstructionInput& film, const ReconstructionSettings& settings) {
  auto [picture, brightness] = predictions(film, settings);
  mix_with_raw(film, brightness, picture);
  return std::move(picture);
}

}  // namespace lightmill
