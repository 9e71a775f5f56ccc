#include "common/scene_io/gltf/gltf_materials.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/text.h"
#include "common/scene_io/assets.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxImageNameBytes = 500;  ///< of an image

RgbColor to_rgb(const std::array<double, 3>& c, double scale = 1) {
  return {static_cast<float>(c[0] * scale), static_cast<float>(c[1] * scale), static_cast<float>(c[2] * scale)};
}

/// The file ending for an image, from its first bytes. Nothing if it is not of a kind that glTF allows.
std::optional<std::string_view> ending_of(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) {
    return ".png";
  }
  if (bytes.starts_with("\xff\xd8\xff")) {
    return ".jpg";
  }
  if (bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP")) {
    return ".webp";
  }
  if (bytes.starts_with("DDS ")) {
    return ".dds";
  }
  return std::nullopt;
}

/// σ such that exp(−σ · distance) is the colour (KHR_materials_volume).
RgbColor absorption(const std::array<double, 3>& color, double distance) {
  std::array<double, 3> sigma{};
  for (std::size_t i = 0; i < 3; ++i) {
    sigma[i] = color[i] > 0 ? std::min(std::max(-std::log(color[i]), 0.0) / distance, kMaxAbsorption) : kMaxAbsorption;
  }
  return to_rgb(sigma);
}

}  // namespace

GltfMaterials::Used GltfMaterials::use(const JsonNode& index) {
  const JsonNode from = data_.element("materials", index);
  const auto [found, added] = used_.try_emplace(from.present() ? from.path() : "", Used{});
  if (added) {
    texture_set_ = std::nullopt;
    Material material = map(from.tolerant());
    found->second = {static_cast<std::uint32_t>(loaded_.scene.materials.size()), texture_set_,
                     from["extensions"]["KHR_materials_unlit"].present(),
                     material.normal_map.texture != kNoTexture || is_anisotropic(material), is_anisotropic(material)};
    loaded_.scene.materials.push_back(std::move(material));
  }
  return found->second;
}

Material GltfMaterials::map(const JsonNode& from) {
  Material out;
  out.name = unique_name(from["name"].text(), from.present() ? from.path() : "default material");
  const JsonNode extensions = from["extensions"];
  out.two_sided_emission = from["doubleSided"].boolean(false);
  if (extensions["KHR_materials_unlit"].present()) {
    const JsonNode base = from["pbrMetallicRoughness"];
    out.kind = DiffuseMaterial{{RgbColor{}, kNoTexture}};
    const auto color = base["baseColorFactor"].numbers<4>({1, 1, 1, 1}, 0, 1);
    out.emission = {to_rgb({color[0], color[1], color[2]}),
                    texture(base["baseColorTexture"], TextureImage::ColorSpace::srgb)};
    out.two_sided_emission = true;
    out.opacity = opacity(from, color[3], out.emission.texture);
    notices_.once("unlit materials are rendered as black ones that emit their colour");
    return out;
  }
  const double strength = extensions["KHR_materials_emissive_strength"]["emissiveStrength"].number(1, 0, 1e15);
  out.emission.rgb = to_rgb(from["emissiveFactor"].numbers<3>({0, 0, 0}, 0, 1e6), strength);
  if (out.emission.rgb != RgbColor{}) {
    const JsonNode map = from["emissiveTexture"];
    out.emission.texture = texture(map, TextureImage::ColorSpace::srgb);
    if (map.present() && out.emission.texture == kNoTexture) {
      out.emission.rgb = {};  // most of such a map is black
    }
  }
  const PrincipledMaterial kind = principled(from, out.interior);
  // Green is roughness and blue metallic.
  if (const std::uint32_t map =
          texture(from["pbrMetallicRoughness"]["metallicRoughnessTexture"], TextureImage::ColorSpace::linear);
      map != kNoTexture) {
    if (kind.roughness > 0) {
      out.roughness_map = {map, ScalarMap::Channel::g};
    }
    if (kind.metallic > 0) {
      out.metallic_map = {map, ScalarMap::Channel::b};
    }
  }
  out.kind = kind;
  out.opacity = opacity(from, from["pbrMetallicRoughness"]["baseColorFactor"].numbers<4>({1, 1, 1, 1}, 0, 1)[3],
                        kind.base_color.texture);
  if (out.opacity.mode != Opacity::Mode::opaque && is_boundary(out)) {
    notices_.left_out("alpha of materials that transmit light");
    out.opacity = {};
  }
  const JsonNode normal = from["normalTexture"];
  if (const std::uint32_t map = texture(normal, TextureImage::ColorSpace::linear); map != kNoTexture) {
    out.normal_map = {map, normal["scale"].number(1, -1e6, 1e6)};
    if (kind.coat > 0) {
      notices_.once("normal maps also change the normals of clearcoats");
    }
  }
  set_diffuse_transmission(extensions["KHR_materials_diffuse_transmission"], kind, out);
  say_left_out(from);
  return out;
}

