#include "common/methods/photons/photon_dots.h"

#include "common/methods/camera_method.h"
#include "common/methods/photons/seen_splats.h"

namespace lightmill {
namespace {

class DotShader {
 public:
  DotShader(const CompiledScene& scene, const MethodSettings& settings, const MethodSpec& spec)
      : scene_(&scene),
        light_side_(std::make_shared<const photons::LightSide>(
            scene,
            photons::LightSideSettings{settings.seed, settings.max_bounces == 0 ? kMaxBounces : settings.max_bounces,
                                       spec.photons.value_or(0), 0,
                                       spec.caustic ? photons::Followed::caustics : photons::Followed::all_light})) {}

  V8 shade(const CameraHit8& /*at*/, RenderCounters& /*counters*/) const { return {}; }

  void add(const PixelRect& tile, float* planes, Workspace& workspace) const {
    const auto pass = light_side_->pass(0, 1, workspace);
    if (pass == nullptr || pass->deposits.empty()) {
      return;
    }
    const F8 per_power(1 / pass->photon_power);
    const std::size_t pixels = static_cast<std::size_t>(tile.pixel_count());
    std::vector<const photons::Splat*> splats;
    photons::for_each_seen(*scene_, *pass, tile, splats, workspace.counters, [&](const photons::SeenSplat8& splat) {
      const VectorLanes colors(splat.deposit.power * splat.arrival.transmittance * per_power);
      alignas(32) std::uint32_t pixel[8];
      splat.pixel.store(pixel);
      for (auto bits = static_cast<unsigned>(splat.lanes.bits()); bits != 0; bits &= bits - 1) {
        const int lane = std::countr_zero(bits);
        for (int channel = 0; channel < 3; ++channel) {
          planes[static_cast<std::size_t>(channel) * pixels + pixel[lane]] += static_cast<float>(colors[lane][channel]);
        }
      }
    });
  }

 private:
  const CompiledScene* scene_;
  std::shared_ptr<const photons::LightSide> light_side_;
};

}  // namespace

std::unique_ptr<Method> make_photon_dots_method(std::shared_ptr<const CompiledScene> scene,
                                                const MethodSettings& settings, const MethodSpec& spec) {
  DotShader shader(*scene, settings, spec);
  return make_camera_method(std::move(scene), settings, std::move(shader));
}

}  // namespace lightmill
