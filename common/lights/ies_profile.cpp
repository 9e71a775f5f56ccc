#include "common/lights/ies_profile.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"
#include "common/math/transcendental.h"

namespace lightmill {
namespace {

constexpr double kDegree = kPiDouble / 180;

/// Reader of a file's lines and numbers. It remembers the line of the last one.
class IesText {
 public:
  IesText(std::string_view text, std::string_view file) : rest_(text), file_(file) {}

  bool at_end() const { return rest_.empty(); }
  std::string_view line() {
    place_ = next_line_++;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view out = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    while (!out.empty() && (out.back() == '\r' || out.back() == ' ' || out.back() == '\t')) {
      out.remove_suffix(1);
    }
    return out;
  }
  /// The next number, on this line or a later one. White space and commas separate numbers.
  Result<double> number(std::string_view what) {
    skip_separators();
    place_ = next_line_;
    std::size_t length = 0;
    while (length < rest_.size() && !is_separator(rest_[length])) {
      ++length;
    }
    std::string_view token = rest_.substr(0, length);
    if (token.empty()) {
      return error("{} is expected, but the file ends", what);
    }
    const std::string_view shown = token;
    if (token.front() == '+') {
      token.remove_prefix(1);
    }
    const std::optional<double> value = parse_number<double>(token);
    if (!value || !std::isfinite(*value)) {
      return error("{} is expected, got \"{}\"", what, shown.substr(0, 40));
    }
    rest_.remove_prefix(length);
    return *value;
  }
  Result<double> number(std::string_view what, double low, double high) {
    LM_ASSIGN_OR_RETURN(const double value, number(what));
    if (!(value >= low && value <= high)) {
      return error("{} must be in [{}, {}], got {}", what, low, high, value);
    }
    return value;
  }
  Result<std::size_t> count(std::string_view what, std::size_t least, std::size_t most) {
    LM_ASSIGN_OR_RETURN(const double value, number(what, static_cast<double>(least), static_cast<double>(most)));
    if (value != std::floor(value)) {
      return error("{} must be a whole number, got {}", what, value);
    }
    return static_cast<std::size_t>(value);
  }
  template <class... Args>
  Status error(fmt::format_string<Args...> format, Args&&... args) const {
    return invalid_argument("{}:{}: {}", file_, place_, fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  static bool is_separator(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ','; }
  void skip_separators() {
    while (!rest_.empty() && is_separator(rest_.front())) {
      next_line_ += rest_.front() == '\n' ? 1 : 0;
      rest_.remove_prefix(1);
    }
  }

  std::string_view rest_, file_;
  int next_line_ = 1;  ///< line in which rest_ begins
  int place_ = 1;      ///< line of the last line or number
};

struct Head {
  bool recent = false;  ///< of 2002 or later
  bool tilted = false;  ///< has factors for tilted mounting
};

/// Skips the label lines up to TILT=, and the data that TILT= includes.
Result<Head> read_head(IesText& text) {
  bool recent = false;
  for (int lines = 0; !text.at_end(); ++lines) {
    std::string_view line = text.line();
    if (lines == 0) {
      // "IESNA:LM-63-2002" or "IES:LM-63-2019". Files of 1986 begin with any label.
      recent = line.find("LM-63-2002") != std::string_view::npos || line.find("LM-63-2019") != std::string_view::npos;
    }
    if (!line.starts_with("TILT=")) {
      continue;
    }
    const std::string_view tilt = line.substr(5);
    if (tilt == "INCLUDE") {
      LM_RETURN_IF_ERROR(text.number("the lamp's position (1, 2 or 3)", 1, 3).status());
      LM_ASSIGN_OR_RETURN(const std::size_t pairs, text.count("the number of tilt angles", 1, kMaxIesAngles));
      for (std::size_t i = 0; i < 2 * pairs; ++i) {
        LM_RETURN_IF_ERROR(text.number("a tilt angle or factor").status());
      }
    } else if (tilt.empty()) {
      return text.error("NONE, INCLUDE or a file name is expected after TILT=");
    }
    return Head{recent, tilt != "NONE"};
  }
  return text.error("there is no line TILT=. Is this an IES file?");
}

Status read_angles(IesText& text, std::string_view what, std::size_t count, double low, double high,
                   std::vector<double>& out) {
  for (std::size_t i = 0; i < count; ++i) {
    LM_ASSIGN_OR_RETURN(const double angle, text.number(what, low, high));
    if (!out.empty() && angle <= out.back()) {
      return text.error("{}s must ascend, got {} after {}", what, angle, out.back());
    }
    out.push_back(angle);
  }
  return ok_status();
}

/// Appends a row to the profile.
void add_row(IesProfile& profile, double angle, const std::vector<double>& values) {
  profile.horizontal.push_back(angle);
  profile.candela.insert(profile.candela.end(), values.begin(), values.end());
}

std::vector<double> row_of(const IesProfile& profile, std::size_t i) {
  const std::size_t n = profile.vertical.size();
  const auto begin = profile.candela.begin() + static_cast<std::ptrdiff_t>(i * n);
  return {begin, begin + static_cast<std::ptrdiff_t>(n)};
}

/// Expands [90°, 270°] to the full circle. The plane 90°–270° is a plane of symmetry: 180° − x has the values of x.
IesProfile unfold_sideways(const IesProfile& half) {
  const std::size_t count = half.horizontal.size();
  std::vector<double> at_180;
  for (const double v : half.vertical) {
    at_180.push_back(half.at(v, 180));
  }
  IesProfile whole{half.vertical, {}, {}};
  add_row(whole, 0, at_180);
  for (std::size_t i = count; i-- > 0;) {
    if (half.horizontal[i] < 180) {
      add_row(whole, 180 - half.horizontal[i], row_of(half, i));
    }
  }
  for (std::size_t i = 1; i < count; ++i) {
    add_row(whole, half.horizontal[i], row_of(half, i));
  }
  for (std::size_t i = count - 1; i-- > 0;) {
    if (half.horizontal[i] > 180) {
      add_row(whole, 540 - half.horizontal[i], row_of(half, i));
    }
  }
  add_row(whole, 360, at_180);
  return whole;
}

/// Whether 360 is left out at the end of a circle. Some makers do so, because it has the values of 0.
bool is_open_circle(const std::vector<double>& horizontal) {
  constexpr double kRounding = 0.02;  // share of a step
  const double last = horizontal.back(), step = last - horizontal[horizontal.size() - 2];
  return horizontal.front() == 0 && last > 180 && std::abs(360 - last - step) < kRounding * step;
}

/// Upper bound of the number of horizontal angles after `unfold`.
std::size_t most_unfolded(const std::vector<double>& horizontal) {
  if (horizontal.size() == 1) {
    return 2;
  }
  if (horizontal.back() == 90) {
    return 4 * horizontal.size() - 3;
  }
  return horizontal.front() == 90   ? 2 * horizontal.size() + 1
         : horizontal.back() == 180 ? 2 * horizontal.size() - 1
                                    : horizontal.size() + 1;
}

/// Expands the symmetry that the range of horizontal angles implies.
Status unfold(const IesText& text, IesProfile& profile) {
  const double first = profile.horizontal.front(), last = profile.horizontal.back();
  if (profile.horizontal.size() == 1) {
    profile.horizontal = {0};  // the same in all directions
    add_row(profile, 360, row_of(profile, 0));
    return ok_status();
  }
  if (first == 90 && last == 270) {
    profile = unfold_sideways(profile);
    return ok_status();
  }
  if (is_open_circle(profile.horizontal)) {
    add_row(profile, 360, row_of(profile, 0));
    profile.notices.push_back(
        fmt::format("the horizontal angles end at {}: the values of angle 0 are repeated at 360", last));
    return ok_status();
  }
  if (first != 0 || (last != 90 && last != 180 && last != 360)) {
    return text.error("horizontal angles must go from 0 to 0, 90, 180 or 360, or from 90 to 270, got {} to {}", first,
                      last);
  }
  for (double mirror = last; mirror < 360; mirror *= 2) {
    for (std::size_t i = profile.horizontal.size() - 1; i-- > 0;) {
      add_row(profile, 2 * mirror - profile.horizontal[i], row_of(profile, i));
    }
  }
  return ok_status();
}

/// The i with x in [values[i], values[i + 1]]. x must lie in the range of the values.
std::size_t cell_of(const std::vector<double>& values, double x) {
  const auto above = std::upper_bound(values.begin(), values.end(), x);
  const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - values.begin() - 1, 0));
  return std::min(i, values.size() - 2);
}

double lerp(double a, double b, double t) {
  return a + (b - a) * t;
}

}  // namespace

double IesProfile::at(double vertical_degrees, double horizontal_degrees) const {
  if (!(vertical_degrees >= vertical.front() && vertical_degrees <= vertical.back())) {
    return 0;
  }
  const std::size_t i = cell_of(vertical, vertical_degrees);
  const double t = (vertical_degrees - vertical[i]) / (vertical[i + 1] - vertical[i]);
  const double turned = horizontal_degrees - 360 * std::floor(horizontal_degrees / 360);
  const std::size_t j = cell_of(horizontal, turned);
  const auto in_row = [&](std::size_t row) {
    const double* values = &candela[row * vertical.size() + i];
    return lerp(values[0], values[1], t);
  };
  return lerp(in_row(j), in_row(j + 1), (turned - horizontal[j]) / (horizontal[j + 1] - horizontal[j]));
}

double IesProfile::lumen() const {
  // Each cell is linear in both angles: ∫(a + b(θ − θ₀)) sin θ dθ = a (cos θ₀ − cos θ₁) + b (sin θ₁ − sin θ₀ − Δ cos
  // θ₁).
  const std::size_t n = vertical.size();
  struct Cell {
    double delta, constant, slope;  ///< Δ, and the factors of a and b
  };
  std::vector<Cell> cells;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double t0 = vertical[i] * kDegree, t1 = vertical[i + 1] * kDegree;
    cells.push_back(
        {t1 - t0, cos_fixed(t0) - cos_fixed(t1), sin_fixed(t1) - sin_fixed(t0) - (t1 - t0) * cos_fixed(t1)});
  }
  const auto over_row = [&](std::size_t row) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const double a = candela[row * n + i], b = (candela[row * n + i + 1] - a) / cells[i].delta;
      sum += a * cells[i].constant + b * cells[i].slope;
    }
    return sum;
  };
  double sum = 0, before = over_row(0);
  for (std::size_t j = 0; j + 1 < horizontal.size(); ++j) {
    const double after = over_row(j + 1);
    sum += (horizontal[j + 1] - horizontal[j]) * kDegree * (before + after) / 2;
    before = after;
  }
  return sum;
}

