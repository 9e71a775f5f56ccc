#include <algorithm>

#include "common/base/overloaded.h"
#include "common/lights/photometry.h"
#include "common/scene/validate/validate.h"
#include "common/wire/scene_parts.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {
namespace {

// ---- strengths ----

const LightUnit& unit_of(const v1::Strength& strength) {
  const auto* field = v1::Strength::descriptor()->FindFieldByNumber(strength.quantity_case());
  return *std::find_if(std::begin(kLightUnits), std::end(kLightUnits),
                       [&](const LightUnit& unit) { return unit.name == field->name(); });
}

double amount_of(const v1::Strength& strength) {
  const auto* field = v1::Strength::descriptor()->FindFieldByNumber(strength.quantity_case());
  return strength.GetReflection()->GetDouble(strength, field);
}

/// The value of one unit of each quantity, in the unit in which the light is stored. 0 if the light has no such
/// strength.
struct UnitScales {
  double flux = 0, intensity = 0, irradiance = 0, radiance = 0;
  double of(LightQuantity quantity) const {
    const double all[] = {flux, intensity, irradiance, radiance};
    return all[static_cast<int>(quantity)];
  }
};

std::string names_of_possible_units(const UnitScales& scales) {
  std::string names;
  for (const LightUnit& unit : kLightUnits) {
    if (scales.of(unit.quantity) > 0) {
      names += fmt::format("{}{}", names.empty() ? "" : ", ", unit.name);
    }
  }
  return names;
}

/// The strength as an RGB value. `path` names the strength.
Result<RgbColor> strength_from_wire(const std::string& path, const v1::Strength& strength, const UnitScales& scales) {
  if (strength.quantity_case() == v1::Strength::QUANTITY_NOT_SET) {
    return invalid_argument("{}: must be given in one of the units {}", path, names_of_possible_units(scales));
  }
  const LightUnit& unit = unit_of(strength);
  const double scale = scales.of(unit.quantity);
  if (!(scale > 0)) {
    return invalid_argument("{}.{}: one of the units {} is expected here", path, unit.name,
                            names_of_possible_units(scales));
  }
  const double amount = amount_of(strength);
  LM_RETURN_IF_ERROR(check_range(fmt::format("{}.{}", path, unit.name), amount, 0, kMaxPower));
  RgbColor color{1, 1, 1};
  if (strength.has_color()) {
    LM_ASSIGN_OR_RETURN(color, color_from_wire(path + ".color", true, strength.color()));
  }
  LM_RETURN_IF_ERROR(check_power(path + ".color", color));
  if (is_black(color)) {
    return invalid_argument("{}.color: must not be black. An amount of 0 turns the light off", path);
  }
  const Vec3d out = with_luminance(Vec3d(color.r, color.g, color.b), radiometric_amount(unit, amount) * scale);
  return RgbColor{static_cast<float>(out.x), static_cast<float>(out.y), static_cast<float>(out.z)};
}

/// The strength of a light: its colour `field`, else `light.strength`, else `fallback` if there is one.
Result<RgbColor> light_strength(const std::string& path, const std::string& field, const v1::Light& light, bool given,
                                const v1::Color& color, const UnitScales& scales, const RgbColor* fallback = nullptr) {
  if (!light.has_strength()) {
    return !given && fallback != nullptr ? *fallback : color_from_wire(path + field, given, color);
  }
  if (given) {
    return invalid_argument("{}.strength: give either strength or {}", path, field.substr(1));
  }
  return strength_from_wire(path + ".strength", light.strength(), scales);
}

// ---- kinds of light ----

Result<PointLight> point_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Point& wire = light.point();
  PointLight out;
  LM_ASSIGN_OR_RETURN(out.position, point_from_wire(path + ".point.position", wire.has_position(), wire.position()));
  LM_ASSIGN_OR_RETURN(out.intensity, light_strength(path, ".point.intensity", light, wire.has_intensity(),
                                                    wire.intensity(), {.flux = 1 / kPointSolidAngle, .intensity = 1}));
  out.radius = wire.radius();
  return out;
}

Result<DirectionalLight> directional_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Directional& wire = light.directional();
  DirectionalLight out;
  LM_ASSIGN_OR_RETURN(out.direction,
                      point_from_wire(path + ".directional.direction", wire.has_direction(), wire.direction()));
  LM_ASSIGN_OR_RETURN(out.irradiance, light_strength(path, ".directional.irradiance", light, wire.has_irradiance(),
                                                     wire.irradiance(), {.irradiance = 1}));
  out.angle_degrees = wire.angle_degrees();
  return out;
}

