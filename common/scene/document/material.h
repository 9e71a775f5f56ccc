// Materials of a scene document, their textures, and the media in closed shapes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/digest.h"
#include "common/scene/document/values.h"

namespace lightmill {

inline constexpr double kMaxIor = 10;  ///< of a dielectric
inline constexpr double kMaxInnerReflectance = 0.99;
inline constexpr double kMaxComplexIndex = 1000;   ///< of a metal's n and k
inline constexpr double kMaxPhongExponent = 1e6;   ///< single precision has no direction for larger ones
inline constexpr double kMaxMeanCosine = 0.99;     ///< of a phase function
inline constexpr double kMaxAbsorption = 0x1p100;  ///< per scene unit; opaque

inline constexpr double kMinAnisotropicAlpha = 1e-4;  ///< GGX's alpha across the direction is at least this
inline constexpr double kMaxRotationDegrees = 1e4;    ///< of texture coordinates

inline constexpr std::uint32_t kNoTexture = 0xffffffff;
inline constexpr int kFirstTile = 1001, kLastTile = 2000;  // UDIM numbers

/// An image on surfaces, placed by their texture coordinates (common/materials/texture.h).
struct TextureImage {
  std::string name;
  std::string file;  ///< as the document named it; for messages
  Sha256 asset;      ///< of the file
  enum class Filter { nearest, bilinear } filter = Filter::bilinear;
  enum class Wrap { repeat, clamp, mirror };
  std::array<Wrap, 2> wrap{};  ///< along u and v
  /// Whether colours are sRGB-encoded. `automatic` follows the file's format: integers are, floats are not.
  enum class ColorSpace { automatic, srgb, linear } color_space = ColorSpace::automatic;
  // The texture coordinates are scaled, rotated about (0, 0) and moved, in this order.
  std::array<double, 2> scale{1, 1};
  double rotation_degrees = 0;  ///< counter-clockwise: from u towards v
  std::array<double, 2> offset{0, 0};
  /// UDIM number, or 0. With it the image covers one square of u and v: 1001 + i + 10 j begins at u = i and v = j.
  /// Squares without an image are black and transparent.
  int tile = 0;
  /// The texture to which this is a further tile: an index into Scene::textures. All but image and tile are its. Or
  /// kNoTexture.
  std::uint32_t tile_of = kNoTexture;
};

/// A colour that may vary over a surface: a factor, times a texture if there is one.
struct TexturedColor {
  RgbColor rgb;
  std::uint32_t texture = kNoTexture;  ///< index into Scene::textures

