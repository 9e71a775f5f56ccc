// The camera, the film, and the pixel filter of a scene document.
#pragma once

#include "common/scene/document/values.h"

namespace lightmill {

inline constexpr double kMaxFilterRadius = 16;  ///< pixels

inline constexpr double kMaxShift = 1000;  ///< of a camera, in heights of the film

struct Camera {
  Point3d eye{0, 0, 0};
  Point3d look_at{0, 0, -1};
  Point3d up{0, 1, 0};
  double vertical_fov_degrees = 40;  ///< over the full height of the film; in (0, 180)
  double lens_radius = 0;            ///< of a thin lens, scene units; 0: a pinhole
  double focus_distance = 0;         ///< along the view, scene units; 0: the distance of look_at
  /// The film's centre is this far to the right and up from the view's axis, in heights of the film. Lines that
  /// are parallel to the film stay parallel.
  double shift_x = 0, shift_y = 0;
};

enum class FilterKind { box, tent, gaussian, blackman_harris };

/// The pixel filter, importance-sampled: it decides where in and around the pixel camera rays start.
struct PixelFilter {
  FilterKind kind = FilterKind::blackman_harris;
  double radius_pixels = 1.5;  ///< support is [-radius, radius] in x and y; for a gaussian, sigma = radius / 3
};

struct FilmSettings {
  int width = 512;   ///< pixels
  int height = 512;  ///< pixels
  PixelFilter filter;
};

}  // namespace lightmill
