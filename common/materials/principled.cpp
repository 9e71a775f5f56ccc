#include "common/materials/principled.h"

namespace lightmill {
namespace {

/// Schlick's (1 − cos)⁵.
F8 schlick_weight(F8 cos_o) {
  const F8 c = min(max(F8(1.0f) - cos_o, F8(0.0f)), F8(1.0f));
  const F8 c2 = c * c;
  return c2 * c2 * c;
}

F8 average(const V8& color) {
  return (color.x + color.y + color.z) * F8(1.0f / 3);
}

/// Schlick's reflectance for this weight.
V8 schlick(const V8& f0, F8 weight) {
  return f0 + (broadcast(Vec3(1)) - f0) * weight;
}

/// Reflectance of a facet of a dielectric.
F8 fresnel(F8 cos_o, F8 eta) {
  return dielectric::fresnel(min(max(cos_o, F8(0.0f)), F8(1.0f)), eta).reflectance;
}

/// alpha of a roughness; 0 below the limit of smoothness.
F8 alpha_of(F8 roughness) {
  const F8 alpha = roughness * roughness;
  return masked(alpha >= F8(ggx::kSmoothAlpha), alpha);
}

/// Burley's diffuse part over Lambert's.
F8 burley(const V8& wo, const V8& wi, F8 roughness) {
  const F8 r = roughness * (F8(1.0f) + dot(wo, wi)) - F8(0.5f);
  return (F8(1.0f) + r * schlick_weight(wo.z)) * (F8(1.0f) + r * schlick_weight(wi.z));
}

/// Share of uniform light that Burley's diffuse part reflects to wo. It is a polynomial of cos. Over the azimuth of wi,
/// wo·wi and its square have the means cos μ and (cos² μ² + (1 − cos²)(1 − μ²)/2). 2∫μⁿ⁺¹(1 − μ)⁵ dμ is 1/21, 1/84 and
/// 1/252 for n = 0, 1, 2.
F8 burley_albedo(F8 cos_o, F8 roughness) {
  const F8 f = schlick_weight(cos_o), c = cos_o, c2 = c * c;
  const F8 r = roughness * (F8(1.0f) + c * F8(2.0f / 3));                      // mean of r
  const F8 rf = roughness * (F8(1.0f / 21) + c * F8(1.0f / 84));               // of r F(wi)
  const F8 squared = F8(1.0f / 21) + c * F8(1.0f / 42) + c2 * F8(1.0f / 252);  // of r² F(wi)/roughness²
  const F8 r2f = roughness * roughness * (squared + (F8(1.0f) - c2) * F8(11.0f / 504));
  return (F8(1.0f) - F8(0.5f) * f) * F8(41.0f / 42) + f * r + (F8(1.0f) - f) * rf + f * r2f;
}

/// Share of light that Burley's gloss leaves to a diffuse part without retro-reflection.
F8 burley_leaves(F8 cos_theta) {
  return F8(1.0f) - F8(0.5f) * schlick_weight(cos_theta);
}

M8 is_rough(F8 alpha) {
  return alpha >= F8(ggx::kSmoothAlpha);
}

ggx::Facets8 facets_of(const PrincipledParameters8& p) {
  const F8 alpha = alpha_of(p.roughness);
  return p.anisotropy ? ggx::Facets8(alpha, p.anisotropy->strength, p.anisotropy->directed) : ggx::Facets8(alpha);
}

}  // namespace

Principled8::Principled8(const PrincipledParameters8& p, F8 eta, const V8& wo, M8 front)
    : base_(p.base_color),
      facets_(facets_of(p)),
      alpha_(facets_.mean_alpha()),
      coat_alpha_(alpha_of(p.coat_roughness)),
      metal_(p.metallic),
      plastic_((F8(1.0f) - p.metallic) * (F8(1.0f) - p.transmission)),
      glass_((F8(1.0f) - p.metallic) * p.transmission),
      compensated_(p.compensated & is_rough(alpha_) & (plastic_ < F8(1.0f))),
      glass_bsdf_{eta, alpha_of(p.roughness), base_, compensated_},
      has_glass_((glass_ > F8(0.0f)).any()),
      has_coat_((p.coat > F8(0.0f)).any()),
      has_burley_(p.burley.any()) {
  const F8 specular = F8(2.0f) * p.specular;
  const F8 root = abs(p.ior - F8(1.0f)) / (p.ior + F8(1.0f)) * sqrt(max(specular, F8(1.0f)));
  gloss_eta_ = F8(2.0f) / (F8(1.0f) - min(root, F8(0.999f))) - F8(1.0f);
  gloss_ = min(specular, F8(1.0f));
  if (p.specular_color) {
    gloss_less_ = (broadcast(Vec3(1)) - *p.specular_color) * fresnel(F8(1.0f), gloss_eta_);
  }
  // Opaque surfaces have a coat on both sides, glass only on the outside.
  M8 bare = and_not(glass_ > F8(0.0f), front);
  const F8 outer_gloss = gloss_;
  M8 in_medium;
  const bool has_sheet = p.sheet && ((max_component(p.sheet->transmittance) > F8(0.0f)) | p.sheet->closed).any();
  if (has_sheet) {
    in_medium = and_not(p.sheet->closed, front);
    bare = bare | in_medium;
    gloss_ = masked(~in_medium, gloss_);
  }
  coat_ = masked(~bare, p.coat);
  coat_beyond_ = masked(bare, p.coat);

  if ((metal_ > F8(0.0f)).any()) {
    set_metal(wo);
  }
  const F8 white = facets_.gloss_albedo(wo, gloss_eta_);
  gloss_albedo_ = gloss_ * white;
  gloss_color_albedo_ = {gloss_albedo_, gloss_albedo_, gloss_albedo_};
  if (gloss_less_) {
    gloss_color_albedo_ = colored_gloss(white, facets_.albedo(wo).normal) * gloss_;
  }
  gloss_albedo_mean_ = gloss_ * facets_.mean_gloss_albedo(gloss_eta_);
  diffuse_albedo_ = F8(1.0f) - gloss_albedo_;
  if (has_burley_) {
    burley_ = and_not(p.burley, in_medium);
    roughness_ = p.roughness;
    if (p.anisotropy) {
      roughness_ = select(p.anisotropy->strength > F8(0.0f), sqrt(alpha_), roughness_);
    }
    diffuse_albedo_ = select(burley_, burley_albedo(wo.z, p.roughness), diffuse_albedo_);
  }
  if (has_coat_) {
    coat_albedo_ = coat_ * ggx::coat_albedo(wo.z, coat_alpha_);
    coat_mean_ = coat_ * ggx::mean_coat_albedo(coat_alpha_);
  }
  if (p.sheen && (max_component(p.sheen->color) > F8(0.0f)).any()) {
    const V8 color = masked(~bare, p.sheen->color);
    sheen_ = {Sheen8(p.sheen->roughness, wo), color * (metal_ + plastic_), max_component(color)};
  }
  if (has_sheet) {
    const F8 outer_sheen = sheen_ ? max_component(p.sheen->color) : F8(0.0f);
    sheet_ = {p.sheet->transmittance, p.sheet->closed, in_medium, p.burley, outer_gloss, p.coat, outer_sheen};
    set_sheet(wo);
  }
  set_probabilities(wo);
}

V8 Principled8::colored_gloss(F8 white, F8 not_grazing) const {
  if (!gloss_less_) {
    return {white, white, white};
  }
  const auto left = [&](F8 less) { return max(white - less * not_grazing, F8(0.0f)); };
  return {left(gloss_less_->x), left(gloss_less_->y), left(gloss_less_->z)};
}

void Principled8::set_metal(const V8& wo) {
  const ggx::Albedo8 terms = facets_.albedo(wo);
  metal_albedo_ = base_ * terms.normal + V8{terms.grazing, terms.grazing, terms.grazing};
  if (compensated_.any()) {
    const V8 mean = schlick(base_, F8(1.0f / 21));  // the mean of (1 − cos)⁵
    metal_kept_ = masked(compensated_, ggx::kept_by_bounces(mean, facets_.mean_albedo()));
    metal_albedo_ = metal_albedo_ + mean * metal_kept_ * (F8(1.0f) - terms.of(F8(1.0f), F8(1.0f)));
  }
}

void Principled8::set_sheet(const V8& wo) {
  Sheet8& sheet = *sheet_;
  const F8 gloss = sheet.gloss * facets_.mean_gloss_albedo(gloss_eta_);
  F8 mean = F8(1.0f) - masked(~sheet.burley, gloss);
  if (has_coat_) {
    mean *= F8(1.0f) - sheet.coat * ggx::mean_coat_albedo(coat_alpha_);
  }
  if (sheen_) {
    mean *= F8(1.0f) - sheet.sheen * sheen_->white.mean_albedo();
  }
  sheet.root_mean = sqrt(mean);
  sheet.at_wo = layers_leave(wo);
  sheet.lambert = select(burley_, burley_leaves(wo.z) * F8(41.0f / 42), diffuse_albedo_);
}

F8 Principled8::layers_leave(const V8& outside) const {
  const F8 gloss = F8(1.0f) - sheet_->gloss * facets_.gloss_albedo(outside, gloss_eta_);
  F8 left = select(sheet_->burley, burley_leaves(outside.z), gloss);
  if (has_coat_) {
    left *= F8(1.0f) - sheet_->coat * ggx::coat_albedo(outside.z, coat_alpha_);
  }
  if (sheen_) {
    left *= F8(1.0f) - sheet_->sheen * sheen_->white.albedo(outside.z);
  }
  return left;
}

F8 Principled8::through_sheet(const V8& wi) const {
  const F8 at_wi = layers_leave({wi.x, wi.y, abs(wi.z)});
  const F8 thin = sheet_->at_wo * at_wi / (sheet_->root_mean * sheet_->root_mean);
  return select(sheet_->closed, select(sheet_->inside, at_wi, sheet_->at_wo) / sheet_->root_mean, thin);
}

F8 Principled8::sheet_albedo() const {
  const F8 front = select(sheet_->closed, sheet_->at_wo / sheet_->root_mean, sheet_->at_wo);
  return select(sheet_->inside, sheet_->root_mean, front);
}

void Principled8::set_probabilities(const V8& wo) {
  const F8 left = F8(1.0f) - coat_albedo_;
  const F8 base = average(base_);
  p_coat_ = coat_albedo_;
  p_gloss_ =
      left * (metal_ * average(metal_albedo_) + plastic_ * average(gloss_color_albedo_)) + average(inner_coat(wo.z));
  p_diffuse_ = left * plastic_ * diffuse_albedo_ * base;
  p_glass_ = left * glass_ * (F8(0.5f) + F8(0.5f) * base);
  if (sheet_) {
    const F8 taken = left * plastic_ * sheet_->lambert * average(base_ * sheet_->transmittance);
    p_diffuse_ = max(p_diffuse_ - taken, F8(0.0f));
  }
  F8 sum = p_coat_ + p_gloss_ + p_diffuse_ + p_glass_;
  if (sheen_) {
    const F8 below = F8(1.0f) - sheen_->weight * sheen_->white.albedo();
    p_gloss_ *= below;
    p_diffuse_ *= below;
    sheen_->p = left * average(sheen_->color) * sheen_->white.albedo();
    sum = p_coat_ + p_gloss_ + p_diffuse_ + p_glass_ + sheen_->p;
  }
  if (sheet_) {
    sheet_->p = plastic_ * average(sheet_->transmittance) * sheet_albedo();
    sum += sheet_->p;
  }
  const F8 scale = masked(sum > F8(0.0f), F8(1.0f) / sum);
  p_coat_ *= scale;
  p_gloss_ *= scale;
  p_diffuse_ *= scale;
  p_glass_ *= scale;
  if (sheen_) {
    sheen_->p *= scale;
  }
  if (sheet_) {
    sheet_->p *= scale;
  }
}

F8 Principled8::coat_below(F8 cos_theta, F8 albedo) const {
  return select(is_rough(alpha_), coat_ * ggx::coat_below(cos_theta, coat_alpha_, alpha_), albedo);
}

F8 Principled8::coat_leaves(const V8& wo, const V8& wi, bool diffuse) const {
  if (!has_coat_) {
    return F8(1.0f);
  }
  const M8 through = wi.z < F8(0.0f);
  const F8 albedo_i = ggx::coat_albedo(abs(wi.z), coat_alpha_);
  const F8 in = F8(1.0f) - coat_ * albedo_i, out = F8(1.0f) - coat_albedo_;
  const F8 divisor =
      diffuse ? F8(1.0f) - coat_mean_
              : sqrt((F8(1.0f) - coat_below(wo.z, coat_albedo_)) * (F8(1.0f) - coat_below(wi.z, coat_ * albedo_i)));
  const F8 same_side = out * in / divisor;
  return select(through, out * (F8(1.0f) - coat_beyond_ * albedo_i), same_side);
}

F8 Principled8::sheen_leaves(const V8& wi, bool diffuse) const {
  const F8 albedo_o = sheen_->weight * sheen_->white.albedo(), albedo_i = sheen_->weight * sheen_->white.albedo(wi.z);
  const F8 mean = sheen_->weight * sheen_->white.mean_albedo(),
           in_and_out = (F8(1.0f) - albedo_o) * (F8(1.0f) - albedo_i);
  if (diffuse) {
    return in_and_out / (F8(1.0f) - mean);
  }
  // The rougher the facets are, the nearer E' is to the mean. A fit: the albedo of white metal is within 4.5 % of 1.
  const F8 width = F8(1.0f) - exp(alpha_ * F8(-4.0f));
  const auto below = [&](F8 albedo) { return albedo + (mean - albedo) * width; };
  return in_and_out / sqrt((F8(1.0f) - below(albedo_o)) * (F8(1.0f) - below(albedo_i)));
}

V8 Principled8::inner_coat(F8 cos_o) const {
  if (!has_glass_ || (coat_beyond_ > F8(0.0f)).none()) {
    return {};
  }
  const dielectric::Fresnel8 f = dielectric::fresnel(min(max(cos_o, F8(0.0f)), F8(1.0f)), glass_bsdf_.eta);
  // A facet of glass deflects refracted light about a quarter as much as reflected light.
  const F8 sent_back = select(is_rough(alpha_), ggx::coat_below(f.cos_refracted, coat_alpha_, F8(0.25f) * alpha_),
                              ggx::coat_albedo(f.cos_refracted, coat_alpha_));
  return base_ * base_ * (glass_ * coat_beyond_ * (F8(1.0f) - f.reflectance) * sent_back);
}

V8 Principled8::gloss_fresnel(F8 cos_o, F8 balance) const {
  const F8 w = schlick_weight(cos_o);
  const V8 plastic = colored_gloss(fresnel(cos_o, gloss_eta_), F8(1.0f) - w) * (plastic_ * gloss_);
  const V8 bounces = broadcast(Vec3(1)) + metal_kept_ * (balance - F8(1.0f));
  return schlick(base_, w) * bounces * metal_ + plastic + inner_coat(cos_o) * balance;
}

F8 Principled8::coat_fresnel(F8 cos_o) const {
  return coat_ * fresnel(cos_o, F8(ggx::kCoatEta));
}

V8 Principled8::eval(const V8& wo, const V8& wi) const {
  const M8 above = wi.z > F8(0.0f);
  const V8 m = ggx::half_vector(wo, wi);
  const F8 cos_o = dot(wo, m);
  const F8 gloss =
      masked(above & is_rough(alpha_),
             facets_.with_axes([&](const ggx::Alpha8& alpha) { return ggx::reflection(wo, wi, m, alpha); }));
  F8 balance(1.0f);
  if (compensated_.any()) {
    balance = select(compensated_, facets_.balance(wo) * facets_.balance(wi), balance);
  }
  V8 f = gloss_fresnel(cos_o, balance) * gloss;
  const F8 albedo_i = gloss_ * facets_.gloss_albedo(wi, gloss_eta_);
  F8 diffuse = plastic_ * (F8(1.0f) - gloss_albedo_) * (F8(1.0f) - albedo_i) / (F8(1.0f) - gloss_albedo_mean_);
  if (has_burley_) {
    diffuse = select(burley_, plastic_ * burley(wo, wi, roughness_), diffuse);
  }
  V8 below = base_ * (diffuse * masked(above, wi.z * F8(kInvPi)));
  V8 through;
  if (sheet_) {
    const F8 lambert = select(burley_, plastic_ * (burley_leaves(wo.z) * burley_leaves(wi.z)), diffuse);
    const V8 reflected = below - base_ * sheet_->transmittance * (lambert * masked(above, wi.z * F8(kInvPi)));
    below = {max(reflected.x, F8(0.0f)), max(reflected.y, F8(0.0f)), max(reflected.z, F8(0.0f))};
    const F8 cosine = masked(wi.z < F8(0.0f), -wi.z * F8(kInvPi));
    through = sheet_->transmittance * (plastic_ * through_sheet(wi) * cosine);
  }
  if (sheen_) {
    f = f * sheen_leaves(wi, false);
    below = below * sheen_leaves(wi, true) + sheen_->color * sheen_->white.reflection(wo, wi);
  }
  if (has_glass_) {
    f = f + glass_bsdf_.eval(wo, wi) * glass_;
  }
  V8 sum;
  if (has_coat_) {
    const F8 facets = masked(above & is_rough(coat_alpha_), ggx::reflection(wo, wi, m, coat_alpha_));
    const F8 coat = coat_fresnel(cos_o) * facets;
    sum = f * coat_leaves(wo, wi, false) + below * coat_leaves(wo, wi, true) + V8{coat, coat, coat};
  } else {
    sum = f + below;
  }
  return sheet_ ? sum + through : sum;
}

F8 Principled8::pdf_solid_angle(const V8& wo, const V8& wi) const {
  const M8 above = wi.z > F8(0.0f);
  const V8 m = ggx::half_vector(wo, wi);
  F8 pdf = p_diffuse_ * cosine_hemisphere_pdf_solid_angle(wi.z);
  pdf += p_gloss_ * masked(above & is_rough(alpha_), facets_.with_axes([&](const ggx::Alpha8& alpha) {
           return ggx::reflection_pdf_solid_angle(wo, wi, m, alpha);
         }));
  if (sheen_) {
    pdf += sheen_->p * Sheen8::pdf_solid_angle(wi.z);
  }
  if (sheet_) {
    pdf += sheet_->p * masked(wi.z < F8(0.0f), cosine_hemisphere_pdf_solid_angle(-wi.z));
  }
  if (has_glass_) {
    pdf += p_glass_ * glass_bsdf_.pdf_solid_angle(wo, wi);
  }
  if (has_coat_) {
    pdf += p_coat_ * masked(above & is_rough(coat_alpha_), ggx::reflection_pdf_solid_angle(wo, wi, m, coat_alpha_));
  }
  return pdf;
}

DeltaLobes8 Principled8::smooth(const V8& wo, const dielectric::Fresnel8& f) const {
  DeltaLobes8 lobes{masked(~is_rough(alpha_), gloss_fresnel(wo.z, F8(1.0f))), V8()};
  if (sheen_) {
    lobes.reflected = lobes.reflected * sheen_leaves({-wo.x, -wo.y, wo.z}, false);
  }
  if (has_glass_) {
    const DeltaLobes8 glass = glass_bsdf_.smooth(f);
    lobes.reflected = lobes.reflected + glass.reflected * glass_;
    lobes.refracted = glass.refracted * glass_;
  }
  if (has_coat_) {
    const F8 coat = masked(~is_rough(coat_alpha_), coat_fresnel(wo.z));
    lobes.reflected = lobes.reflected * coat_leaves(wo, {-wo.x, -wo.y, wo.z}, false) + V8{coat, coat, coat};
    lobes.refracted = lobes.refracted * coat_leaves(wo, {F8(0.0f), F8(0.0f), -f.cos_refracted}, false);
  }
  return lobes;
}

M8 Principled8::transmits() const {
  const M8 glass = glass_ > F8(0.0f);
  return sheet_ ? glass | (plastic_ * max_component(sheet_->transmittance) > F8(0.0f)) : glass;
}

V8 Principled8::rough_albedo() const {
  const V8 gloss = metal_albedo_ * metal_ + gloss_color_albedo_ * plastic_;
  V8 diffuse = base_ * (plastic_ * diffuse_albedo_);
  V8 through;
  if (sheet_) {
    diffuse = diffuse - base_ * sheet_->transmittance * (plastic_ * sheet_->lambert);
    through = sheet_->transmittance * (plastic_ * select(sheet_->inside, F8(1.0f), sheet_->at_wo));
  }
  const V8 glass = base_ * masked(glass_bsdf_.rough(), glass_);
  V8 opaque = diffuse + masked(is_rough(alpha_), gloss);
  if (sheen_) {
    const F8 albedo = sheen_->white.albedo();
    opaque = opaque * (F8(1.0f) - sheen_->weight * albedo) + sheen_->color * albedo;
  }
  const V8 sum = opaque + glass;
  if (!has_coat_) {
    return sheet_ ? sum + through : sum;
  }
  const F8 coat = masked(is_rough(coat_alpha_), coat_albedo_);
  const V8 coated = sum * (F8(1.0f) - coat_albedo_) + V8{coat, coat, coat};
  return sheet_ ? coated + through : coated;
}

Principled8::Drawn8 Principled8::draw(const V8& wo, Pair8 u, F8 choice) const {
  const M8 diffuse = choice < p_diffuse_;
  const F8 after_gloss = p_diffuse_ + p_gloss_;
  const M8 gloss = and_not(choice < after_gloss, diffuse);
  const F8 after_coat = after_gloss + p_coat_;
  const M8 coat = and_not(choice < after_coat, diffuse | gloss);
  F8 after_sheen = after_coat;
  M8 sheen;
  if (sheen_) {
    after_sheen = after_coat + sheen_->p;
    sheen = and_not(choice < after_sheen, diffuse | gloss | coat);
  }
  F8 after_sheet = after_sheen;
  M8 sheet;
  if (sheet_) {
    after_sheet = after_sheen + sheet_->p;
    sheet = and_not(choice < after_sheet, diffuse | gloss | coat | sheen);
  }
  const M8 glass = ~(diffuse | gloss | coat | sheen | sheet) & (p_glass_ > F8(0.0f));

  const M8 rough = is_rough(select(coat, coat_alpha_, facets_.alpha()));
  const V8 up{F8(0.0f), F8(0.0f), F8(1.0f)};
  const V8 visible = facets_.with_axes([&](const ggx::Alpha8& of) {
    const F8 y = select(coat, coat_alpha_, of.y);
    return ggx::sample_visible_normal(wo, of.isotropic ? ggx::Alpha8(y) : ggx::Alpha8(select(coat, y, of.x), y), u);
  });
  const V8 m = select(rough, visible, up);
  const V8 reflected = ggx::reflect(wo, m);
  Drawn8 d;
  d.wi = select(diffuse, square_to_cosine_hemisphere(u), reflected);
  d.smooth = and_not(gloss | coat, rough);
  V8 gloss_weight = gloss_fresnel(wo.z, F8(1.0f)) * (coat_leaves(wo, d.wi, false) / p_gloss_);
  if (sheen_) {
    d.wi = select(sheen, Sheen8::sample(u), d.wi);
    gloss_weight = gloss_weight * sheen_leaves(d.wi, false);
  }
  const F8 coat_weight = coat_fresnel(wo.z) / p_coat_;
  d.smooth_weight = select(coat, V8{coat_weight, coat_weight, coat_weight}, gloss_weight);
  d.valid = (diffuse | gloss | coat | sheen) & (d.wi.z > F8(0.0f));
  if (sheet_) {
    const V8 drawn = square_to_cosine_hemisphere(u);
    d.wi = select(sheet, V8{drawn.x, drawn.y, -drawn.z}, d.wi);
    d.valid = d.valid | (sheet & (d.wi.z < F8(0.0f)));
    d.through = sheet;
  }
  if (glass.any()) {
    const F8 rest = min(max((choice - after_sheet) / p_glass_, F8(0.0f)), F8(0x1.fffffep-1f));
    const BsdfSample8 s = glass_bsdf_.sample(wo, u, rest);
    d.wi = select(glass, s.wi, d.wi);
    d.smooth = d.smooth | and_not(glass, glass_bsdf_.rough());
    d.smooth_weight = select(glass, s.weight * (glass_ * coat_leaves(wo, s.wi, false) / p_glass_), d.smooth_weight);
    const M8 right_side = (s.transmitted & (s.wi.z < F8(0.0f))) | and_not(s.wi.z > F8(0.0f), s.transmitted);
    d.valid = d.valid | (glass & right_side);
    d.refracted = glass & s.transmitted;
    d.through = d.through | d.refracted;
  }
  return d;
}

BsdfSample8 Principled8::sample(const V8& wo, Pair8 u, F8 choice) const {
  const Drawn8 d = draw(wo, u, choice);
  const F8 pdf = masked(~d.smooth & d.valid, pdf_solid_angle(wo, d.wi));
  const V8 rough_weight = masked(pdf > F8(0.0f), eval(wo, d.wi) * (F8(1.0f) / pdf));
  return {d.wi, masked(d.valid, select(d.smooth, d.smooth_weight, rough_weight)), pdf, d.through,
          select(d.refracted, glass_bsdf_.eta, F8(1.0f))};
}

}  // namespace lightmill
