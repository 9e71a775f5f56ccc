#include "common/scene_io/mitsuba/mitsuba_textures.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/base/text.h"
#include "common/scene_io/tiny_image.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr double kLargestColor = 1e20;

RgbColor grey_of(double value) {
  const auto v = static_cast<float>(value);
  return {v, v, v};
}

RgbColor rgb_of_numbers(const std::vector<double>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

bool all_within(const RgbColor& color, double low, double high) {
  return std::min({color.r, color.g, color.b}) >= low && std::max({color.r, color.g, color.b}) <= high;
}

/// Indices of refraction at 589 nm (Hecht, Optics).
std::optional<double> known_ior(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, double>, 23> kMedia{
      {{"vacuum", 1},        {"helium", 1.000036},        {"hydrogen", 1.000132},
       {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.333},
       {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
       {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
       {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
       {"pyrex", 1.47},      {"acrylic glass", 1.49},     {"polypropylene", 1.49},
       {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
       {"pet", 1.575},       {"diamond", 2.419}}};
  const auto* found = std::ranges::find_if(kMedia, [&](const auto& one) {
    return std::ranges::equal(one.first, name, {}, {}, [](unsigned char c) { return std::tolower(c); });
  });
  return found == kMedia.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

std::optional<Spectrum> MitsubaTextures::samples(const MitsubaObject& from, const MitsubaParameter& parameter) {
  Result<Spectrum> out = read_spectrum(parameter.numbers, parameter.text, files_);
  if (!out.ok()) {
    from.fail(parameter.name, message_of(out.status()));
    return std::nullopt;
  }
  return *std::move(out);
}

std::optional<RgbColor> MitsubaTextures::plain(const MitsubaObject& from, const MitsubaParameter& parameter,
                                               Kind kind) {
  if (parameter.type == "float" || parameter.type == "integer") {
    return grey_of(parameter.numbers[0]);
  }
  if (parameter.type == "rgb") {
    return rgb_of_numbers(parameter.numbers);
  }
  if (parameter.type != "spectrum") {
    from.fail(parameter.name, "a colour, spectrum or texture is expected");
    return std::nullopt;
  }
  if (parameter.numbers.size() == 1 && kind == Kind::surface) {
    return grey_of(parameter.numbers[0]);
  }
  if (parameter.numbers.size() == 1) {
    // A uniform spectrum is not white.
    const RgbColor even = radiated_color({{300, 900}, {1, 1}});
    const auto scaled = [&](float x) { return static_cast<float>(x * parameter.numbers[0]); };
    return RgbColor{scaled(even.r), scaled(even.g), scaled(even.b)};
  }
  const std::optional<Spectrum> spectrum = samples(from, parameter);
  if (!spectrum) {
    return std::nullopt;
  }
  if (kind == Kind::light) {
    return radiated_color(*spectrum);
  }
  const RgbColor color = reflected_color(*spectrum);
  return RgbColor{std::min(color.r, 1.0f), std::min(color.g, 1.0f), std::min(color.b, 1.0f)};
}

TexturedColor MitsubaTextures::value(const MitsubaObject& from, std::string_view name, const RgbColor& fallback,
                                     Kind kind) {
  const double high = kind == Kind::surface ? 1 : kLargestColor;
  if (const MitsubaParameter* parameter = from.find(name)) {
    const RgbColor color = plain(from, *parameter, kind).value_or(fallback);
    if (!all_within(color, 0, high)) {
      from.fail(name, fmt::format("must be from 0 to {}", high));
      return fallback;
    }
    return color;
  }
  const MitsubaObject* nested = from.child(name);
  if (nested == nullptr) {
    return fallback;
  }
  if (nested->tag != "texture") {
    from.fail(name, "a colour, spectrum or texture is expected");
    return fallback;
  }
  return texture(from, *nested, kind);
}

TexturedColor MitsubaTextures::color(const MitsubaObject& from, std::string_view name, const RgbColor& fallback) {
  return value(from, name, fallback, Kind::surface);
}

TexturedColor MitsubaTextures::light(const MitsubaObject& from, std::string_view name) {
  return value(from, name, {1, 1, 1}, Kind::light);
}

RgbColor MitsubaTextures::plain_light(const MitsubaObject& from, std::string_view name) {
  const TexturedColor out = light(from, name);
  if (out.texture != kNoTexture) {
    from.fail(name, "textures cannot be rendered here");
  }
  return out.rgb;
}

RgbColor MitsubaTextures::coefficient(const MitsubaObject& from, std::string_view name, double fallback, double high) {
  const MitsubaParameter* parameter = from.find(name);
  if (parameter == nullptr) {
    if (from.child(name) != nullptr) {
      from.fail(name, "only colours and spectra can be rendered here");
    }
    return grey_of(fallback);
  }
  const RgbColor out = plain(from, *parameter, Kind::surface).value_or(grey_of(fallback));
  if (!all_within(out, 0, high)) {
    from.fail(name, fmt::format("must be from 0 to {}", high));
    return grey_of(fallback);
  }
  return out;
}

TexturedColor MitsubaTextures::number(const MitsubaObject& from, std::string_view name, double fallback, double low,
                                      double high) {
  const MitsubaParameter* parameter = from.find(name);
  const bool colored =
      parameter == nullptr ? from.child(name) != nullptr : parameter->type == "rgb" || parameter->type == "spectrum";
  if (!colored) {
    return grey_of(from.number(name, fallback, low, high));
  }
  const TexturedColor out = color(from, name, grey_of(fallback));
  if (out.texture == kNoTexture && (out.rgb.r != out.rgb.g || out.rgb.g != out.rgb.b)) {
    from.fail(name, "a number is expected");
  }
  return out;
}

RgbColor MitsubaTextures::metal(const MitsubaObject& from, std::string_view name, double fallback) {
  const MitsubaParameter* parameter = from.find(name);
  if (parameter == nullptr || parameter->type != "spectrum" || parameter->numbers.size() == 1) {
    return coefficient(from, name, fallback, kMaxComplexIndex);
  }
  const std::optional<Spectrum> spectrum = samples(from, *parameter);
  const RgbColor out = spectrum ? at_red_green_blue(*spectrum) : grey_of(fallback);
  if (!all_within(out, 0, kMaxComplexIndex)) {
    from.fail(name, fmt::format("must be at most {}", kMaxComplexIndex));
    return grey_of(fallback);
  }
  return out;
}

double MitsubaTextures::medium_ior(const MitsubaObject& from, std::string_view name, std::string_view fallback) {
  const MitsubaParameter* parameter = from.find(name);
  if (parameter != nullptr && parameter->type != "string") {
    return from.number(name, 1, 1e-3, 1e3);
  }
  const std::optional<double> known = known_ior(from.text(name, std::string(fallback)));
  if (!known) {
    from.fail(name, "a number or the name of a known medium is expected");
  }
  return known.value_or(1);
}

double MitsubaTextures::ior(const MitsubaObject& from, std::string_view fallback) {
  const double out = medium_ior(from, "int_ior", fallback) / medium_ior(from, "ext_ior", "air");
  if (!(out <= kMaxIor)) {
    from.fail("int_ior", fmt::format("must be at most {} times ext_ior", kMaxIor));
    return 1.5;
  }
  return out;
}

TexturedColor MitsubaTextures::texture(const MitsubaObject& user, const MitsubaObject& from, Kind kind) {
  constexpr int kMaxNested = 50;
  const std::pair key(&from, kind);
  auto found = known_.find(key);
  if (found == known_.end()) {
    if (nesting_ == kMaxNested) {
      user.fail(from.place.error("textures are nested more than {} deep", kMaxNested));
      return {1, 1, 1};
    }
    ++nesting_;
    found = known_.emplace(key, read(from, kind)).first;
    --nesting_;
  }
  if (!found->second.ok()) {
    user.fail(found->second.status());
    return {1, 1, 1};
  }
  return *found->second;
}

std::uint32_t MitsubaTextures::data(const MitsubaObject& user, const MitsubaObject& from) {
  return texture(user, from, Kind::surface).texture;
}

Result<TexturedColor> MitsubaTextures::read(const MitsubaObject& from, Kind kind) {
  TexturedColor out(1, 1, 1);
  if (from.type == "bitmap") {
    out = bitmap(from);
  } else if (from.type == "checkerboard") {
    out = checkerboard(from);
  } else if (from.type == "uniform" || from.type == "srgb") {
    const std::string_view name = from.type == "srgb" ? "color" : "value";
    const MitsubaParameter* parameter = from.find(name);
    if (parameter == nullptr) {
      return from.place.error("{}: {} is missing", from.what(), name);
    }
    out = plain(from, *parameter, kind).value_or(RgbColor{1, 1, 1});
    if (!all_within(out.rgb, 0, kind == Kind::surface ? 1 : kLargestColor)) {
      from.fail(name, fmt::format("must be from 0 to {}", kind == Kind::surface ? 1 : kLargestColor));
    }
  } else {
    return from.place.error("textures of the type \"{}\" cannot be rendered", from.type);
  }
  LM_RETURN_IF_ERROR(from.finish(loaded_.faults));
  return out;
}

/// Our v is 1 − v of Mitsuba. So is that of the transformed coordinates.
void MitsubaTextures::place(const MitsubaObject& from, TextureImage& out) {
  constexpr double kLimit = 1e6;
  Transform to_uv = from.transform("to_uv");
  if (!from.has("to_uv")) {  // in files before version 2
    to_uv = compose(scaling({from.number("uscale", 1), from.number("vscale", 1), 1}),
                    translation({from.number("uoffset", 0), from.number("voffset", 0), 0}));
  }
  const double a = to_uv[0][0], b = to_uv[0][1], c = to_uv[1][0], d = to_uv[1][1];
  out.scale = {a, d};
  if (b != 0 || c != 0) {  // our matrix is [a −b; −c d]
    out.scale = {std::hypot(a, c), std::hypot(b, d)};
    if (!(std::abs(a * b + c * d) <= 1e-6 * out.scale[0] * out.scale[1] && out.scale[0] > 0)) {
      from.fail("to_uv", "only scales, then a rotation, then a translation can be rendered");
      out.scale = {1, 1};
    }
    out.scale[1] = std::copysign(out.scale[1], a * d - b * c);
    out.rotation_degrees = std::atan2(-c, a) * 180 / std::numbers::pi;
  }
  out.offset = {b + to_uv[0][3], 1 - d - to_uv[1][3]};
  for (std::size_t i = 0; i < 2; ++i) {
    if (!(std::abs(out.scale[i]) <= kLimit && std::abs(out.offset[i]) <= kLimit)) {
      from.fail("to_uv", fmt::format("numbers must be at most {}", kLimit));
      out.scale = {1, 1};
      out.offset = {0, 0};
    }
  }
}

TexturedColor MitsubaTextures::bitmap(const MitsubaObject& from) {
  TextureImage out;
  place(from, out);
  const std::string wrap = from.text("wrap_mode", "repeat"), filter = from.text("filter_type", "bilinear");
  if (wrap == "clamp" || wrap == "mirror") {
    out.wrap.fill(wrap == "clamp" ? TextureImage::Wrap::clamp : TextureImage::Wrap::mirror);
  } else if (wrap != "repeat") {
    from.fail("wrap_mode", "repeat, mirror or clamp is expected");
  }
  if (filter == "nearest") {
    out.filter = TextureImage::Filter::nearest;
  } else if (filter != "bilinear") {
    from.fail("filter_type", "nearest or bilinear is expected");
  }
  if (from.boolean("raw", false)) {
    out.color_space = TextureImage::ColorSpace::linear;
  }
  from.ignore({"format", "accel"});
  const std::string written = from.text("filename", "");
  auto known = images_.find(written);
  if (known == images_.end()) {
    Result<SourceFile> file = written.empty() ? Result<SourceFile>(not_found("no file is named")) : files_(written);
    if (!file.ok()) {
      if (file.status().code() != StatusCode::kNotFound) {
        from.fail("filename", message_of(file.status()));
      } else {
        loaded_.faults.add("file " + written, fmt::format("{}: {}", from.place.text(), message_of(file.status())),
                           "the texture is left out");
      }
      return {1, 1, 1};
    }
    std::string name = utf8_text(file->name);
    const Sha256 asset = add_image(std::move(file->bytes), {.name = name, .place = from.place.text()}, loaded_);
    known = images_.emplace(written, std::pair(asset, std::move(name))).first;
  }
  std::tie(out.asset, out.file) = known->second;
  return add(from, std::move(out), 1);
}

/// Two by two squares. Where u and v are both below or both above 1/2, there is color0.
TexturedColor MitsubaTextures::checkerboard(const MitsubaObject& from) {
  const TexturedColor a = color(from, "color0", grey_of(0.4)), b = color(from, "color1", grey_of(0.2));
  if (a.texture != kNoTexture || b.texture != kNoTexture) {
    from.fail(from.place.error("{}: textures in it cannot be rendered", from.what()));
  }
  TextureImage out;
  place(from, out);
  out.filter = TextureImage::Filter::nearest;
  out.color_space = TextureImage::ColorSpace::linear;
  auto [factor, bytes] = two_by_two_image({a.rgb, b.rgb, b.rgb, a.rgb});
  if (!(factor > 0)) {
    return {0, 0, 0};
  }
  out.file = fmt::format("checkerboard of line {}.hdr", from.place.line);
  out.asset = add_image(std::move(bytes), {.name = out.file, .place = from.place.text()}, loaded_);
  return add(from, std::move(out), factor);
}

TexturedColor MitsubaTextures::add(const MitsubaObject& from, TextureImage image, float factor) {
  if (loaded_.scene.textures.size() == kMaxSceneEntries) {
    from.fail(from.place.error("there are more than {} textures", kMaxSceneEntries));
    return {1, 1, 1};
  }
  image.name = fmt::format("{} ({})", image.file, loaded_.scene.textures.size());
  loaded_.scene.textures.push_back(std::move(image));
  return {{factor, factor, factor}, static_cast<std::uint32_t>(loaded_.scene.textures.size() - 1)};
}

}  // namespace lightmill
