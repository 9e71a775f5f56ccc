#include "common/base/overloaded.h"
#include "common/wire/scene_parts.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {
namespace {

void to_wire_patch(const Patch& patch, v1::Meter::Patch* out) {
  to_wire_point(patch.corner, out->mutable_corner());
  to_wire_point(patch.edge1, out->mutable_edge1());
  to_wire_point(patch.edge2, out->mutable_edge2());
}

Result<Patch> patch_from_wire(const std::string& path, bool given, const v1::Meter::Patch& patch) {
  if (!given) {
    return invalid_argument("{}: must be given", path);
  }
  Patch out;
  LM_ASSIGN_OR_RETURN(out.corner, point_from_wire(path + ".corner", patch.has_corner(), patch.corner()));
  LM_ASSIGN_OR_RETURN(out.edge1, point_from_wire(path + ".edge1", patch.has_edge1(), patch.edge1()));
  LM_ASSIGN_OR_RETURN(out.edge2, point_from_wire(path + ".edge2", patch.has_edge2(), patch.edge2()));
  return out;
}

}  // namespace

void to_wire_meter(const Meter& meter, v1::Meter* out) {
  out->set_name(meter.name);
  std::visit(
      Overloaded{[&](const IrradianceMeter& kind) {
                   to_wire_point(kind.point, out->mutable_irradiance()->mutable_point());
                   to_wire_point(kind.normal, out->mutable_irradiance()->mutable_normal());
                 },
                 [&](const PatchMeter& kind) { to_wire_patch(kind.patch, out->mutable_patch()); },
                 [&](const RadianceMeter& kind) {
                   to_wire_point(kind.point, out->mutable_radiance()->mutable_point());
                   to_wire_point(kind.direction, out->mutable_radiance()->mutable_direction());
                 },
                 [&](const FluxMeter& kind) { to_wire_patch(kind.patch, out->mutable_flux()->mutable_patch()); }},
      meter.kind);
}

Result<Meter> meter_from_wire(const std::string& path, const v1::Meter& meter) {
  Meter out{meter.name(), {}};
  switch (meter.kind_case()) {
    case v1::Meter::kIrradiance: {
      const v1::Meter::Irradiance& kind = meter.irradiance();
      IrradianceMeter irradiance;
      LM_ASSIGN_OR_RETURN(irradiance.point,
                          point_from_wire(path + ".irradiance.point", kind.has_point(), kind.point()));
      LM_ASSIGN_OR_RETURN(irradiance.normal,
                          point_from_wire(path + ".irradiance.normal", kind.has_normal(), kind.normal()));
      out.kind = irradiance;
      return out;
    }
    case v1::Meter::kPatch: {
      LM_ASSIGN_OR_RETURN(const Patch patch, patch_from_wire(path + ".patch", true, meter.patch()));
      out.kind = PatchMeter{patch};
      return out;
    }
    case v1::Meter::kRadiance: {
      const v1::Meter::Radiance& kind = meter.radiance();
      RadianceMeter radiance;
      LM_ASSIGN_OR_RETURN(radiance.point, point_from_wire(path + ".radiance.point", kind.has_point(), kind.point()));
      LM_ASSIGN_OR_RETURN(radiance.direction,
                          point_from_wire(path + ".radiance.direction", kind.has_direction(), kind.direction()));
      out.kind = radiance;
      return out;
    }
    case v1::Meter::kFlux: {
      LM_ASSIGN_OR_RETURN(const Patch patch,
                          patch_from_wire(path + ".flux.patch", meter.flux().has_patch(), meter.flux().patch()));
      out.kind = FluxMeter{patch};
      return out;
    }
    case v1::Meter::KIND_NOT_SET:
      break;
  }
  return invalid_argument("{}: a kind of meter must be given. The kinds are irradiance, patch, radiance, flux", path);
}

}  // namespace lightmill
