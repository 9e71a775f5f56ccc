// The scene document as plain values: what is to be seen, naming its assets by content.
//
// Mirrors lightmill.v1.Scene (proto/lightmill/v1/scene.proto, the schema); common/wire converts. Lengths are in scene
// units (metres where it matters), angles in degrees, y up is customary but not required.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

using Point3d = std::array<double, 3>;  ///< x, y, z

inline constexpr double kMaxCoordinate = 1e12;  ///< of any point, in scene units: single precision must hold squares
inline constexpr double kMaxIor = 10;           ///< of a dielectric
inline constexpr double kMaxFilterRadius = 16;  ///< pixels
inline constexpr double kMaxCosineExponent =
    1e4;  ///< of cosⁿ lights: beyond, single precision knows no cosine so exact
inline constexpr std::size_t kMaxSceneEntries = 1'000'000;  ///< textures, materials, objects and lights, of each

inline constexpr double kMaxComplexIndex = 1000;     ///< of a metal's n and k
inline constexpr double kLeastCutoffDegrees = 1e-3;  ///< of a spot: half its opening
inline constexpr double kMaxPhongExponent = 1e6;     ///< beyond, single precision knows no direction so exact
inline constexpr std::size_t kMaxMedia = 65'535;     ///< materials that light passes into
inline constexpr double kMaxMeanCosine = 0.99;       ///< of a phase function
inline constexpr double kMaxAbsorption = 0x1p100;    ///< per scene unit: lets nothing through

/// Linear RGB with Rec. 709 primaries. Another kind (a spectrum) could join as an alternative in the schema.
struct RgbColor {
  float r = 0, g = 0, b = 0;
  friend bool operator==(const RgbColor&, const RgbColor&) = default;
};

struct Camera {
  Point3d eye{0, 0, 0};
  Point3d look_at{0, 0, -1};
  Point3d up{0, 1, 0};
  double vertical_fov_degrees = 40;  ///< of the full film height; in (0, 180)
  double lens_radius = 0;            ///< of a thin lens, scene units; 0: a pinhole
  double focus_distance = 0;         ///< along the view, scene units; 0: that of look_at
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

/// An image laid over surfaces by their texture coordinates (common/materials/texture.h).
struct TextureImage {
  std::string name;
  std::string file;  ///< as the document named it; for messages
  Sha256 asset;      ///< of the file's bytes
  enum class Filter { nearest, bilinear } filter = Filter::bilinear;
  enum class Wrap { repeat, clamp } wrap = Wrap::repeat;
  /// Whether colours are sRGB-encoded: as the file's format says (integers are, floats are not), or as told.
  enum class ColorSpace { automatic, srgb, linear } color_space = ColorSpace::automatic;
  std::array<double, 2> scale{1, 1};   ///< of the texture coordinates, before
  std::array<double, 2> offset{0, 0};  ///< is added
};

inline constexpr std::uint32_t kNoTexture = 0xffffffff;

/// A colour that may vary over a surface: a factor, times a texture where there is one.
struct TexturedColor {
  RgbColor rgb;
  std::uint32_t texture = kNoTexture;  ///< index into Scene::textures