Result<SpotLight> spot_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Spot& wire = light.spot();
  SpotLight out;
  LM_ASSIGN_OR_RETURN(out.position, point_from_wire(path + ".spot.position", wire.has_position(), wire.position()));
  LM_ASSIGN_OR_RETURN(out.direction, point_from_wire(path + ".spot.direction", wire.has_direction(), wire.direction()));
  out.cutoff_degrees = wire.has_cutoff_degrees() ? wire.cutoff_degrees() : out.cutoff_degrees;
  out.blend = wire.blend();
  out.radius = wire.radius();
  // Values out of range are reported later, by validate.
  const double outer = std::clamp(out.cutoff_degrees, kMinCutoffDegrees, 180.0) * kPiDouble / 180;
  const double inner = outer * (1 - std::clamp(out.blend, 0.0, 1.0));
  const double solid_angle = spot_solid_angle(one_minus_cos_fixed(inner), one_minus_cos_fixed(outer));
  LM_ASSIGN_OR_RETURN(out.intensity, light_strength(path, ".spot.intensity", light, wire.has_intensity(),
                                                    wire.intensity(), {.flux = 1 / solid_angle, .intensity = 1}));
  return out;
}

Result<CosinePowerLight> cosine_power_light(const std::string& path, const v1::Light& light) {
  const v1::Light::CosinePower& wire = light.cosine_power();
  CosinePowerLight out;
  LM_ASSIGN_OR_RETURN(out.position,
                      point_from_wire(path + ".cosine_power.position", wire.has_position(), wire.position()));
  LM_ASSIGN_OR_RETURN(out.direction,
                      point_from_wire(path + ".cosine_power.direction", wire.has_direction(), wire.direction()));
  out.exponent = wire.has_exponent() ? wire.exponent() : out.exponent;
  LM_ASSIGN_OR_RETURN(
      out.intensity,
      light_strength(path, ".cosine_power.intensity", light, wire.has_intensity(), wire.intensity(),
                     {.flux = 1 / cosine_power_solid_angle(std::max(out.exponent, 0.0)), .intensity = 1}));
  return out;
}

/// By default +x, or +z for directions along x.
Point3d up_from_wire(bool given, const v1::Vec3& up, const Point3d& direction) {
  if (given) {
    return {up.x(), up.y(), up.z()};
  }
  return direction[1] == 0 && direction[2] == 0 ? Point3d{0, 0, 1} : Point3d{1, 0, 0};
}

/// The fields that disks and rectangles share. `out` has its size.
template <class Wire>
Result<DiskLight> one_sided_light(const std::string& path, const v1::Light& light, const Wire& wire, DiskLight out) {
  const std::string field = fmt::format(".{}.", out.kind_name());
  LM_ASSIGN_OR_RETURN(out.position, point_from_wire(path + field + "position", wire.has_position(), wire.position()));
  LM_ASSIGN_OR_RETURN(out.direction,
                      point_from_wire(path + field + "direction", wire.has_direction(), wire.direction()));
  out.up = up_from_wire(wire.has_up(), wire.up(), out.direction);
  out.spread_degrees = wire.has_spread_degrees() ? wire.spread_degrees() : out.spread_degrees;
  // Values out of range are reported later, by validate.
  const bool has_area = out.radius > 0 && out.second_radius > 0;
  const double area = has_area ? out.area() : 1;
  const double spread = std::clamp(out.spread_degrees, kMinSpreadDegrees, 180.0);
  const double exitance = spread_exitance_per_radiance(spread * kPiDouble / 180);
  LM_ASSIGN_OR_RETURN(out.radiance,
                      light_strength(path, field + "radiance", light, wire.has_radiance(), wire.radiance(),
                                     {.flux = 1 / (exitance * area), .irradiance = 1 / exitance, .radiance = 1}));
  return out;
}

Result<DiskLight> disk_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Disk& wire = light.disk();
  DiskLight out;
  out.radius = wire.has_radius() ? wire.radius() : out.radius;
  out.second_radius = wire.has_second_radius() ? wire.second_radius() : out.radius;
  return one_sided_light(path, light, wire, out);
}

Result<DiskLight> rectangle_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Rectangle& wire = light.rectangle();
  DiskLight out;
  out.rectangular = true;
  out.second_radius = wire.has_width() ? wire.width() / 2 : 0.5;
  out.radius = wire.has_height() ? wire.height() / 2 : out.second_radius;
  return one_sided_light(path, light, wire, out);
}

Result<IesLight> ies_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Ies& wire = light.ies();
  if (light.has_strength()) {
    return invalid_argument("{}.strength: an IES file has its own strength: change it with ies.scale", path);
  }
  IesLight out;
  LM_ASSIGN_OR_RETURN(out.position, point_from_wire(path + ".ies.position", wire.has_position(), wire.position()));
  if (wire.has_direction()) {
    out.direction = {wire.direction().x(), wire.direction().y(), wire.direction().z()};
  }
  out.up = up_from_wire(wire.has_up(), wire.up(), out.direction);
  if (wire.has_color()) {
    LM_ASSIGN_OR_RETURN(out.color, color_from_wire(path + ".ies.color", true, wire.color()));
  }
  out.scale = wire.has_scale() ? wire.scale() : out.scale;
  if (wire.file().empty() && wire.asset().empty()) {
    return invalid_argument("{}.ies.file: must be given", path);
  }
  out.file = wire.file();
  return out;
}

