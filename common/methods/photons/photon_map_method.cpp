// `photon-map`: the photon map, drawn as points.
//
// Shows one photon pass, the same in every sample: all photons of `ppm`, or with `caustic` those of `caustic`. A
// directly visible photon adds its power to one pixel, relative to the mean power of emitted photons. So a white photon
// that lost nothing is 1.
//
// Parameters
//   photons=N         photons (default: one for 16 pixels of the film, from 4096 to 65536)
//   caustic           only photons that met a caster first
//   no-absorption     media absorb nothing
//   brute-force       rays test every triangle
//   --max-bounces N   scatterings of a photon, at most (default 1000)
//
// Weaknesses
//   - Lights, and anything in or behind mirrors and glass, are not shown.
//   - More samples show the same photons.
//
// Example
//   lightmill render scenes/cornell-bench-balls.json --method photon-map:caustic --spp 1 -o photons.exr
#include "common/methods/factories.h"

#include "common/methods/camera_method.h"
#include "common/methods/photons/gather_pass.h"
#include "common/methods/photons/visible_splats.h"

namespace lightmill {
namespace {

class PhotonMapShader {
 public:
  PhotonMapShader(const CompiledScene& scene, const MethodSettings& settings, const MethodSpec& spec) : scene_(&scene) {
    photons::PhotonKind kind = spec.caustic ? photons::kCausticPhotons : photons::kGlobalPhotons;
    kind.splats = true;
    kind.gathers_near = false;
    passes_ = std::make_shared<const photons::GatherPasses>(scene, photons::pass_settings(settings, spec, kind));
  }

  V8 shade(const CameraHit8& /*at*/, RenderCounters& /*counters*/) const { return {}; }

  void add(const PixelRect& tile, float* planes, Workspace& workspace) const {
    const auto pass = passes_->pass(0, 1, workspace);
    if (pass == nullptr || pass->stored() == 0) {
      return;
    }
    const double photons = std::max<std::uint32_t>(pass->started, 1);
    const auto mean_power = static_cast<float>((pass->power.x + pass->power.y + pass->power.z) / (3 * photons));
    const F8 per_power(1 / mean_power);
    const std::size_t pixels = static_cast<std::size_t>(tile.pixel_count());
    std::vector<const photons::Splat*> splats;
    const auto draw = [&](M8 lanes, U8 at, const V8& power) {
      const VectorLanes colors(power * per_power);
      alignas(32) std::uint32_t pixel[8];
      at.store(pixel);
      for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
        const int lane = std::countr_zero(bits);
        for (int channel = 0; channel < 3; ++channel) {
          planes[static_cast<std::size_t>(channel) * pixels + pixel[lane]] += static_cast<float>(colors[lane][channel]);
        }
      }
    };
    photons::for_each_visible_splat(*scene_, *pass, tile, splats, workspace.counters,
                                    [&](const photons::VisibleSplat8& splat) {
                                      draw(splat.lanes, splat.pixel, splat.photon.power * splat.arrival.transmittance);
                                    });
    photons::for_each_visible_scatter(
        *scene_, *pass, tile, splats, workspace.counters,
        [&](const photons::VisibleScatter8& seen) { draw(seen.lanes, seen.pixel, seen.power); });
  }

 private:
  const CompiledScene* scene_;
  std::shared_ptr<const photons::GatherPasses> passes_;
};

}  // namespace

std::unique_ptr<Method> make_photon_map_method(ScenePointer scene, const MethodSettings& settings,
                                               const MethodSpec& spec) {
  PhotonMapShader shader(*scene, settings, spec);
  return make_camera_method(std::move(scene), settings, std::move(shader));
}

}  // namespace lightmill