  TexturedColor() = default;
  TexturedColor(float r, float g, float b) : rgb{r, g, b} {}
  TexturedColor(const RgbColor& color, std::uint32_t index = kNoTexture) : rgb(color), texture(index) {}
  friend bool operator==(const TexturedColor&, const TexturedColor&) = default;
};
inline bool is_black(const TexturedColor& color) {
  return is_black(color.rgb);
}

/// A factor in [0, 1] that varies over a surface: one channel of a texture.
struct ScalarMap {
  enum class Channel : std::uint32_t { r, g, b, alpha, luminance };
  std::uint32_t texture = kNoTexture;  ///< index into Scene::textures; none: 1 everywhere
  Channel channel = Channel::luminance;
  friend bool operator==(const ScalarMap&, const ScalarMap&) = default;
};

/// The share of rays that a surface stops. The others pass it unchanged.
struct Opacity {
  enum class Mode {
    opaque,  ///< 1
    blend,   ///< value · map
    mask,    ///< 1 where value · map is at least the cutoff, else 0
  };
  Mode mode = Mode::opaque;
  double value = 1;     ///< in [0, 1]
  ScalarMap map = {};   ///< multiplies the value
  double cutoff = 0.5;  ///< in [0, 1]
  friend bool operator==(const Opacity&, const Opacity&) = default;
};
/// The opacity. Nothing if it varies over the surface.
std::optional<double> uniform_opacity(const Opacity& opacity);
/// Shading normals in tangent space: 2 · texel − 1 is their part along u, along v (green points up the image) and
/// along the interpolated normal.
struct NormalMap {
  std::uint32_t texture = kNoTexture;  ///< index into Scene::textures
  double scale = 1;                    ///< of the parts along u and v
  friend bool operator==(const NormalMap&, const NormalMap&) = default;
};

/// Heights over the surface, whose slopes change the shading normal.
struct BumpMap {
  ScalarMap map;
  double height = 1;  ///< in scene units, where the map is 1
  friend bool operator==(const BumpMap&, const BumpMap&) = default;
};

struct DiffuseMaterial {
  TexturedColor reflectance{0.5f, 0.5f, 0.5f};  ///< albedo, each in [0, 1]
  double roughness = 0;                         ///< of EON (common/materials/rough_diffuse.h), in [0, 1]; 0: Lambert
  TexturedColor transmittance{};  ///< share scattered to the other side of a sheet, each in [0, 1]; not if rough
};
struct MirrorMaterial {
  TexturedColor reflectance{1, 1, 1};  ///< each in [0, 1]
};
/// A dielectric: Fresnel reflection and refraction, total internal reflection.
struct DielectricMaterial {
  double ior = 1.5;      ///< of the inside, in (0, 10]; 1: no refraction
  double roughness = 0;  ///< √alpha of GGX, in [0, 1]; 0 is smooth
};
/// Phong's model with energy conservation: a diffuse part and a lobe about the mirror direction.
struct PhongMaterial {
  TexturedColor diffuse;   ///< albedo, each in [0, 1]
  TexturedColor specular;  ///< albedo at normal incidence; diffuse + specular <= 1 in each channel
  double exponent = 10;    ///< in [0, 1e6]
};
/// Metal or gloss that is rougher along one direction, as brushed metal is. The direction is that of u on the surface,
/// rotated. Across it, GGX's alpha is roughness². Along it, it is alpha + (1 − alpha) strength², as in
/// KHR_materials_anisotropy.
struct Anisotropy {
  double strength = 0;          ///< in [0, 1]
  double rotation_degrees = 0;  ///< counter-clockwise: from u towards v
  friend bool operator==(const Anisotropy&, const Anisotropy&) = default;
};

/// A metal, given by its complex index of refraction.
struct ConductorMaterial {
  RgbColor eta{0, 0, 0}, k{1, 1, 1};  ///< n and k per channel, each in [0, 1000], not both 0
  double roughness = 0;               ///< √alpha of GGX, in [0, 1]; 0 is smooth
  Anisotropy anisotropy = {};
};
/// The layers are in common/materials/principled.h.
struct PrincipledMaterial {
  TexturedColor base_color{0.8f, 0.8f, 0.8f};                              ///< each in [0, 1]
  double metallic = 0, roughness = 0.5, specular = 0.5, transmission = 0;  ///< each in [0, 1]
  double ior = 1.5;                                                        ///< in (0, 10]
  double coat = 0, coat_roughness = 0.03;                                  ///< each in [0, 1]
  bool burley_diffuse = false;
  Anisotropy anisotropy = {};      ///< of metal and gloss
  TexturedColor sheen_color = {};  ///< each in [0, 1]; black: no sheen
  double sheen_roughness = 0.5;    ///< in [0, 1]
  TexturedColor transmittance{};   ///< share of diffuse light that goes to the other side of a sheet, each in [0, 1]
  TexturedColor specular_color{1, 1, 1};  ///< of gloss at normal incidence, each in [0, 1]
  /// Share r of light from the diffuse part that returns to it, in [0, kMaxInnerReflectance]. Its colour is
  /// b (1 − r)/(1 − b r), with the base colour b (Saunderson 1942).
  double inner_reflectance = 0;
  // They multiply the number of their name.
  ScalarMap specular_map = {}, transmission_map = {}, coat_map = {}, coat_roughness_map = {}, sheen_roughness_map = {};