/// `value` and `texture`: the base colour's alpha.
Opacity GltfMaterials::opacity(const JsonNode& from, double value, std::uint32_t texture) {
  const std::string mode = from["alphaMode"].text("OPAQUE");
  if (mode == "OPAQUE") {
    return {};
  }
  if (mode != "MASK" && mode != "BLEND") {
    from["alphaMode"].fault(fmt::format("OPAQUE, MASK or BLEND is expected, got \"{}\"", mode.substr(0, 40)),
                            "the material is rendered opaque");
    return {};
  }
  Opacity out{mode == "MASK" ? Opacity::Mode::mask : Opacity::Mode::blend, value};
  if (texture != kNoTexture) {
    out.map = {texture, ScalarMap::Channel::alpha};
  }
  const double cutoff = from["alphaCutoff"].number(out.cutoff, 0, JsonNode::kAnything);
  out.cutoff = std::min(cutoff, 1.0);
  if (out.mode == Opacity::Mode::mask && cutoff > 1) {
    return {Opacity::Mode::blend, 0};  // no alpha is above 1
  }
  return out;
}

PrincipledMaterial GltfMaterials::principled(const JsonNode& from, Medium& interior) {
  PrincipledMaterial out;
  const JsonNode base = from["pbrMetallicRoughness"], extensions = from["extensions"];
  const auto color = base["baseColorFactor"].numbers<4>({1, 1, 1, 1}, 0, 1);
  out.base_color = {to_rgb({color[0], color[1], color[2]}),
                    texture(base["baseColorTexture"], TextureImage::ColorSpace::srgb)};
  out.metallic = base["metallicFactor"].number(1, 0, 1);
  out.roughness = base["roughnessFactor"].number(1, 0, 1);
  const JsonNode coat = extensions["KHR_materials_clearcoat"], transmission = extensions["KHR_materials_transmission"];
  using enum ScalarMap::Channel;
  out.coat = coat["clearcoatFactor"].number(0, 0, 1);
  out.coat_roughness = coat["clearcoatRoughnessFactor"].number(0, 0, 1);
  if (out.coat > 0) {
    out.coat_map = scalar_map(coat["clearcoatTexture"], r);
    if (out.coat_roughness > 0) {
      out.coat_roughness_map = scalar_map(coat["clearcoatRoughnessTexture"], g);
    }
  }
  out.transmission = transmission["transmissionFactor"].number(0, 0, 1);
  if (out.transmission > 0) {
    out.transmission_map = scalar_map(transmission["transmissionTexture"], r);
  }
  set_gloss(extensions, out);
  set_anisotropy(extensions["KHR_materials_anisotropy"], out);
  set_sheen(extensions["KHR_materials_sheen"], out);
  if (out.transmission == 0 || (out.metallic == 1 && !base["metallicRoughnessTexture"].present())) {
    return out;  // no light gets in
  }
  if (out.anisotropy.strength > 0) {
    notices_.left_out("anisotropy of glass");
  }
  if (!is_black(out.sheen_color)) {
    notices_.left_out("sheen of glass");
  }
  const PrincipledMaterial plain;
  if (out.specular != plain.specular || out.specular_color != plain.specular_color ||
      out.specular_map != plain.specular_map) {
    notices_.left_out("specular factor and colour of glass");
  }
  const JsonNode volume = extensions["KHR_materials_volume"];
  const double thickness = volume["thicknessFactor"].number(0, 0, JsonNode::kAnything);
  if (thickness == 0) {
    notices_.once("materials that transmit without a volume are rendered as solid glass: light is refracted");
  }
  if (const JsonNode distance = volume["attenuationDistance"]; distance.present() && thickness > 0) {
    interior.absorption = absorption(volume["attenuationColor"].numbers<3>({1, 1, 1}, 0, 1),
                                     std::max(distance.number(1, 0, JsonNode::kAnything), 1e-30));
  }
  return out;
}

