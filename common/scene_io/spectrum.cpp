#include "common/scene_io/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

constexpr int kFirstNm = 360, kLastNm = 830;
constexpr double kLargestValue = 1e20;
using Xyz = std::array<double, 3>;

/// CIE standard illuminant D65 (ISO 11664-2) at 360, 370, … 830 nm.
constexpr std::array<double, 48> kD65{
    46.6383, 52.0891, 49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861,
    115.923, 108.811, 109.354, 107.802, 104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880, 88.6856,
    90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490,
    61.6040, 69.8856, 75.0870, 63.5927, 46.4182, 66.8054, 63.3828, 64.3040, 59.4519, 51.9590, 57.4406, 60.3125};
constexpr Xyz kD65White{0.95047, 1, 1.08883};

double d65(int nm) {
  const auto i = static_cast<std::size_t>((nm - kFirstNm) / 10);
  const double share = (nm - kFirstNm) % 10 / 10.0;
  return share == 0 ? kD65[i] : kD65[i] * (1 - share) + kD65[i + 1] * share;
}

Xyz matching_functions(double nm) {
  const auto lobe = [&](double peak, double below, double above) {
    const double t = (nm - peak) / (nm < peak ? below : above);
    return std::exp(-t * t / 2);
  };
  return {1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7) - 0.065 * lobe(501.1, 20.4, 26.2),
          0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
          1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8)};
}

/// The integral of `power` with the matching functions, where that of D65 is kD65White.
Xyz xyz_of(const std::function<double(int nm)>& power) {
  Xyz sum{}, white{};
  for (int nm = kFirstNm; nm <= kLastNm; ++nm) {
    const Xyz matched = matching_functions(nm);
    const double value = power(nm);
    for (std::size_t i = 0; i < 3; ++i) {
      sum[i] += matched[i] * value;
      white[i] += matched[i] * d65(nm);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    sum[i] *= kD65White[i] / white[i];
  }
  return sum;
}

/// IEC 61966-2-1, with the rows scaled so that kD65White is exactly (1, 1, 1).
RgbColor rgb_of(const Xyz& xyz) {
  constexpr std::array<Xyz, 3> kRows{
      {{3.2404542, -1.5371385, -0.4985314}, {-0.9692660, 1.8760108, 0.0415560}, {0.0556434, -0.2040259, 1.0572252}}};
  const auto row = [&](std::size_t i) {
    const auto times = [&](const Xyz& v) { return kRows[i][0] * v[0] + kRows[i][1] * v[1] + kRows[i][2] * v[2]; };
    return static_cast<float>(std::max(times(xyz) / times(kD65White), 0.0));
  };
  return {row(0), row(1), row(2)};
}

/// The numbers of a text file. Bytes beyond 40 × kMaxSpectrumSamples are not read. A word that is no number is -1.
std::vector<double> numbers_in(const SourceFile& file) {
  std::vector<double> out;
  StatementReader lines(std::string_view(file.bytes).substr(0, kMaxSpectrumSamples * 40), file.name);
  while (const std::optional<Statement> line = lines.next()) {
    std::string_view rest = line->rest;
    for (std::string_view word = line->keyword; !word.empty(); word = take_word(rest)) {
      out.push_back(parse_number(word).value_or(-1));
    }
  }
  return out;
}

}  // namespace

double Spectrum::at(double nm) const {
  const auto above = std::ranges::upper_bound(wavelengths_nm, nm);
  const auto i = static_cast<std::size_t>(above - wavelengths_nm.begin());
  if (i == 0) {
    return 0;
  }
  if (i == values.size()) {
    return nm == wavelengths_nm.back() ? values.back() : 0;
  }
  const double share = (nm - wavelengths_nm[i - 1]) / (wavelengths_nm[i] - wavelengths_nm[i - 1]);
  return values[i - 1] * (1 - share) + values[i] * share;
}

Result<Spectrum> read_spectrum(const std::vector<double>& numbers, const std::string& file, FileSource& files) {
  if (!file.empty()) {
    LM_ASSIGN_OR_RETURN(const SourceFile source, files(file));
    return read_spectrum(numbers_in(source), "", files);
  }
  bool valid = !numbers.empty() && numbers.size() % 2 == 0 && numbers.size() <= 2 * kMaxSpectrumSamples;
  Spectrum out;
  for (std::size_t i = 0; valid && i < numbers.size(); i += 2) {
    valid =
        (i == 0 || numbers[i] > out.wavelengths_nm.back()) && numbers[i + 1] >= 0 && numbers[i + 1] <= kLargestValue;
    out.wavelengths_nm.push_back(numbers[i]);
    out.values.push_back(numbers[i + 1]);
  }
  if (!valid) {
    return invalid_argument("pairs of ascending wavelengths and values that are not negative are expected, at most {}",
                            kMaxSpectrumSamples);
  }
  return out;
}

