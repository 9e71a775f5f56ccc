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
  /// Of a dielectric. That of anisotropic facets is a fit but for kCoatEta. Up to 80° from the normal, the error is 0.012
  /// for eta up to 2, and 0.06 at 4. At 89° it is 0.06 at 1.2.
  F8 gloss_albedo(const V8& w, F8 eta) const {
    const F8 all = ggx::gloss_albedo(w.z, mean_alpha(), eta);
    if (!wide_) {
      return all;
    }
    const F8 white = ggx::white_albedo(w, alpha_, wide_->anisotropy),
             coat = ggx::coat_albedo(w, alpha_, wide_->anisotropy);
    const Albedo8 isotropic = ggx::albedo(w.z, mean_alpha());
    return wide_->scaled(all, eta, {white, coat},
                         {isotropic.of(F8(1.0f), F8(1.0f)), ggx::coat_albedo(w.z, mean_alpha())});
  }
  F8 mean_gloss_albedo(F8 eta) const {
    const F8 all = ggx::mean_gloss_albedo(mean_alpha(), eta);
    if (!wide_) {
      return all;
    }
    const F8 white = ggx::mean_white_albedo(alpha_, wide_->anisotropy),
             coat = ggx::mean_coat_albedo(alpha_, wide_->anisotropy);
    const Albedo8 isotropic = ggx::mean_albedo(mean_alpha());
    return wide_->scaled(all, eta, {white, coat},
                         {isotropic.of(F8(1.0f), F8(1.0f)), ggx::mean_coat_albedo(mean_alpha())});
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
    /// Albedos of facets that reflect all, and with the index of coats.
    struct Known8 {
      F8 white, coat;
      /// About that with the reflectance f0 at normal incidence, whose rest grows to grazing angles as a coat's does.
      F8 at(F8 f0) const {
        const F8 of_coat((kCoatEta - 1) / (kCoatEta + 1) * (kCoatEta - 1) / (kCoatEta + 1));
        return f0 * white + (F8(1.0f) - f0) * (coat - of_coat * white) / (F8(1.0f) - of_coat);
      }
    };
    F8 scaled(F8 albedo, F8 eta, const Known8& anisotropic, const Known8& isotropic) const {
      const F8 root = (eta - F8(1.0f)) / (eta + F8(1.0f)), f0 = root * root;
      return select(lanes(), min(albedo * anisotropic.at(f0) / isotropic.at(f0), F8(0.9999f)), albedo);
    }
  };
  F8 alpha_;
  std::optional<Wide> wide_;  ///< if any lane is anisotropic
};

}  // namespace lightmill::ggx
