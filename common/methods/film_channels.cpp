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
  if (channels.albedo >= 0) {
    store_vector(lanes, pixel, scene.materials().albedo(surface, lanes),
                 planes.summed + channels.albedo * planes.summed_stride, planes.summed_stride);
  }
  if (planes.first == nullptr) {
    return;
  }
  const auto plane = [&](int channel) { return planes.first + channel * planes.first_stride; };
  if (channels.normal >= 0) {
    const V8 normal = select(surface.front, surface.shading_normal, -surface.shading_normal);
    store_vector(lanes, pixel, normal, plane(channels.normal), planes.first_stride);
  }
  if (channels.depth >= 0) {
    const CameraBasis& camera = scene.camera();
    const F8 depth = dot(surface.point - broadcast(camera.position), broadcast(camera.forward));
    store_plane(lanes, pixel, depth * F8(static_cast<float>(1 / scene.frame().scale())), plane(channels.depth));
  }
  if (channels.id >= 0) {
    store_plane(lanes, pixel, to_float(hits.geometry + U8(1u)), plane(channels.id));
  }
}

}  // namespace lightmill
