// Lights of a scene document that are no surfaces. Directions need not be unit vectors.
#pragma once

#include <string>
#include <variant>

#include "common/base/digest.h"
#include "common/scene/document/values.h"

namespace lightmill {

inline constexpr double kLeastCutoffDegrees = 1e-3;  ///< of a spot: half its opening
inline constexpr double kMaxCosineExponent = 1e4;    ///< of cosⁿ: beyond, single precision knows no cosine so exact

/// Radiates equally in all directions.
struct PointLight {
  Point3d position{0, 0, 0};
  RgbColor intensity;  ///< W/sr
};
/// Parallel light from infinitely far away.
struct DirectionalLight {
  Point3d direction{0, -1, 0};  ///< in which the light travels
  RgbColor irradiance;          ///< W/m² on a surface that faces it
};
/// A cone of light from a point: full within cutoff · (1 − blend), then falling off smoothly to zero at the cutoff.
struct SpotLight {
  Point3d position{0, 0, 0};
  Point3d direction{0, -1, 0};
  RgbColor intensity;          ///< W/sr along the direction
  double cutoff_degrees = 45;  ///< half the cone's opening, in [kLeastCutoffDegrees, 180]
  double blend = 0;            ///< share of the cone's opening that is falling off, in [0, 1]
};
/// A point whose intensity falls off with cosⁿ of the angle to its direction, and is zero behind.
struct CosinePowerLight {
  Point3d position{0, 0, 0};
  Point3d direction{0, -1, 0};
  RgbColor intensity;   ///< W/sr along the direction
  double exponent = 1;  ///< n, in [0, 10000]
};
/// A point whose intensity is measured: an LM-63 profile (common/lights/ies_profile.h).
struct IesLight {
  Point3d position{0, 0, 0};
  Point3d direction{0, -1, 0};  ///< where vertical angle 0 of the profile points
  Point3d up{1, 0, 0};          ///< towards horizontal angle 0; only its part across the direction counts
  RgbColor color{1, 1, 1};      ///< only its channels' ratio counts
  double scale = 1;             ///< times the profile's candelas
  std::string file;             ///< as the document named it; for messages only
  Sha256 asset;                 ///< of the profile's file
};
/// Light from infinitely far away on all sides: of one colour, or an image of equal longitudes and latitudes whose top
/// is at +y, whose centre at +x and whose right half begins towards +z.
struct EnvironmentLight {
  RgbColor radiance{1, 1, 1};   ///< W/(m² sr); times the image's values, where there is one
  double rotation_degrees = 0;  ///< of the image about +y; positive turns +x towards −z
  std::string file;             ///< as the document named it; for messages only; empty without an image
  Sha256 asset;                 ///< of the image's file
  bool has_image = false;
};

struct Light {
  std::string name;
  std::variant<PointLight, DirectionalLight, SpotLight, CosinePowerLight, IesLight, EnvironmentLight> kind;
  std::string group = {};  ///< its light group; empty: none
};

}  // namespace lightmill