  /// The least value over the surface.
  double least_transmission() const { return transmission_map.texture != kNoTexture ? 0 : transmission; }
};

/// A surface that shows the environment behind it, darkened by the scene's shadows.
struct ShadowCatcherMaterial {};

struct Material;
/// A mixture of two materials, which may be mixtures. At each point of a path one of them is drawn: `second` with the
/// probability of the factor. They have no emission, opacity, normal map, name or inside of their own.
struct MixtureMaterial {
  std::shared_ptr<const Material> first, second;
  double factor = 0.5;  ///< in [0, 1]
  ScalarMap map = {};   ///< multiplies the factor
};
inline constexpr std::size_t kMaxMixtureParts = 16;  ///< that are no mixtures

/// The medium in a closed shape.
struct Medium {
  RgbColor absorption;       ///< σ per scene unit, each in [0, kMaxAbsorption]: Bouguer's law exp(−σ · length)
  RgbColor scattering = {};  ///< per scene unit, in addition to absorption; each in [0, kMaxAbsorption]
  double anisotropy = 0;     ///< mean cosine of scattering (Henyey-Greenstein), in ±kMaxMeanCosine
  friend bool operator==(const Medium&, const Medium&) = default;
};

/// The unit of `Material::emission`.
enum class EmissionUnit {
  radiance,  ///< along the normal, W/(m² sr)
  flux,      ///< W, radiated by all surfaces of the material together
};

struct Material {
  std::string name;
  std::variant<DiffuseMaterial, MirrorMaterial, DielectricMaterial, PhongMaterial, ConductorMaterial,
               PrincipledMaterial, ShadowCatcherMaterial, MixtureMaterial>
      kind;
  TexturedColor emission;           ///< zero if the material does not emit
  bool two_sided_emission = false;  ///< if false, only on the side of the geometric normal
  Medium interior = {};             ///< of glass, and of sheets
  std::int32_t priority = 0;        ///< where such materials overlap, the medium with the highest priority applies
  EmissionUnit emission_unit = EmissionUnit::radiance;
  double emission_exponent = 0;    ///< n: radiance falls off with cosⁿ of the angle to the normal; in [0, 10000]
  ScalarMap roughness_map = {};    ///< multiplies the roughness, of materials with one above 0
  ScalarMap metallic_map = {};     ///< multiplies `metallic` of principled materials
  std::string light_group = {};    ///< of the emission; empty: none
  Opacity opacity = {};            ///< also of the emission; not of materials that light enters (is_boundary)
  NormalMap normal_map = {};       ///< of all kinds but shadow catchers
  BumpMap bump_map = {};           ///< instead of a normal map
  bool single_scattering = false;  ///< rough surfaces lose the light that meets several facets
};

/// Calls `visit` with the parts of a mixture that are no mixtures, or with the material itself.
template <class Visit>
void for_each_part(const Material& material, const Visit& visit) {
  if (const auto* mixture = std::get_if<MixtureMaterial>(&material.kind)) {
    for_each_part(*mixture->first, visit);
    for_each_part(*mixture->second, visit);
  } else {
    visit(material);
  }
}
/// The number of parts that are no mixtures, or 1.
std::size_t count_parts(const Material& material);
/// Whether `is` holds for some part.
template <class Is>
bool any_part(const Material& material, const Is& is) {
  bool found = false;
  for_each_part(material, [&](const Material& part) { found = found || is(part); });
  return found;
}

/// Whether textures change the roughness or metallicity of some part, or the factor of a mixture.
bool has_maps(const Material& material);
/// Whether the material has a normal map or a bump map.
inline bool has_mapped_normals(const Material& material) {
  return material.normal_map.texture != kNoTexture || material.bump_map.map.texture != kNoTexture;
}

/// Null for kinds without one.
const Anisotropy* anisotropy_of(const Material& material);
/// Whether the facets depend on the direction of u, in some part.
inline bool is_anisotropic(const Material& material) {
  return any_part(material, [](const Material& part) {
    const Anisotropy* anisotropy = anisotropy_of(part);
    return anisotropy != nullptr && anisotropy->strength > 0;
  });
}
/// Roughness (√alpha) of the isotropic surface whose distribution of facets has the same peak: alpha is the geometric
/// mean of those along both directions.
double mean_roughness(double roughness, const Anisotropy& anisotropy);

/// The material's colours that may have a texture: those of its kind or its parts, and its emission.
std::vector<const TexturedColor*> colors_of(const Material& material);

/// Whether a part has diffuse light and a transmittance.
bool is_sheet(const Material& material);
/// Whether light is refracted into the shape: a dielectric, or a principled material that transmits.
bool is_glass(const Material& material);
/// Whether light passes into the shape: glass, or a sheet around a medium.
bool is_boundary(const Material& material);

/// Index of refraction of the inside, or of gloss. 1 for kinds without one, and for mixtures without glass.
double ior_of(const Material& material);
/// Index of refraction in the shape. 1 in sheets.
double inner_ior(const Material& material);

/// σ = 1/ρ − 1 of each component in [0, 1], at most kMaxAbsorption.
RgbColor absorption_of_color(const RgbColor& color);

}  // namespace lightmill