Result<IesProfile> read_ies(std::string_view text, std::string_view file) {
  IesText in(text, file);
  LM_ASSIGN_OR_RETURN(const Head head, read_head(in));
  LM_RETURN_IF_ERROR(in.number("the number of lamps").status());
  LM_RETURN_IF_ERROR(in.number("the lumens of a lamp").status());
  LM_ASSIGN_OR_RETURN(const double multiplier, in.number("the candela multiplier", 0, 1e12));
  LM_ASSIGN_OR_RETURN(const std::size_t verticals, in.count("the number of vertical angles", 2, kMaxIesAngles));
  LM_ASSIGN_OR_RETURN(const std::size_t horizontals, in.count("the number of horizontal angles", 1, kMaxIesAngles));
  LM_ASSIGN_OR_RETURN(const double type, in.number("the photometric type", 1, 3));
  if (type != 1) {
    return in.error("only photometric type C (1) can be read, this file is of type {}", type == 2 ? "B (2)" : "A (3)");
  }
  LM_RETURN_IF_ERROR(in.number("the type of units (1 or 2)", 1, 2).status());
  for (const std::string_view what : {"the luminaire's width", "the luminaire's length", "the luminaire's height"}) {
    LM_RETURN_IF_ERROR(in.number(what).status());
  }
  LM_ASSIGN_OR_RETURN(const double ballast, in.number("the ballast factor", 0, 1e6));
  // Since 2002 the next number is reserved. Before, it is the ballast-lamp photometric factor.
  LM_ASSIGN_OR_RETURN(const double photometric_factor, in.number("the ballast-lamp photometric factor", 0, 1e6));
  LM_RETURN_IF_ERROR(in.number("the input power").status());
  IesProfile profile;
  LM_RETURN_IF_ERROR(read_angles(in, "vertical angle", verticals, 0, 180, profile.vertical));
  LM_RETURN_IF_ERROR(read_angles(in, "horizontal angle", horizontals, 0, 360, profile.horizontal));
  if (const std::size_t rows = most_unfolded(profile.horizontal); verticals * rows > kMaxIesValues) {
    return in.error(
        "{} vertical and {} horizontal angles, {} with their symmetry, are more than the limit of {} values", verticals,
        horizontals, rows, kMaxIesValues);
  }
  const double factor = multiplier * ballast * (head.recent ? 1 : photometric_factor);
  for (std::size_t i = 0; i < verticals * horizontals; ++i) {
    LM_ASSIGN_OR_RETURN(const double candela, in.number("a candela value", 0, 1e12));
    profile.candela.push_back(candela * factor);
  }
  LM_RETURN_IF_ERROR(unfold(in, profile));
  if (head.tilted) {
    profile.notices.emplace_back(
        "the factors for tilted mounting (TILT) are left out: the light has its measured intensity");
  }
  if (const double low = profile.vertical.front(), high = profile.vertical.back();
      (low != 0 && low != 90) || (high != 90 && high != 180)) {
    profile.notices.push_back(fmt::format(
        "the vertical angles go from {} to {}, not from 0 or 90 to 90 or 180: there is no light beyond", low, high));
  }
  return profile;
}

}  // namespace lightmill
