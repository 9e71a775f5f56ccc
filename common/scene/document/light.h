// Lights of a scene document that are not surfaces. Directions need not be unit vectors.
#pragma once

#include <array>
#include <numbers>
#include <optional>
#include <string>
#include <variant>

#include "common/base/digest.h"
#include "common/scene/document/values.h"

namespace lightmill {

inline constexpr double kMinCutoffDegrees = 1e-3;  ///< of a spot: half its opening
inline constexpr double kMinSpreadDegrees = 1;     ///< of a disk
inline constexpr double kMaxCosineExponent = 1e4;  ///< n of cosⁿ; single precision has no cosine for larger ones

/// Radiates equally in all directions, from a point or a sphere.
struct PointLight {
  Point3d position{0, 0, 0};
  RgbColor intensity;  ///< W/sr, from afar
  double radius = 0;   ///< of the sphere, in scene units; its radiance is intensity / (π radius²)
};
/// Light from infinitely far away: parallel, or from a disk in the sky.
struct DirectionalLight {
  Point3d direction{0, -1, 0};  ///< direction of travel
  RgbColor irradiance;          ///< W/m² on a surface that faces it
  double angle_degrees = 0;     ///< the disk's angular diameter, in [0, 180]; 0: parallel
};
/// A cone of light from a point or a sphere: full within cutoff · (1 − blend), then falling smoothly to zero at cutoff.
struct SpotLight {
  Point3d position{0, 0, 0};
  Point3d direction{0, -1, 0};
  RgbColor intensity;          ///< W/sr along the direction
  double cutoff_degrees = 45;  ///< half the cone's opening, in [kMinCutoffDegrees, 180]
  double blend = 0;            ///< share of the cone's opening with falloff, in [0, 1]
  double radius = 0;           ///< of the sphere; its radiance is the intensity in a direction / (π radius²)
};
/// A point light whose intensity falls off with cosⁿ of the angle to its direction, and is zero behind it.
struct CosinePowerLight {
  Point3d position{0, 0, 0};
  Point3d direction{0, -1, 0};
  RgbColor intensity;   ///< W/sr along the direction
  double exponent = 1;  ///< n, in [0, 10000]
};
/// A disk, ellipse or rectangle that emits on one side.
struct DiskLight {
  Point3d position{0, 0, 0};    ///< of the centre
  Point3d direction{0, -1, 0};  ///< normal of the emitting side
  RgbColor radiance;            ///< W/(m² sr)
  double radius = 1;            ///< in scene units; of an ellipse, along `up`; of a rectangle, half its height
  double second_radius = 1;     ///< across `up`; a disk has equal radii; of a rectangle, half its width
  Point3d up{1, 0, 0};          ///< only the part across `direction` counts
  /// Opening of the cone around `direction` in which it emits, in [kMinSpreadDegrees, 180]. The radiance at the angle
  /// θ is (1 − tan θ / tan(spread/2)) · `radiance`, as behind a grid of slats.
  double spread_degrees = 180;
  bool rectangular = false;
  double area() const { return (rectangular ? 4 : std::numbers::pi) * radius * second_radius; }
  const char* kind_name() const { return rectangular ? "rectangle" : "disk"; }  ///< in documents
};
/// A point light with a measured intensity: an LM-63 profile (common/lights/ies_profile.h).
struct IesLight {
  Point3d position{0, 0, 0};
  Point3d direction{0, -1, 0};  ///< direction of the profile's vertical angle 0
  Point3d up{1, 0, 0};          ///< towards horizontal angle 0; only the part across `direction` counts
  RgbColor color{1, 1, 1};      ///< only the ratio of its channels counts
  double scale = 1;             ///< factor of the profile's candelas
  std::string file;             ///< as the document named it; for messages only
  Sha256 asset;                 ///< of the profile's file
};
/// Light from infinitely far away on all sides: one colour, or an image (common/lights/environment_light.h).
struct EnvironmentLight {
  RgbColor radiance{1, 1, 1};  ///< W/(m² sr); multiplies the image, if there is one
  bool equal_area = false;     ///< the image is a square of equal areas, not of longitudes and latitudes
  /// Rows of an orthogonal matrix that takes directions of the scene to those of the image; none: the identity.
  std::optional<std::array<Point3d, 3>> orientation;
  double rotation_degrees = 0;  ///< after it, of the image about its +y; positive turns +x towards −z
  std::string file;             ///< as the document named it; for messages only; empty without an image
  Sha256 asset;                 ///< of the image's file
  bool has_image = false;
};

struct Light {
  std::string name;
  std::variant<PointLight, DirectionalLight, SpotLight, CosinePowerLight, DiskLight, IesLight, EnvironmentLight> kind;
  std::string group = {};           ///< its light group; empty: none
  bool hidden_from_camera = false;  ///< camera rays pass it; only for lights with a size
};

}  // namespace lightmill
