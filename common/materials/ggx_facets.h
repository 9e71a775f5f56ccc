// Facets of rough metal and gloss, isotropic or anisotropic: alpha, albedo, and compensation of multiple scattering.
#pragma once

#include <optional>

#include "common/materials/ggx.h"
#include "common/materials/ggx_albedo.h"

namespace lightmill::ggx {

/// GGX facets that are rougher along the x axis, as in KHR_materials_anisotropy. alpha is that along y. Along x it is
/// alpha + (1 − alpha) strength².
class Facets8 {
 public:
  Facets8(F8 all) : alpha_(all) {}
  /// Anisotropic facets have an alpha of at least kSmoothAlpha, so they have a lobe. Lanes that are not directed are
  /// isotropic. Their distribution has the same peak.
  Facets8(F8 alpha, F8 strength, M8 directed) : alpha_(alpha) {
    const M8 stretched = strength > F8(0.0f);
    if (stretched.none()) {
      return;
    }
    const F8 y = max(alpha, F8(kSmoothAlpha)), x = min(y + (F8(1.0f) - y) * (strength * strength), F8(1.0f));
    alpha_ = select(stretched, select(directed, y, sqrt(x * y)), alpha);
    if (const M8 wider = stretched & directed & (x > y); wider.any()) {
      wide_ = {masked(wider, strength), Alpha8(select(wider, x, alpha_), alpha_)};
    }
  }

  /// alpha along y.
  F8 alpha() const { return alpha_; }
  bool isotropic() const { return !wide_; }
  M8 rough() const { return alpha_ >= F8(kSmoothAlpha); }
  /// alpha of the isotropic facets whose distribution has the same peak.
  F8 mean_alpha() const { return wide_ ? select(wide_->lanes(), sqrt(wide_->axes.x * wide_->axes.y), alpha_) : alpha_; }
  /// f of the alphas along both axes. The compiler makes a copy of f for isotropic facets.
  template <class Function>
  auto with_axes(const Function& f) const {
    return wide_ ? f(wide_->axes) : f(Alpha8(alpha_));
  }

  /// Of metal. Schlick's terms of anisotropic facets are a fit, but their sum is not.
  Albedo8 albedo(const V8& w) const {
    const Albedo8 all = ggx::albedo(w.z, mean_alpha());
    return wide_ ? wide_->scaled(all, ggx::white_albedo(w, alpha_, wide_->anisotropy)) : all;
  }
  Albedo8 mean_albedo() const {
    const Albedo8 all = ggx::mean_albedo(mean_alpha());
    return wide_ ? wide_->scaled(all, ggx::mean_white_albedo(alpha_, wide_->anisotropy)) : all;
  }
  /// Of a dielectric. That of anisotropic facets is a fit, but for kCoatEta.
  F8 gloss_albedo(const V8& w, F8 eta) const {
    const F8 all = ggx::gloss_albedo(w.z, mean_alpha(), eta);
    return wide_
               ? wide_->scaled(all, ggx::coat_albedo(w, alpha_, wide_->anisotropy), ggx::coat_albedo(w.z, mean_alpha()))
               : all;
  }
  F8 mean_gloss_albedo(F8 eta) const {
    const F8 all = ggx::mean_gloss_albedo(mean_alpha(), eta);
    return wide_ ? wide_->scaled(all, ggx::mean_coat_albedo(alpha_, wide_->anisotropy),
                                 ggx::mean_coat_albedo(mean_alpha()))
                 : all;
  }
  F8 balance(const V8& w) const {
    const F8 all = ggx::balance(w.z, alpha_);
    return wide_ ? select(wide_->lanes(), ggx::balance(w, alpha_, wide_->anisotropy), all) : all;
  }

 private:
  struct Wide {
    F8 anisotropy;  ///< the strength in [0, 1]; 0 where the facets are isotropic
    Alpha8 axes;
    M8 lanes() const { return anisotropy > F8(0.0f); }
    Albedo8 scaled(const Albedo8& isotropic, F8 white) const {
      const F8 by = select(lanes(), white / isotropic.of(F8(1.0f), F8(1.0f)), F8(1.0f));
      return {isotropic.normal * by, isotropic.grazing * by};
    }
    F8 scaled(F8 isotropic, F8 coat, F8 isotropic_coat) const {
      return select(lanes(), min(isotropic * coat / isotropic_coat, F8(0.9999f)), isotropic);
    }
  };
  F8 alpha_;
  std::optional<Wide> wide_;  ///< if any lane is anisotropic
};

}  // namespace lightmill::ggx