/// A factor multiplies the gloss, and a colour its reflectance at normal incidence, which is at most 1. An index of 0
/// reflects all light (KHR_materials_ior), times these two.
void GltfMaterials::set_gloss(const JsonNode& extensions, PrincipledMaterial& out) {
  const JsonNode specular = extensions["KHR_materials_specular"];
  const double factor = specular["specularFactor"].number(1, 0, 1);
  auto color = specular["specularColorFactor"].numbers<3>({1, 1, 1}, 0, 1e6);
  out.ior = extensions["KHR_materials_ior"]["ior"].number(1.5, 0, 1e9);
  if (out.transmission > 0) {
    out.ior = std::min(out.ior, kMaxIor);
  }
  if (out.ior == 0 && out.transmission > 0) {
    notices_.left_out("an index of refraction of 0 where light is transmitted: it is 1.5");
    out.ior = 1.5;
  }
  const double of_ior = out.ior > 0 ? std::pow((out.ior - 1) / (out.ior + 1), 2) : 1;
  for (double& c : color) {
    c = std::min(c, 1 / std::max(of_ior, 1e-9));
  }
  // A component above 1 raises the index. That of 0 follows from the largest component, so that the diffuse part has the rest.
  const double most = std::max({color[0], color[1], color[2], out.ior > 0 ? 1.0 : 1e-9});
  out.specular = std::min(factor * most / 2, 1.0);
  out.specular_color = {to_rgb({color[0] / most, color[1] / most, color[2] / most}),
                        texture(specular["specularColorTexture"], TextureImage::ColorSpace::srgb)};
  if (out.specular > 0) {
    out.specular_map = scalar_map(specular["specularTexture"], ScalarMap::Channel::alpha);
  }
  if (out.transmission > 0 || (most == 1 && out.ior > 0 && out.ior <= kMaxIor)) {
    return;
  }
  // The index with this reflectance at normal incidence. `specular` adds what the largest index lacks.
  const double reflectance = most * of_ior, root = std::min(std::sqrt(reflectance), (kMaxIor - 1) / (kMaxIor + 1));
  out.ior = std::min((1 + root) / (1 - root), kMaxIor);
  out.specular = root > 0 ? factor * reflectance / (2 * root * root) : 0;
}

void GltfMaterials::set_anisotropy(const JsonNode& from, PrincipledMaterial& out) {
  out.anisotropy.strength = from["anisotropyStrength"].number(0, 0, 1);
  out.anisotropy.rotation_degrees = from["anisotropyRotation"].number(0, -100, 100) * 180 / std::numbers::pi;
  if (out.anisotropy.strength == 0) {
    out.anisotropy = {};
    return;
  }
  if (from["anisotropyTexture"].present()) {
    notices_.left_out("textures of anisotropy: it is the same everywhere");
  }
}

void GltfMaterials::set_sheen(const JsonNode& from, PrincipledMaterial& out) {
  const RgbColor color = to_rgb(from["sheenColorFactor"].numbers<3>({0, 0, 0}, 0, 1));
  if (is_black(color)) {
    return;
  }
  out.sheen_color = {color, texture(from["sheenColorTexture"], TextureImage::ColorSpace::srgb)};
  out.sheen_roughness = from["sheenRoughnessFactor"].number(0, 0, 1);
  if (out.sheen_roughness > 0) {
    out.sheen_roughness_map = scalar_map(from["sheenRoughnessTexture"], ScalarMap::Channel::alpha);
  }
}

