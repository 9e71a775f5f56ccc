#include "common/film/layers.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/suggestion.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

/// Layers with fixed names, in film order. Light groups precede the first layer that is not summed.
const std::array<LayerSpec, 9> kNamedLayers{{{"direct", 3, LayerKind::summed},
                                             {"indirect", 3, LayerKind::summed},
                                             {"caustic", 3, LayerKind::summed},
                                             {std::string(kBiasLayer), 3, LayerKind::summed},
                                             {"albedo", 3, LayerKind::summed},
                                             {"normal", 3, LayerKind::first_mean},
                                             {"features", 20, LayerKind::first_mean},
                                             {"depth", 1, LayerKind::first_nearest},
                                             {"id", 1, LayerKind::first_samples}}};

bool is_named_layer(std::string_view name) {
  return std::ranges::any_of(kNamedLayers, [&](const LayerSpec& layer) { return layer.name == name; });
}

Status check_name_of_layer(std::string_view name, std::span<const std::string> before) {
  if (!is_named_layer(name) && name != "beauty" && name != kRestLayer && !is_light_group_name(light_group_of(name))) {
    std::vector<std::string> known;
    std::ranges::transform(kNamedLayers, std::back_inserter(known), &LayerSpec::name);
    known.push_back("light:NAME for a light group");
    return invalid_argument("{}", unknown_text("layer", name, known));
  }
  if (std::ranges::find(before, name) != before.end()) {
    return invalid_argument("layer \"{}\" is named twice", name);
  }
  return ok_status();
}

}  // namespace

std::string_view light_group_of(std::string_view layer) {
  return layer.starts_with(kLightLayerPrefix) ? layer.substr(kLightLayerPrefix.size()) : std::string_view();
}

bool is_light_group_name(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= kMaxLightGroupName && name != "rest" && std::ranges::all_of(name, allowed);
}

Result<std::vector<LayerSpec>> film_layers(std::span<const std::string> names) {
  std::vector<LayerSpec> groups;
  for (std::size_t i = 0; i < names.size(); ++i) {
    LM_RETURN_IF_ERROR(check_name_of_layer(names[i], names.first(i)));
    if (is_light_group_name(light_group_of(names[i]))) {
      groups.push_back({names[i], 3, LayerKind::summed});
    }
  }
  if (groups.size() > kMaxLightGroups) {
    return invalid_argument("a film has at most {} light groups, got {}", kMaxLightGroups, groups.size());
  }
  const bool any_light = std::ranges::any_of(names, [](const auto& name) { return !light_group_of(name).empty(); });
  if (any_light) {
    groups.push_back({std::string(kRestLayer), 3, LayerKind::summed});
  }
  std::vector<LayerSpec> layers{LayerSpec{}};
  for (const LayerSpec& layer : kNamedLayers) {
    if (layer.kind != LayerKind::summed) {
      layers.insert(layers.end(), groups.begin(), groups.end());
      groups.clear();
    }
    if (std::ranges::find(names, layer.name) != names.end()) {
      layers.push_back(layer);
    }
  }
  return layers;
}

Status check_layers(const std::vector<LayerSpec>& layers) {
  std::vector<std::string> names;
  for (const LayerSpec& layer : layers) {
    names.push_back(layer.name);
  }
  LM_ASSIGN_OR_RETURN(const std::vector<LayerSpec> expected, film_layers(names));
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (i >= layers.size() || layers[i] != expected[i]) {
      return invalid_argument("layer {} must be '{}' with its {} channels, in the order that films have", i,
                              expected[i].name, expected[i].channels);
    }
  }
  return ok_status();
}

