#include "common/methods/film_channels.h"

#include <algorithm>

#include "common/base/check.h"

namespace lightmill {
namespace {

void store_plane(M8 lanes, U8 pixel, F8 value, float* plane) {
  alignas(32) float values[8];
  alignas(32) std::uint32_t at[8];
  value.store(values);
  pixel.store(at);
  for (unsigned bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
    const int lane = std::countr_zero(bits);
    plane[at[lane]] = values[lane];
  }
}

void store_vector(M8 lanes, U8 pixel, const V8& value, float* planes, std::size_t stride) {
  store_plane(lanes, pixel, value.x, planes);
  store_plane(lanes, pixel, value.y, planes + stride);
  store_plane(lanes, pixel, value.z, planes + 2 * stride);
}

}  // namespace

FilmChannels::FilmChannels(const std::vector<LayerSpec>& layers, const std::vector<std::string>& light_groups)
    : layout(layers) {
  int summed = 0, first = 0;
  for (const LayerSpec& layer : layers) {
    int& next = layer.kind == LayerKind::summed ? summed : first;
    for (const auto& [name, channel] : {std::pair<std::string_view, int*>{"direct", &direct},
                                        {"indirect", &indirect},
                                        {"caustic", &caustic},
                                        {kBiasLayer, &bias},
                                        {"albedo", &albedo},
                                        {"normal", &normal},
                                        {"features", &features},
                                        {"depth", &depth},
                                        {"id", &id}}) {
      if (layer.name == name) {
        *channel = next;
      }
    }
    if (layer.name == kRestLayer) {
      light.resize(light_groups.size() + 1, 0);
      std::ranges::replace(light, 0, next);  // beauty's channel belongs to no group
    } else if (const std::string_view group = light_group_of(layer.name); !group.empty()) {
      light.resize(light_groups.size() + 1, 0);
      const auto found = std::ranges::find(light_groups, group);
      LM_CHECK(found != light_groups.end(), "light group {}", group);
      light[static_cast<std::size_t>(found - light_groups.begin()) + 1] = next;
    }
    next += static_cast<int>(layer.channels);
  }
}

void store_surfaces(const FilmChannels& channels, const CompiledScene& scene, const Hit8& hits, const Surface8& surface,
                    U8 pixel, const SamplePlanes& planes) {
  const M8 lanes = hits.hit;
  const bool features = channels.features >= 0 && planes.first != nullptr;
  const V8 albedo = channels.albedo >= 0 || features ? scene.materials().albedo(surface, lanes) : V8();
  if (channels.albedo >= 0) {
    store_vector(lanes, pixel, albedo, planes.summed + channels.albedo * planes.summed_stride, planes.summed_stride);
  }
  if (planes.first == nullptr) {
    return;
  }
  const auto plane = [&](int channel) { return planes.first + channel * planes.first_stride; };
  const V8 normal = select(surface.front, surface.shading_normal, -surface.shading_normal);
  if (channels.normal >= 0) {
    store_vector(lanes, pixel, normal, plane(channels.normal), planes.first_stride);
  }
  const CameraBasis& camera = scene.camera();
  const F8 depth = dot(surface.point - broadcast(camera.position), broadcast(camera.forward)) *
                   F8(static_cast<float>(1 / scene.frame().scale()));
  if (channels.depth >= 0) {
    store_plane(lanes, pixel, depth, plane(channels.depth));
  }
  if (features) {
    store_vector(lanes, pixel, albedo, plane(channels.features), planes.first_stride);
    store_vector(lanes, pixel, normal, plane(channels.features + 3), planes.first_stride);
    store_plane(lanes & (depth > F8(0.0f)), pixel, F8(1.0f) / depth, plane(channels.features + 6));
  }
  if (channels.id >= 0) {
    store_plane(lanes, pixel, to_float(hits.geometry + U8(1u)), plane(channels.id));
  }
}

void complete_features(const FilmChannels& channels, bool half_b, std::size_t pixels, std::span<float> first) {
  if (channels.features < 0 || first.empty()) {
    return;
  }
  float* const half = first.data() + static_cast<std::size_t>(channels.features) * pixels;
  constexpr std::array<std::size_t, 4> kBegin{0, 3, 6, 7};  // albedo, normal, 1/depth
  for (std::size_t feature = 0; feature < 3; ++feature) {
    float* const square = half + (7 + feature) * pixels;
    for (std::size_t channel = kBegin[feature]; channel < kBegin[feature + 1]; ++channel) {
      for (std::size_t i = 0; i < pixels; ++i) {
        square[i] += half[channel * pixels + i] * half[channel * pixels + i];
      }
    }
  }
  if (half_b) {
    std::swap_ranges(half, half + 10 * pixels, half + 10 * pixels);
  }
}

}  // namespace lightmill
