#include "common/materials/ggx_albedo.h"

#include "common/materials/dielectric.h"
#include "common/materials/ggx.h"
#include "common/materials/ggx_layout.h"
#include "common/materials/table_lookup.h"

namespace lightmill::ggx {
namespace {

#include "ggx_tables.inc"

F8 interpolate(const float* table, const Place8& slice, Place8 row, int rows, const Place8& column) {
  const U8 height(static_cast<std::uint32_t>(rows));
  row.node = row.node + slice.node * height;
  const F8 below = interpolate(table, row, column, kAngles);
  row.node = row.node + height;
  const F8 above = interpolate(table, row, column, kAngles);
  return below + (above - below) * slice.rest;
}

/// The place of a direction in the tables of anisotropic facets.
struct AnisotropicPlace8 {
  Place8 roughness, anisotropy, angle, azimuth;
};
AnisotropicPlace8 place(const V8& w, F8 alpha, F8 anisotropy) {
  return {place(sqrt(alpha), kRoughnesses), place(anisotropy, kAnisotropies), place(direction_coordinate(w.z), kAngles),
          place(azimuth_coordinate(w), kAzimuths)};
}

F8 interpolate(const float* table, const AnisotropicPlace8& at) {
  const auto rows = [](int n) { return U8(static_cast<std::uint32_t>(n)); };
  const auto between = [&](U8 slice) {  // of one roughness and one anisotropy
    const U8 first = (slice * rows(kAngles) + at.angle.node) * rows(kAzimuths) + at.azimuth.node;
    const F8 below = interpolate(table, Place8{first, at.azimuth.rest});
    const F8 above = interpolate(table, Place8{first + rows(kAzimuths), at.azimuth.rest});
    return below + (above - below) * at.angle.rest;
  };
  const auto of_roughness = [&](U8 row) {
    const U8 slice = row * rows(kAnisotropies) + at.anisotropy.node;
    const F8 below = between(slice);
    return below + (between(slice + U8(1u)) - below) * at.anisotropy.rest;
  };
  const F8 below = of_roughness(at.roughness.node);
  return below + (of_roughness(at.roughness.node + U8(1u)) - below) * at.roughness.rest;
}

}  // namespace

Albedo8 albedo(F8 cos_theta, F8 alpha) {
  const Place8 row = place(sqrt(alpha), kRoughnesses);
  const Place8 column = place(sqrt(max(cos_theta, F8(0.0f))), kAngles);
  return {interpolate(kNormal, row, column, kAngles), interpolate(kGrazing, row, column, kAngles)};
}

Albedo8 mean_albedo(F8 alpha) {
  const Place8 row = place(sqrt(alpha), kRoughnesses);
  return {interpolate(kMeanNormal, row), interpolate(kMeanGrazing, row)};
}

F8 gloss_albedo(F8 cos_theta, F8 alpha, F8 eta) {
  const F8 rough =
      interpolate(kGloss, place(gloss_index_coordinate(eta), kGlossIndices), place(sqrt(alpha), kRoughnesses),
                  kRoughnesses, place(sqrt(max(cos_theta, F8(0.0f))), kAngles));
  const M8 smooth = alpha < F8(kSmoothAlpha);
  if (smooth.none()) {
    return rough;
  }
  const F8 cosine = min(max(cos_theta, F8(0.0f)), F8(1.0f));
  return select(smooth, min(dielectric::fresnel(cosine, eta).reflectance, F8(0.9999f)), rough);
}

F8 mean_gloss_albedo(F8 alpha, F8 eta) {
  return interpolate(kMeanGloss, place(gloss_index_coordinate(eta), kGlossIndices), place(sqrt(alpha), kRoughnesses),
                     kRoughnesses);
}

F8 coat_albedo(F8 cos_theta, F8 alpha) {
  return interpolate(kGloss + kCoatIndex * kRoughnesses * kAngles, place(sqrt(alpha), kRoughnesses),
                     place(sqrt(max(cos_theta, F8(0.0f))), kAngles), kAngles);
}

F8 mean_coat_albedo(F8 alpha) {
  return interpolate(kMeanGloss + kCoatIndex * kRoughnesses, place(sqrt(alpha), kRoughnesses));
}

F8 balance(F8 cos_theta, F8 alpha) {
  return interpolate(kMetal, place(sqrt(alpha), kRoughnesses), place(direction_coordinate(cos_theta), kAngles),
                     kAngles);
}

F8 balance(F8 cos_theta, F8 alpha, F8 eta) {
  return interpolate(kGlass, place(index_coordinate(eta), kIndices), place(sqrt(alpha), kRoughnesses), kRoughnesses,
                     place(direction_coordinate(cos_theta), kAngles));
}

F8 white_albedo(const V8& w, F8 alpha, F8 anisotropy) {
  return interpolate(kAnisotropicWhite, place(w, alpha, anisotropy));
}

F8 mean_white_albedo(F8 alpha, F8 anisotropy) {
  return interpolate(kAnisotropicMeanWhite, place(sqrt(alpha), kRoughnesses), place(anisotropy, kAnisotropies),
                     kAnisotropies);
}

F8 coat_albedo(const V8& w, F8 alpha, F8 anisotropy) {
  return interpolate(kAnisotropicCoat, place(w, alpha, anisotropy));
}

F8 mean_coat_albedo(F8 alpha, F8 anisotropy) {
  return interpolate(kAnisotropicMeanCoat, place(sqrt(alpha), kRoughnesses), place(anisotropy, kAnisotropies),
                     kAnisotropies);
}

F8 balance(const V8& w, F8 alpha, F8 anisotropy) {
  return interpolate(kAnisotropicMetal, place(w, alpha, anisotropy));
}

F8 coat_below(F8 cos_theta, F8 coat_alpha, F8 alpha) {
  return interpolate(kCoat, place(sqrt(coat_alpha), kCoats), place(sqrt(alpha), kBases), kBases,
                     place(direction_coordinate(cos_theta), kAngles));
}

V8 kept_by_bounces(const V8& mean_fresnel, const Albedo8& mean) {
  const F8 e = sqrt(mean.of(F8(1.0f), F8(1.0f)));
  const auto kept = [&](F8 f) { return f * e / (F8(1.0f) - f * (F8(1.0f) - e)); };
  return {kept(mean_fresnel.x), kept(mean_fresnel.y), kept(mean_fresnel.z)};
}

}  // namespace lightmill::ggx