Result<EnvironmentLight> environment_light(const std::string& path, const v1::Light& light) {
  const v1::Light::Environment& wire = light.environment();
  EnvironmentLight out;
  LM_ASSIGN_OR_RETURN(out.radiance,
                      light_strength(path, ".environment.radiance", light, wire.has_radiance(), wire.radiance(),
                                     {.irradiance = 1 / kHemisphereIrradiance, .radiance = 1}, &out.radiance));
  if (wire.has_scale()) {
    LM_RETURN_IF_ERROR(check_range(path + ".environment.scale", wire.scale(), 0, kMaxPower));
    const auto scaled = [&](float x) { return static_cast<float>(x * wire.scale()); };
    out.radiance = {scaled(out.radiance.r), scaled(out.radiance.g), scaled(out.radiance.b)};
  }
  out.rotation_degrees = wire.rotation_degrees();
  out.equal_area = wire.mapping() == v1::Light::Environment::EQUAL_AREA;
  if (const auto& given = wire.orientation(); !given.empty()) {
    if (given.size() != 9) {
      return invalid_argument("{}.environment.orientation: needs 9 numbers, got {}", path, given.size());
    }
    out.orientation.emplace();
    for (int i = 0; i < 9; ++i) {
      (*out.orientation)[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(i % 3)] = given[i];
    }
  }
  out.file = wire.file();
  out.has_image = !wire.file().empty() || !wire.asset().empty();
  return out;
}

template <class Kind>
Status take(Result<Kind> kind, Light& out) {
  if (kind.ok()) {
    out.kind = *std::move(kind);
  }
  return kind.status();
}

}  // namespace

Result<Light> light_from_wire(const std::string& path, const v1::Light& light) {
  Light out;
  out.name = light.name();
  out.group = light.group();
  out.hidden_from_camera = light.hidden_from_camera();
  const auto read = [&]() -> Status {
    switch (light.kind_case()) {
      case v1::Light::kPoint:
        return take(point_light(path, light), out);
      case v1::Light::kDirectional:
        return take(directional_light(path, light), out);
      case v1::Light::kSpot:
        return take(spot_light(path, light), out);
      case v1::Light::kCosinePower:
        return take(cosine_power_light(path, light), out);
      case v1::Light::kDisk:
        return take(disk_light(path, light), out);
      case v1::Light::kRectangle:
        return take(rectangle_light(path, light), out);
      case v1::Light::kIes:
        return take(ies_light(path, light), out);
      case v1::Light::kEnvironment:
        return take(environment_light(path, light), out);
      case v1::Light::KIND_NOT_SET:
        break;
    }
    return invalid_argument(
        "{}: a kind of light must be given. The kinds are point, directional, spot, cosine_power, disk, rectangle, "
        "ies, environment",
        path);
  };
  LM_RETURN_IF_ERROR(read());
  return out;
}

Status light_asset_from_wire(const std::string& path, const v1::Light& light, Light& out) {
  if (auto* ies = std::get_if<IesLight>(&out.kind)) {
    LM_ASSIGN_OR_RETURN(ies->asset, asset_from_wire(path + ".ies.asset", light.ies().asset()));
  } else if (auto* environment = std::get_if<EnvironmentLight>(&out.kind);
             environment != nullptr && environment->has_image) {
    LM_ASSIGN_OR_RETURN(environment->asset, asset_from_wire(path + ".environment.asset", light.environment().asset()));
  }
  return ok_status();
}