Status check_method_layers(std::string_view method, const std::vector<LayerSpec>& layers) {
  constexpr std::array<std::string_view, 9> kAll{"caustic", "direct",   "indirect", kBiasLayer, "albedo",
                                                 "normal",  "features", "depth",    "id"};
  const bool all = method_follows_all_light(method);
  const std::span<const std::string_view> known = std::span(kAll).subspan(method == "caustic" ? 0
                                                                          : all               ? 1
                                                                          : method == "ppm"   ? 3
                                                                                              : 4);
  for (const LayerSpec& layer : layers) {
    const bool light = all && !light_group_of(layer.name).empty();
    if (layer.name != "beauty" && !light && std::ranges::find(known, layer.name) == known.end()) {
      return invalid_argument("method {} has no layer \"{}\". It has {}{}", printable(method), layer.name,
                              fmt::join(known, ", "), layer.name == "caustic" ? ". The method caustic has it" : "");
    }
  }
  return ok_status();
}

std::vector<LayerSpec> all_layers(std::string_view method, std::span<const std::string> groups) {
  std::vector<std::string> names;
  const auto add_if_filled = [&](std::string name) {
    const auto layers = film_layers(std::array<std::string, 1>{name});
    if (layers.ok() && check_method_layers(method, *layers).ok()) {
      names.push_back(std::move(name));
    }
  };
  for (const LayerSpec& layer : kNamedLayers) {
    add_if_filled(layer.name);
  }
  for (const std::string& group : groups) {
    add_if_filled(std::string(kLightLayerPrefix) + group);
  }
  return *film_layers(names);
}

Status check_light_groups(const std::vector<LayerSpec>& layers, std::span<const std::string> groups) {
  for (const LayerSpec& layer : layers) {
    const std::string_view group = light_group_of(layer.name);
    if (!group.empty() && layer.name != kRestLayer && std::ranges::find(groups, group) == groups.end()) {
      return invalid_argument("the scene has no light group \"{}\". It has {}", group,
                              groups.empty() ? "none" : fmt::format("{}", fmt::join(groups, ", ")));
    }
  }
  return ok_status();
}

bool method_follows_all_light(std::string_view method) {
  return method == "path" || method == "caustic" || method == "vcm" || method == "auto";
}

bool method_reads_meters(std::string_view method) {
  return method_follows_all_light(method) || method == "ppm";
}

std::optional<LayerSlice> layer_slice(std::string_view layer, const std::vector<LayerSpec>& layers) {
  const auto found = std::ranges::find(layers, layer, &LayerSpec::name);
  if (found == layers.end()) {
    return std::nullopt;
  }
  LayerSlice slice{found->kind, 0, found->channels};
  for (auto before = layers.begin(); before != found; ++before) {
    slice.first += before->kind == found->kind ? before->channels : 0;
  }
  return slice;
}

NodeLayout::NodeLayout(const std::vector<LayerSpec>& layers) : summed(0) {
  for (const LayerSpec& layer : layers) {
    switch (layer.kind) {
      case LayerKind::summed:
        if (layer.name == kBiasLayer) {
          bias = static_cast<int>(summed);
        }
        summed += layer.channels;
        break;
      case LayerKind::first_mean:
        first_mean += layer.channels;
        break;
      case LayerKind::first_nearest:
        first_nearest += layer.channels;
        break;
      case LayerKind::first_samples:
        first_samples += layer.channels;
        break;
    }
  }
}

void append_first(const NodeLayout& layout, std::size_t pixels, std::vector<float>& into, std::uint32_t into_samples,
                  std::span<const float> values, std::uint32_t samples) {
  LM_CHECK(into.size() == layout.first_values(into_samples) * pixels);
  LM_CHECK(values.size() == layout.first_values(samples) * pixels);
  if (samples == 0) {
    return;
  }
  if (into_samples == 0) {
    into.assign(values.begin(), values.end());
    return;
  }
  const std::size_t means = layout.first_mean * pixels;
  const std::size_t nearest_end = means + layout.first_nearest * pixels;
  for (std::size_t i = 0; i < means; ++i) {
    into[i] += values[i];
  }
  for (std::size_t i = means; i < nearest_end; ++i) {
    into[i] = into[i] == 0 ? values[i] : values[i] == 0 ? into[i] : std::min(into[i], values[i]);
  }
  into.insert(into.end(), values.begin() + static_cast<std::ptrdiff_t>(nearest_end), values.end());
}

}  // namespace lightmill