/// Mixes the material with a thin sheet. The highlights of the rest become brighter, because the sheet has none.
void GltfMaterials::set_diffuse_transmission(const JsonNode& from, PrincipledMaterial kind, Material& out) {
  const double factor = from["diffuseTransmissionFactor"].number(0, 0, 1) * (1 - kind.metallic);
  if (factor == 0) {
    return;
  }
  if (is_boundary(out)) {
    notices_.left_out("diffuse transmission of glass");
    return;
  }
  notices_.once("diffuse transmission is rendered as a mixture with a thin sheet that has no highlights");
  kind.specular = std::min(kind.specular / std::max(1 - factor, 1e-3), 1.0);
  Material rest, sheet;
  rest.kind = kind;
  rest.roughness_map = std::exchange(out.roughness_map, {});
  rest.metallic_map = std::exchange(out.metallic_map, {});
  const RgbColor color = to_rgb(from["diffuseTransmissionColorFactor"].numbers<3>({1, 1, 1}, 0, 1));
  sheet.kind = DiffuseMaterial{
      {0, 0, 0}, 0, {color, texture(from["diffuseTransmissionColorTexture"], TextureImage::ColorSpace::srgb)}};
  const std::uint32_t map = texture(from["diffuseTransmissionTexture"], TextureImage::ColorSpace::linear);
  out.kind = MixtureMaterial{std::make_shared<const Material>(std::move(rest)),
                             std::make_shared<const Material>(std::move(sheet)),
                             factor,
                             {map, ScalarMap::Channel::alpha}};
}

void GltfMaterials::say_left_out(const JsonNode& from) {
  const JsonNode extensions = from["extensions"];
  const std::array<std::pair<JsonNode, std::string_view>, 3> parts{
      {{from["occlusionTexture"], "occlusion maps (light is followed instead)"},
       {extensions["KHR_materials_volume"]["thicknessTexture"], "textures of thickness (the shape itself counts)"},
       {extensions["KHR_materials_clearcoat"]["clearcoatNormalTexture"], "normal maps of clearcoats"}}};
  for (const auto& [part, what] : parts) {
    if (part.present()) {
      notices_.left_out(what);
    }
  }
}

ScalarMap GltfMaterials::scalar_map(const JsonNode& info, ScalarMap::Channel channel) {
  const std::uint32_t found = texture(info, TextureImage::ColorSpace::linear);
  return found == kNoTexture ? ScalarMap{} : ScalarMap{found, channel};
}