void to_wire_light(const Light& light, v1::Light* out) {
  out->set_name(light.name);
  out->set_group(light.group);
  out->set_hidden_from_camera(light.hidden_from_camera);
  std::visit(Overloaded{
                 [&](const PointLight& point) {
                   to_wire_point(point.position, out->mutable_point()->mutable_position());
                   to_wire_color(point.intensity, out->mutable_point()->mutable_intensity());
                   out->mutable_point()->set_radius(point.radius);
                 },
                 [&](const DirectionalLight& sun) {
                   to_wire_point(sun.direction, out->mutable_directional()->mutable_direction());
                   to_wire_color(sun.irradiance, out->mutable_directional()->mutable_irradiance());
                   out->mutable_directional()->set_angle_degrees(sun.angle_degrees);
                 },
                 [&](const SpotLight& spot) {
                   to_wire_point(spot.position, out->mutable_spot()->mutable_position());
                   to_wire_point(spot.direction, out->mutable_spot()->mutable_direction());
                   to_wire_color(spot.intensity, out->mutable_spot()->mutable_intensity());
                   out->mutable_spot()->set_cutoff_degrees(spot.cutoff_degrees);
                   out->mutable_spot()->set_blend(spot.blend);
                   out->mutable_spot()->set_radius(spot.radius);
                 },
                 [&](const CosinePowerLight& cosine_power) {
                   v1::Light::CosinePower* wire = out->mutable_cosine_power();
                   to_wire_point(cosine_power.position, wire->mutable_position());
                   to_wire_point(cosine_power.direction, wire->mutable_direction());
                   to_wire_color(cosine_power.intensity, wire->mutable_intensity());
                   wire->set_exponent(cosine_power.exponent);
                 },
                 [&](const DiskLight& disk) {
                   const auto set = [&](auto* wire) {
                     to_wire_point(disk.position, wire->mutable_position());
                     to_wire_point(disk.direction, wire->mutable_direction());
                     to_wire_color(disk.radiance, wire->mutable_radiance());
                     to_wire_point(disk.up, wire->mutable_up());
                     wire->set_spread_degrees(disk.spread_degrees);
                   };
                   if (disk.rectangular) {
                     set(out->mutable_rectangle());
                     out->mutable_rectangle()->set_width(2 * disk.second_radius);
                     out->mutable_rectangle()->set_height(2 * disk.radius);
                   } else {
                     set(out->mutable_disk());
                     out->mutable_disk()->set_radius(disk.radius);
                     out->mutable_disk()->set_second_radius(disk.second_radius);
                   }
                 },
                 [&](const IesLight& ies) {
                   to_wire_point(ies.position, out->mutable_ies()->mutable_position());
                   to_wire_point(ies.direction, out->mutable_ies()->mutable_direction());
                   to_wire_point(ies.up, out->mutable_ies()->mutable_up());
                   to_wire_color(ies.color, out->mutable_ies()->mutable_color());
                   out->mutable_ies()->set_scale(ies.scale);
                   out->mutable_ies()->set_file(ies.file);
                   out->mutable_ies()->set_asset(ies.asset.hex());
                 },
                 [&](const EnvironmentLight& environment) {
                   v1::Light::Environment* wire = out->mutable_environment();
                   to_wire_color(environment.radiance, wire->mutable_radiance());
                   wire->set_rotation_degrees(environment.rotation_degrees);
                   if (environment.equal_area) {
                     wire->set_mapping(v1::Light::Environment::EQUAL_AREA);
                   }
                   if (environment.orientation) {
                     for (const Point3d& row : *environment.orientation) {
                       wire->mutable_orientation()->Add(row.begin(), row.end());
                     }
                   }
                   if (environment.has_image) {
                     wire->set_file(environment.file);
                     wire->set_asset(environment.asset.hex());
                   }
                 },
             },
             light.kind);
}

// ---- emission of materials ----

void to_wire_emission(const Material& material, const std::vector<TextureImage>& textures, v1::Material* out) {
  if (material.emission_unit == EmissionUnit::flux) {
    to_wire_color(material.emission.rgb, out->mutable_emission_flux());
  } else if (material.emission != TexturedColor{}) {
    to_wire_textured(material.emission, textures, out->mutable_emission());
  }
  out->set_two_sided_emission(material.two_sided_emission);
  out->set_emission_exponent(material.emission_exponent);
}

Status emission_from_wire(const std::string& path, const v1::Material& material, const TextureNames& textures,
                          Material& out) {
  out.two_sided_emission = material.two_sided_emission();
  out.emission_exponent = material.emission_exponent();
  if (material.has_emission() + material.has_emission_strength() + material.has_emission_flux() > 1) {
    return invalid_argument("{}: only one of emission, emission_strength and emission_flux can be given", path);
  }
  if (material.has_emission()) {
    LM_ASSIGN_OR_RETURN(out.emission, textured_from_wire(path + ".emission", true, material.emission(), textures));
  } else if (material.has_emission_flux()) {
    out.emission_unit = EmissionUnit::flux;
    LM_ASSIGN_OR_RETURN(out.emission.rgb, color_from_wire(path + ".emission_flux", true, material.emission_flux()));
  } else if (material.has_emission_strength()) {
    const v1::Strength& strength = material.emission_strength();
    LM_ASSIGN_OR_RETURN(
        out.emission.rgb,
        strength_from_wire(
            path + ".emission_strength", strength,
            {.flux = 1, .irradiance = 1 / exitance_per_radiance(std::max(out.emission_exponent, 0.0)), .radiance = 1}));
    const bool flux = unit_of(strength).quantity == LightQuantity::flux;
    out.emission_unit = flux ? EmissionUnit::flux : EmissionUnit::radiance;
  }
  return ok_status();
}

}  // namespace lightmill