Spectrum blackbody(double kelvin) {
  constexpr double kSecondRadiationNmKelvin = 1.438776877e7;  // h c / k

  const auto log_power = [&](double nm) {
    const double x = kSecondRadiationNmKelvin / (nm * kelvin);
    return -5 * std::log(nm) - (x > 700 ? x : std::log(std::expm1(x)));
  };
  Spectrum out;
  double largest = -1e300;
  for (int nm = kFirstNm; nm <= kLastNm; nm += 5) {
    largest = std::max(largest, log_power(nm));
  }
  for (int nm = kFirstNm; nm <= kLastNm; nm += 5) {
    out.wavelengths_nm.push_back(nm);
    out.values.push_back(std::exp(log_power(nm) - largest));
  }
  return out;
}

RgbColor reflected_color(const Spectrum& reflectance) {
  return rgb_of(xyz_of([&](int nm) { return reflectance.at(nm) * d65(nm); }));
}

std::optional<RgbColor> light_color(const Spectrum& light) {
  Xyz xyz = xyz_of([&](int nm) { return light.at(nm); });
  const double luminance = xyz[1];
  if (!(luminance > 1e-30 && luminance < 1e30)) {
    return std::nullopt;
  }
  for (double& value : xyz) {
    value /= luminance;
  }
  return rgb_of(xyz);
}

RgbColor radiated_color(const Spectrum& light) {
  const double unit = xyz_of([](int) { return 1.0; })[1];
  return rgb_of(xyz_of([&](int nm) { return light.at(nm) / unit; }));
}

std::optional<RgbColor> illuminant_color(std::string_view name) {
  struct Illuminant {
    std::string_view name;
    double x, y;
  };
  // Chromaticities of the CIE, 2° observer (CIE 15:2004, tables T.3 and T.6).
  constexpr std::array<Illuminant, 15> kIlluminants{{{"A", 0.44758, 0.40745},
                                                     {"D50", 0.34567, 0.35851},
                                                     {"D65", 0.31272, 0.32903},
                                                     {"F1", 0.3131, 0.3371},
                                                     {"F2", 0.3721, 0.3751},
                                                     {"F3", 0.4091, 0.3941},
                                                     {"F4", 0.4402, 0.4031},
                                                     {"F5", 0.3138, 0.3452},
                                                     {"F6", 0.3779, 0.3882},
                                                     {"F7", 0.3129, 0.3292},
                                                     {"F8", 0.3458, 0.3586},
                                                     {"F9", 0.3741, 0.3727},
                                                     {"F10", 0.3458, 0.3588},
                                                     {"F11", 0.3805, 0.3769},
                                                     {"F12", 0.4370, 0.4042}}};
  for (const Illuminant& one : kIlluminants) {
    if (one.name == name) {
      return name == "D65" ? RgbColor{1, 1, 1} : rgb_of({one.x / one.y, 1, (1 - one.x - one.y) / one.y});
    }
  }
  return std::nullopt;
}

RgbColor at_red_green_blue(const Spectrum& spectrum) {
  const auto at = [&](double nm) { return static_cast<float>(spectrum.at(nm)); };
  return {at(650), at(550), at(450)};
}

std::optional<Metal> metal_of_symbol(std::string_view symbol) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kMetals{{{"Ag", "silver"},
                                                                                  {"Al", "aluminium"},
                                                                                  {"Au", "gold"},
                                                                                  {"Cr", "chromium"},
                                                                                  {"Cu", "copper"},
                                                                                  {"Ni", "nickel"},
                                                                                  {"Pt", "platinum"}}};
  for (const auto& [known, name] : kMetals) {
    if (known == symbol) {
      return find_metal(name);
    }
  }
  return std::nullopt;
}

std::optional<double> glass_ior(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, double>, 7> kGlasses{{{"BK7", 1.5168},
                                                                         {"BAF10", 1.67003},
                                                                         {"FK51A", 1.48656},
                                                                         {"LASF9", 1.85025},
                                                                         {"SF5", 1.6727},
                                                                         {"SF10", 1.72825},
                                                                         {"SF11", 1.78472}}};
  for (const auto& [glass, ior] : kGlasses) {
    if (glass == name) {
      return ior;
    }
  }
  return std::nullopt;
}

}  // namespace lightmill