TextureImage::Wrap GltfMaterials::wrap_of(const JsonNode& mode) {
  constexpr std::uint64_t kRepeat = 10497, kClamp = 33071, kMirror = 33648;
  switch (mode.whole(kRepeat, 0, 100'000)) {
    case kClamp:
      return TextureImage::Wrap::clamp;
    case kMirror:
      return TextureImage::Wrap::mirror;
    default:
      notices_.once("textures with an unknown wrap mode are repeated");
      [[fallthrough]];
    case kRepeat:
      return TextureImage::Wrap::repeat;
  }
}

std::uint32_t GltfMaterials::texture(const JsonNode& info, TextureImage::ColorSpace color_space) {
  constexpr std::uint64_t kNearest = 9728;
  const JsonNode from = data_.element("textures", info["index"]).tolerant();
  if (!from.present()) {
    return kNoTexture;
  }
  JsonNode source_index = from["source"];
  if (const JsonNode extensions = from["extensions"]; !source_index.present() && !extensions.keys().empty()) {
    std::string_view extension = "unknown extensions";
    for (const char* name : {"KHR_texture_basisu", "EXT_texture_avif"}) {
      extension = extensions[name].present() ? name : extension;
    }
    for (const std::string_view name : {kWebpTextures, kDdsTextures}) {
      source_index = extensions[name].present() ? extensions[name]["source"] : source_index;
    }
    if (!source_index.present()) {
      notices_.left_out(fmt::format("textures whose only image is of {}", extension));
      return kNoTexture;
    }
  }
  TextureImage out;
  const JsonNode sampler = data_.element("samplers", from["sampler"]);
  if (sampler["magFilter"].whole(0, 0, 100'000) == kNearest) {
    out.filter = TextureImage::Filter::nearest;
  }
  out.wrap = {wrap_of(sampler["wrapS"]), wrap_of(sampler["wrapT"])};
  out.color_space = color_space;
  const JsonNode transform = info["extensions"]["KHR_texture_transform"];
  const auto scale = transform["scale"].numbers<2>({1, 1}, -1e6, 1e6);
  const auto offset = transform["offset"].numbers<2>({0, 0}, -1e6, 1e6);
  out.scale = scale;
  // glTF's v is 1 − v, and its matrix is [cos sin; −sin cos] (https://github.com/KhronosGroup/glTF/issues/1563).
  const double rotation = transform["rotation"].number(0, -100, 100);
  out.rotation_degrees = rotation * 180 / std::numbers::pi;
  out.offset = {offset[0] + scale[1] * std::sin(rotation), 1 - scale[1] * std::cos(rotation) - offset[1]};
  const JsonNode set_of = transform["texCoord"].present() ? transform["texCoord"] : info["texCoord"];
  const std::uint64_t set = set_of.whole(0, 0, 1000);
  if (texture_set_.value_or(set) != set) {
    notices_.left_out("textures with other texture coordinates than the first texture of their material");
    return kNoTexture;
  }
  const JsonNode source = data_.element("images", source_index);
  const std::optional<Sha256> asset = image(source, out.file);
  if (!asset) {
    if (!source_index.present()) {
      source_index.fail("an image is expected");
    }
    return kNoTexture;
  }
  texture_set_ = set;
  out.asset = *asset;
  const std::string key =
      fmt::format("{} {} {} {} {} {} {} {} {} {} {}", asset->hex(), out.file, static_cast<int>(out.filter),
                  static_cast<int>(out.wrap[0]), static_cast<int>(out.wrap[1]), static_cast<int>(out.color_space),
                  out.scale[0], out.scale[1], out.rotation_degrees, out.offset[0], out.offset[1]);
  const auto [found, added] = textures_.try_emplace(key, static_cast<std::uint32_t>(loaded_.scene.textures.size()));
  if (added) {
    out.name = fmt::format("{} ({})", out.file, loaded_.scene.textures.size());
    loaded_.scene.textures.push_back(std::move(out));
  }
  return found->second;
}

std::optional<Sha256> GltfMaterials::image(const JsonNode& image, std::string& file) {
  if (!image.present()) {
    return std::nullopt;
  }
  if (const auto known = images_.find(image.path()); known != images_.end()) {
    file = known->second.second;
    return known->second.first;
  }
  const std::string uri = image["uri"].text();
  Result<std::string> read = uri.empty() ? std::string(data_.view(image["bufferView"])) : data_.uri_bytes(image["uri"]);
  if (read.status().code() == StatusCode::kNotFound) {
    image["uri"].fault(message_of(read.status()), "the textures with it are left out");
    return std::nullopt;
  }
  std::string bytes = std::move(read).value_or("");
  const std::optional<std::string_view> ending = ending_of(bytes);
  if (!ending || !data_.status().ok()) {
    image.fail("PNG, JPEG, WebP or DDS is expected");
    return std::nullopt;
  }
  const std::string name = image["name"].text();
  // Each texture with this image has a copy.
  file = cut_text(utf8_text(!uri.empty() && !uri.starts_with("data:") ? uri
                            : name.empty()                            ? image.path()
                                                                      : name),
                  kMaxImageNameBytes);
  if (!file.ends_with(*ending)) {
    file += *ending;
  }
  const std::string place = fmt::format("{}: {}", file_name_, image.path());
  const Sha256 asset = add_image(std::move(bytes), {.name = file, .place = place}, loaded_);
  images_.emplace(image.path(), std::pair(asset, file));
  return asset;
}

std::string GltfMaterials::unique_name(std::string name, std::string_view fallback) {
  name = scene_name(name.empty() ? fallback : name);
  std::string unique = name;
  for (int& number = numbers_.try_emplace(name, 1).first->second; !names_.insert(unique).second;) {
    unique = fmt::format("{} ({})", name, ++number);
  }
  return unique;
}

}  // namespace lightmill