  TexturedColor() = default;
  TexturedColor(float r, float g, float b) : rgb{r, g, b} {}
  TexturedColor(const RgbColor& color, std::uint32_t index = kNoTexture) : rgb(color), texture(index) {}
  friend bool operator==(const TexturedColor&, const TexturedColor&) = default;
};

/// A factor in [0, 1] that varies over a surface: one channel of a texture.
struct ScalarMap {
  enum class Channel : std::uint32_t { r, g, b, alpha, luminance };
  std::uint32_t texture = kNoTexture;  ///< index into Scene::textures; none: 1 everywhere
  Channel channel = Channel::luminance;
  friend bool operator==(const ScalarMap&, const ScalarMap&) = default;
};

struct DiffuseMaterial {
  TexturedColor reflectance{0.5f, 0.5f, 0.5f};  ///< albedo, each in [0, 1]
};
struct MirrorMaterial {
  TexturedColor reflectance{1, 1, 1};  ///< each in [0, 1]
};
/// A dielectric: Fresnel reflection and refraction, total internal reflection.
struct DielectricMaterial {
  double ior = 1.5;      ///< of what is behind the outward normal, in (0, 10]; 1 means nothing is there
  double roughness = 0;  ///< GGX's √α, in [0, 1]; 0 is smooth
};
/// Phong's model, energy conserved: a diffuse part and a lobe about the mirror direction.
struct PhongMaterial {
  TexturedColor diffuse;   ///< albedo, each in [0, 1]
  TexturedColor specular;  ///< albedo at normal incidence; diffuse + specular <= 1 in each channel
  double exponent = 10;    ///< in [0, 1e6]
};
/// A metal by its complex index of refraction.
struct ConductorMaterial {
  RgbColor eta{0, 0, 0}, k{1, 1, 1};  ///< n and k per channel, each in [0, 1000], not both 0
  double roughness = 0;               ///< GGX's √α, in [0, 1]; 0 is smooth
};
/// Layers as in common/materials/principled.h.
struct PrincipledMaterial {
  TexturedColor base_color{0.8f, 0.8f, 0.8f};                              ///< each in [0, 1]
  double metallic = 0, roughness = 0.5, specular = 0.5, transmission = 0;  ///< each in [0, 1]
  double ior = 1.5;                                                        ///< in (0, 10]
  double coat = 0, coat_roughness = 0.03;                                  ///< each in [0, 1]
};

/// Shows the environment behind it, darkened by the shadows that the scene casts on it.
struct HoldoutMaterial {};

/// What fills a closed shape of glass.
struct Medium {
  RgbColor absorption;       ///< σ per scene unit, each in [0, kMaxAbsorption]: Bouguer's law exp(−σ · length)
  RgbColor scattering = {};  ///< per scene unit, beside the absorption; each in [0, kMaxAbsorption]
  double anisotropy = 0;     ///< mean cosine of scattering (Henyey-Greenstein), in ±kMaxMeanCosine
  friend bool operator==(const Medium&, const Medium&) = default;
};

/// What `Material::emission` states.
enum class EmissionUnit {
  radiance,  ///< along the normal, W/(m² sr)
  flux,      ///< W that all surfaces of the material radiate together
};

struct Material {
  std::string name;
  std::variant<DiffuseMaterial, MirrorMaterial, DielectricMaterial, PhongMaterial, ConductorMaterial,
               PrincipledMaterial, HoldoutMaterial>
      kind;
  TexturedColor emission;           ///< zero where the material does not emit
  bool two_sided_emission = false;  ///< else only on the side that the geometric normal points to
  Medium interior = {};             ///< of dielectrics and principled materials that transmit
  std::int32_t priority = 0;        ///< where such materials overlap, the medium of the highest priority is there
  EmissionUnit emission_unit = EmissionUnit::radiance;
  double emission_exponent = 0;  ///< n: radiance falls off with cosⁿ of the angle to the normal; in [0, 10000]
  ScalarMap roughness_map = {};  ///< of materials with a roughness above 0, which it multiplies
  ScalarMap metallic_map = {};   ///< of principled materials, likewise
  std::string light_group = {};  ///< of the emission; empty: none
};

/// Whether light passes into what is behind the surface: a dielectric, or a principled material that transmits.
bool is_boundary(const Material& material);

/// σ = 1/ρ − 1 of each component in [0, 1]; kMaxAbsorption where that is more.
RgbColor absorption_of_color(const RgbColor& color);

/// An indexed triangle mesh kept as an asset (common/scene/mesh.h).
struct MeshShape {
  std::string file;  ///< as the document named it; for messages only
  Sha256 asset;      ///< of the encoded mesh
};
struct SphereShape {
  Point3d center{0, 0, 0};
  double radius = 1;
  bool normal_inward = false;  ///< the geometric normal points to the centre (an enclosing, inward-emitting sphere)
};

/// Without end; texture coordinates are distances from `point` along its tangents (common/math/vec.h, Frame8).
struct PlaneShape {
  Point3d point{0, 0, 0};
  Point3d normal{0, 1, 0};  ///< need not be a unit vector
};
/// Counter-clockwise seen from outside. Texture coordinates are (0, 0), (1, 0) and (0, 1).
struct TriangleShape {
  Point3d a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
};

/// From a shape's own coordinates to the scene's: the upper three rows of a 4×4 matrix that acts on columns.
using Transform = std::array<std::array<double, 4>, 3>;
/// Whether a map leaves a volume a volume: its axes are at least 1e-30 long, and not in one plane.
bool spans_space(const Transform& t);
inline constexpr Transform kIdentityTransform{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

struct Object {
  std::string name;
  std::uint32_t material = 0;  ///< index into Scene::materials
  std::variant<MeshShape, SphereShape, PlaneShape, TriangleShape> shape;
  /// Invertible; of a sphere a similarity. Objects that share a mesh share its memory.
  Transform transform = kIdentityTransform;
};

// The kinds of light that are no surfaces. Directions need not be unit vectors.

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

// Virtual meters. Normals and directions need not be unit vectors.

/// A parallelogram that faces the side of edge1 × edge2.
struct Patch {
  Point3d corner{0, 0, 0};
  Point3d edge1{1, 0, 0}, edge2{0, 1, 0};
};
struct IrradianceMeter {
  Point3d point{0, 0, 0};
  Point3d normal{0, 1, 0};
};
/// The mean irradiance of a patch.
struct PatchMeter {
  Patch patch;
};
struct RadianceMeter {
  Point3d point{0, 0, 0};
  Point3d direction{0, 0, -1};  ///< where it looks
};
struct FluxMeter {
  Patch patch;
};
struct Meter {
  std::string name;
  std::variant<IrradianceMeter, PatchMeter, RadianceMeter, FluxMeter> kind;
};

struct Scene {
  std::string name;
  Camera camera;
  FilmSettings film;
  std::vector<TextureImage> textures;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<Light> lights;  ///< at most one environment among them
  std::vector<Meter> meters;  ///< at most kMaxMeters
};

/// The names of the scene's light groups, sorted, each once.
std::vector<std::string> light_groups_of(const Scene& scene);

/// The patch of a patch or flux meter; null for others.
const Patch* patch_of(const Meter& meter);

/// Everything that can be checked without the assets: ranges, finiteness, indices, at least one object. Errors have the
/// form "objects[3].sphere.radius: must be positive, got -1": the field's path in the schema, then the value and what
/// is expected.
Status validate(const Scene& scene);
Status validate(const Camera& camera);

/// `unknown material "whit"; the materials are red, green, white`: what to say of a name that is none of `materials`.
std::string describe_unknown_material(std::string_view name, const std::vector<Material>& materials);

/// The assets that the scene names, sorted, each once.
std::vector<Sha256> assets_of(const Scene& scene);

}  // namespace lightmill
