#include "common/scene_io/pbrt/pbrt_spectra.h"

#include <algorithm>
#include <iterator>

namespace lightmill {
namespace {

constexpr double kLargest = 1e20;

/// The only string of a spectrum that is given by a name. Empty if it is given by values.
std::string_view name_of(const PbrtParameter& parameter) {
  return parameter.type == "spectrum" && parameter.strings.size() == 1 && parameter.numbers.empty()
             ? std::string_view(parameter.strings[0])
             : std::string_view();
}

}  // namespace

std::optional<Spectrum> PbrtSpectra::samples(const PbrtParameters& from, const PbrtParameter& parameter) {
  const std::string name(name_of(parameter));
  for (const std::string_view known : {"metal-", "glass-", "stdillum-"}) {
    if (name.starts_with(known)) {
      from.fail(parameter.name, fmt::format("the spectrum \"{}\" is unknown, or cannot be used here", name));
      return std::nullopt;
    }
  }
  Result<Spectrum> out = read_spectrum(parameter.numbers, name, files_);
  if (!out.ok()) {
    from.fail(parameter.name, message_of(out.status()));
    return std::nullopt;
  }
  return *std::move(out);
}

std::optional<RgbColor> PbrtSpectra::rgb(const PbrtParameters& from, const PbrtParameter& parameter, double high) {
  const std::vector<double>& v = parameter.numbers;
  if (v.size() != 3 || !std::ranges::all_of(v, [&](double x) { return x >= 0 && x <= high; })) {
    from.fail(parameter.name, fmt::format("three numbers from 0 to {} are expected", high));
    return std::nullopt;
  }
  return RgbColor{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

std::optional<RgbColor> PbrtSpectra::light(const PbrtParameters& from, std::string_view name) {
  const PbrtParameter* found = from.find(name);
  if (found == nullptr) {
    return std::nullopt;
  }
  if (found->type == "rgb") {
    return rgb(from, *found, kLargest);
  }
  if (const std::string_view illuminant = name_of(*found); illuminant.starts_with("stdillum-")) {
    if (const std::optional<RgbColor> color = illuminant_color(illuminant.substr(9))) {
      return color;
    }
  }
  std::optional<Spectrum> spectrum;
  if (found->type == "blackbody") {
    if (found->numbers.size() != 1 || !(found->numbers[0] >= 100 && found->numbers[0] <= 1e7)) {
      from.fail(name, "one temperature from 100 to 1e7 kelvins is expected");
      return std::nullopt;
    }
    spectrum = blackbody(found->numbers[0]);
  } else if (found->type == "spectrum") {
    spectrum = samples(from, *found);
  } else {
    from.fail(name, "the type rgb, blackbody or spectrum is expected");
  }
  if (!spectrum) {
    return std::nullopt;
  }
  return light_color(*spectrum).value_or(RgbColor{});
}

std::optional<RgbColor> PbrtSpectra::surface(const PbrtParameters& from, std::string_view name, double high) {
  const PbrtParameter* found = from.find(name);
  if (found == nullptr) {
    return std::nullopt;
  }
  if (found->type == "rgb") {
    return rgb(from, *found, high);
  }
  if (found->type != "spectrum") {
    from.fail(name, "the type rgb or spectrum is expected");
    return std::nullopt;
  }
  const std::optional<Spectrum> spectrum = samples(from, *found);
  if (!spectrum) {
    return std::nullopt;
  }
  const RgbColor color = reflected_color(*spectrum);
  const auto within = [&](float x) { return std::min(x, static_cast<float>(high)); };
  return RgbColor{within(color.r), within(color.g), within(color.b)};
}

std::optional<RgbColor> PbrtSpectra::reflectance(const PbrtParameters& from, std::string_view name) {
  return surface(from, name, 1);
}

std::optional<RgbColor> PbrtSpectra::coefficient(const PbrtParameters& from, std::string_view name) {
  return surface(from, name, kLargest);
}

std::optional<RgbColor> PbrtSpectra::metal(const PbrtParameters& from, std::string_view name, std::string_view part) {
  const PbrtParameter* found = from.find(name);
  if (found == nullptr) {
    return std::nullopt;
  }
  if (found->type == "rgb") {
    return rgb(from, *found, kMaxComplexIndex);
  }
  if (found->type == "float" && found->numbers.size() == 1 && found->numbers[0] >= 0 &&
      found->numbers[0] <= kMaxComplexIndex) {
    const auto value = static_cast<float>(found->numbers[0]);
    return RgbColor{value, value, value};
  }
  std::string_view known = name_of(*found);
  if (known.starts_with("metal-") && known.ends_with(fmt::format("-{}", part))) {
    known.remove_prefix(6);
    known.remove_suffix(part.size() + 1);
    if (const std::optional<Metal> metal = metal_of_symbol(known)) {
      const auto& v = part == "k" ? metal->k : metal->eta;
      return RgbColor{v[0], v[1], v[2]};
    }
  }
  if (found->type != "spectrum") {
    from.fail(name, "the type spectrum or rgb is expected");
    return std::nullopt;
  }
  const std::optional<Spectrum> spectrum = samples(from, *found);
  if (!spectrum) {
    return std::nullopt;
  }
  const RgbColor out = at_red_green_blue(*spectrum);
  if (std::max({out.r, out.g, out.b}) > kMaxComplexIndex) {
    from.fail(name, fmt::format("must be at most {}", kMaxComplexIndex));
    return std::nullopt;
  }
  return out;
}

std::optional<PbrtSpectra::Indices> PbrtSpectra::measured_metal(const PbrtParameters& from, std::string_view eta_name,
                                                                std::string_view k_name) {
  const auto read = [&](std::string_view name) -> std::optional<Spectrum> {
    const PbrtParameter* found = from.find(name);
    const bool measured = found != nullptr && found->type == "spectrum" && !name_of(*found).starts_with("metal-");
    return measured ? samples(from, *found) : std::nullopt;
  };
  const std::optional<Spectrum> eta = read(eta_name), k = read(k_name);
  if (!eta || !k) {
    return std::nullopt;
  }
  Spectrum reflected;
  std::ranges::set_union(eta->wavelengths_nm, k->wavelengths_nm, std::back_inserter(reflected.wavelengths_nm));
  for (const double nm : reflected.wavelengths_nm) {
    const double n = eta->at(nm), absorbed = k->at(nm) * k->at(nm);
    reflected.values.push_back(((n - 1) * (n - 1) + absorbed) / ((n + 1) * (n + 1) + absorbed));
  }
  const RgbColor color = reflected_color(reflected);
  Indices out{at_red_green_blue(*eta), {}};
  const auto k_of = [](double n, double r) {
    r = std::clamp(r, 0.0, 0.9999);
    return static_cast<float>(std::sqrt(std::max((r * (n + 1) * (n + 1) - (n - 1) * (n - 1)) / (1 - r), 0.0)));
  };
  out.k = {k_of(out.eta.r, color.r), k_of(out.eta.g, color.g), k_of(out.eta.b, color.b)};
  const bool usable = std::max({out.eta.r, out.eta.g, out.eta.b, out.k.r, out.k.g, out.k.b}) <= kMaxComplexIndex;
  return usable ? std::optional(out) : std::nullopt;
}

double PbrtSpectra::ior(const PbrtParameters& from, std::string_view name, double fallback) {
  constexpr double kYellowNm = 587.6;
  const PbrtParameter* found = from.find(name);
  if (found == nullptr) {
    return fallback;
  }
  double value = fallback;
  if (found->type != "spectrum") {
    value = from.number(name, fallback);
  } else if (const std::string_view glass = name_of(*found); glass.starts_with("glass-")) {
    // pbrt calls SF10 "F10".
    const std::string short_name(glass.substr(6));
    const std::optional<double> known = short_name.starts_with("F") && !short_name.starts_with("FK")
                                            ? glass_ior("S" + short_name)
                                            : glass_ior(short_name);
    value = known.value_or(0);
  } else if (const std::optional<Spectrum> spectrum = samples(from, *found)) {
    value = spectrum->at(kYellowNm);
  }
  if (!(value > 0 && value <= kMaxIor)) {
    from.fail(name, fmt::format("an index of refraction in (0, {}] or the name of a known glass is expected", kMaxIor));
    return fallback;
  }
  return value;
}

}  // namespace lightmill
