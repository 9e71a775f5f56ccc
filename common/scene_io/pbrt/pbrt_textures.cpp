#include "common/scene_io/pbrt/pbrt_textures.h"

#include <algorithm>
#include <array>

#include "common/base/text.h"
#include "common/scene_io/tiny_image.h"

namespace lightmill {
namespace {

constexpr double kLargestFactor = 1e20;

RgbColor grey(double value) {
  const auto v = static_cast<float>(value);
  return {v, v, v};
}

RgbColor times(const RgbColor& a, const RgbColor& b) {
  return {a.r * b.r, a.g * b.g, a.b * b.b};
}

}  // namespace

Status PbrtTextures::define(const std::string& name, const std::string& kind, const std::string& type,
                            const PbrtParameters& from) {
  if (kind != "float" && kind != "spectrum") {
    return from.place().error("Texture \"{}\": float or spectrum is expected, got \"{}\"", name, kind);
  }
  Result<PbrtValue> value = value_of(kind, type, from);
  LM_RETURN_IF_ERROR(value.ok() ? from.finish(loaded_.faults) : ok_status());
  if (!(kind == "float" ? floats_ : spectra_by_name_).try_emplace(name, std::move(value)).second) {
    return from.place().error("there are two {} textures \"{}\"", kind, name);
  }
  return ok_status();
}

Result<PbrtValue> PbrtTextures::value_of(const std::string& kind, const std::string& type, const PbrtParameters& from) {
  if (type == "constant") {
    return either(kind, from, "value", 1);
  }
  if (type == "imagemap") {
    return image_map(from);
  }
  if (type == "scale") {
    return scaled(kind, from);
  }
  if (type == "mix") {
    return mixed(kind, from);
  }
  if (type == "checkerboard") {
    return checkerboard(kind, from);
  }
  return from.place().error("textures of the type \"{}\" cannot be rendered", type);
}

std::optional<PbrtValue> PbrtTextures::texture(const Defined& defined, const PbrtParameters& from,
                                               std::string_view name) {
  const PbrtParameter* found = from.find(name);
  if (found == nullptr || found->type != "texture") {
    return std::nullopt;
  }
  const std::string wanted = found->strings.size() == 1 ? found->strings[0] : "";
  const auto known = defined.find(wanted);
  if (known == defined.end()) {
    from.fail(name, fmt::format("there is no such texture \"{}\" before this line", wanted));
    return PbrtValue{};
  }
  if (!known->second.ok()) {
    from.fail(known->second.status());
    return PbrtValue{};
  }
  return *known->second;
}

PbrtValue PbrtTextures::color(const PbrtParameters& from, std::string_view name, const RgbColor& fallback,
                              double high) {
  std::optional<PbrtValue> value = texture(spectra_by_name_, from, name);
  if (!value) {
    return {(high == 1 ? spectra_.reflectance(from, name) : spectra_.coefficient(from, name)).value_or(fallback)};
  }
  const auto most = static_cast<float>(high);
  if (std::max({value->color.r, value->color.g, value->color.b}) > most) {
    notices_.once(fmt::format("factors of textures above {} are rendered as {}", high, high));
    value->color = {std::min(value->color.r, most), std::min(value->color.g, most), std::min(value->color.b, most)};
  }
  return *value;
}

PbrtValue PbrtTextures::number(const PbrtParameters& from, std::string_view name, double fallback) {
  if (const std::optional<PbrtValue> value = texture(floats_, from, name)) {
    return *value;
  }
  return {grey(from.number(name, fallback, -kLargestFactor, kLargestFactor))};
}

PbrtValue PbrtTextures::either(const std::string& kind, const PbrtParameters& from, std::string_view name,
                               double fallback) {
  return kind == "float" ? number(from, name, fallback) : color(from, name, grey(fallback), kLargestFactor);
}

Result<PbrtValue> PbrtTextures::scaled(const std::string& kind, const PbrtParameters& from) {
  const PbrtValue value = either(kind, from, "tex", 1), scale = number(from, "scale", 1);
  if (value.varies() && scale.varies()) {
    return from.place().error("a product of two images cannot be rendered");
  }
  return PbrtValue{times(value.color, scale.color), value.varies() ? value.texture : scale.texture};
}

Result<PbrtValue> PbrtTextures::mixed(const std::string& kind, const PbrtParameters& from) {
  const PbrtValue a = either(kind, from, "tex1", 0), b = either(kind, from, "tex2", 1),
                  share = number(from, "amount", 0.5);
  const float t = std::clamp(share.color.r, 0.0f, 1.0f);
  if (!share.varies() && (t == 0 || t == 1)) {
    return t == 0 ? a : b;
  }
  if (a.varies() || b.varies() || share.varies()) {
    return from.place().error("a mixture of images cannot be rendered");
  }
  const auto mix = [&](float x, float y) { return x * (1 - t) + y * t; };
  return PbrtValue{{mix(a.color.r, b.color.r), mix(a.color.g, b.color.g), mix(a.color.b, b.color.b)}};
}

Status PbrtTextures::place(const PbrtParameters& from, TextureImage& out) {
  if (const std::string mapping = from.text("mapping", "uv"); mapping != "uv") {
    return from.place().error("only the mapping \"uv\" can be rendered, got \"{}\"", mapping);
  }
  constexpr double kLimit = 1e6;
  out.scale = {from.number("uscale", 1, -kLimit, kLimit), from.number("vscale", 1, -kLimit, kLimit)};
  out.offset = {from.number("udelta", 0, -kLimit, kLimit), from.number("vdelta", 0, -kLimit, kLimit)};
  return ok_status();
}

/// Two by two squares: the lower left one is tex1.
Result<PbrtValue> PbrtTextures::checkerboard(const std::string& kind, const PbrtParameters& from) {
  const PbrtValue a = either(kind, from, "tex1", 1), b = either(kind, from, "tex2", 0);
  if (a.varies() || b.varies()) {
    return from.place().error("a checkerboard of images cannot be rendered");
  }
  if (from.whole("dimension", 2, 1, 3) != 2) {
    return from.place().error("only checkerboards of dimension 2 can be rendered");
  }
  TextureImage out;
  LM_RETURN_IF_ERROR(place(from, out));
  out.scale = {out.scale[0] / 2, out.scale[1] / 2};
  out.offset = {out.offset[0] / 2, out.offset[1] / 2};
  out.filter = TextureImage::Filter::nearest;
  out.color_space = TextureImage::ColorSpace::linear;
  const auto [largest, bytes] = two_by_two_image({b.color, a.color, a.color, b.color});
  if (!(largest > 0)) {
    return PbrtValue{{0, 0, 0}};
  }
  out.file = fmt::format("checkerboard of line {}.hdr", from.place().line);
  out.asset = add_image(bytes, {.name = out.file, .place = from.place().text()}, loaded_);
  return PbrtValue{grey(largest), add(std::move(out))};
}

Result<PbrtValue> PbrtTextures::image_map(const PbrtParameters& from) {
  TextureImage out;
  LM_RETURN_IF_ERROR(place(from, out));
  if (from.boolean("invert", false)) {
    return from.place().error("inverted images cannot be rendered");
  }
  const std::string wrap = from.text("wrap", "repeat"), filter = from.text("filter", "bilinear");
  if (wrap == "clamp" || wrap == "black") {
    out.wrap = {TextureImage::Wrap::clamp, TextureImage::Wrap::clamp};
  }
  if (wrap == "black") {
    notices_.once("textures with the wrap mode \"black\" are clamped");
  } else if (wrap != "repeat" && wrap != "clamp") {
    return from.place().error("unknown wrap mode \"{}\"", wrap);
  }
  out.filter = filter == "point" ? TextureImage::Filter::nearest : TextureImage::Filter::bilinear;
  from.find("maxanisotropy");
  const double scale = from.number("scale", 1, 0, kLargestFactor);
  const std::string encoding = from.text("encoding", "");
  if (encoding == "linear") {
    out.color_space = TextureImage::ColorSpace::linear;
  } else {
    if (encoding.starts_with("gamma")) {
      notices_.once("images with a gamma encoding are rendered as sRGB");
    }
    std::string name = from.text("filename", "");
    std::ranges::transform(name, name.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
    // pbrt decodes also those that are numbers.
    if (std::ranges::any_of(std::array{".png", ".tga", ".jpg", ".jpeg", ".bmp", ".gif"},
                            [&](const char* ending) { return name.ends_with(ending); })) {
      out.color_space = TextureImage::ColorSpace::srgb;
    }
  }
  const std::optional<Sha256> asset = image(from, "filename", out.file);
  if (!asset) {
    return PbrtValue{grey(scale)};
  }
  out.asset = *asset;
  return PbrtValue{grey(scale), add(std::move(out))};
}

std::optional<Sha256> PbrtTextures::image(const PbrtParameters& from, std::string_view name, std::string& file) {
  const std::string written = from.text(name, "");
  if (const auto known = images_.find(written); known != images_.end()) {
    file = known->second.second;
    return known->second.first;
  }
  Result<SourceFile> read = written.empty() ? Result<SourceFile>(not_found("no file is named")) : files_(written);
  if (!read.ok()) {
    if (read.status().code() != StatusCode::kNotFound) {
      from.fail(name, message_of(read.status()));
    } else {
      loaded_.faults.add("file " + written, fmt::format("{}: {}", from.place().text(), message_of(read.status())),
                         "the texture is left out");
    }
    return std::nullopt;
  }
  file = utf8_text(read->name);
  const Sha256 asset = add_image(std::move(read->bytes), {.name = file, .place = from.place().text()}, loaded_);
  images_.emplace(written, std::pair(asset, file));
  return asset;
}

std::uint32_t PbrtTextures::normal_map(const PbrtParameters& from) {
  if (!from.has("normalmap")) {
    return kNoTexture;
  }
  TextureImage out;
  out.color_space = TextureImage::ColorSpace::linear;
  const std::optional<Sha256> asset = image(from, "normalmap", out.file);
  if (!asset) {
    return kNoTexture;
  }
  out.asset = *asset;
  return add(std::move(out));
}

std::uint32_t PbrtTextures::add(TextureImage image) {
  const std::string key =
      fmt::format("{} {} {} {} {} {} {} {} {}", image.asset.hex(), image.file, static_cast<int>(image.filter),
                  static_cast<int>(image.wrap[0]), static_cast<int>(image.color_space), image.scale[0], image.scale[1],
                  image.offset[0], image.offset[1]);
  const auto [found, added] = added_.try_emplace(key, static_cast<std::uint32_t>(loaded_.scene.textures.size()));
  if (added) {
    image.name = fmt::format("{} ({})", image.file, loaded_.scene.textures.size());
    loaded_.scene.textures.push_back(std::move(image));
  }
  return found->second;
}

}  // namespace lightmill
