#include "client/chart/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lightmill {
namespace {

constexpr int kLeft = 74, kRight = 18, kTitleHeight = 30, kAxisHeight = 44, kLegendRow = 20;
constexpr double kRoom = 0.06;        // of the range, at both ends
constexpr double kMinSpan = 0.5;      // decades that an axis shows
constexpr double kFineDecades = 1.7;  // decades; below this, 2 and 5 are labelled
constexpr int kMaxTicks = 8;          // labelled powers of ten
constexpr double kLetterWidth = 6.6;  // width of 12 px text, rounded up
constexpr double kMarkRadius = 3.5;

struct Style {
  const char *light, *dark;
};
// Distinguishable for most people, on light and dark (after Okabe and Ito).
constexpr std::array<Style, kChartStyles> kStyles{{{"#0072b2", "#56b4e9"},
                                                   {"#d55e00", "#ff8c42"},
                                                   {"#009e73", "#2fd6a5"},
                                                   {"#aa4499", "#e28fd3"},
                                                   {"#8a6d00", "#f0e442"},
                                                   {"#555555", "#cccccc"},
                                                   {"#882255", "#ff6f9f"},
                                                   {"#117733", "#8fd175"}}};

bool drawable(const ChartPoint& point) {
  return point.x > 0 && point.y > 0 && std::isfinite(point.x) && std::isfinite(point.y);
}

bool has_bar(const ChartPoint& point) {
  return point.high > 0 && std::isfinite(point.high) && point.low <= point.high;
}

/// The mapping from values to pixels of the SVG.
struct Plot {
  LogAxis x, y;
  double left = kLeft, right = 0, top = kTitleHeight, bottom = 0;
  double at_x(double value) const { return left + x.place(value) * (right - left); }
  double at_y(double value) const { return bottom - y.place(value) * (bottom - top); }
};

struct Extent {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  void take(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

struct Extents {
  Extent x, y;
};

Extents extents_of(const Chart& chart) {
  Extents extents;
  for (const ChartSeries& series : chart.series) {
    for (const ChartPoint& point : series.points) {
      if (!drawable(point)) {
        continue;
      }
      extents.x.take(point.x);
      extents.y.take(point.y);
      if (has_bar(point)) {
        extents.y.take(point.high);
        if (point.low > 0) {
          extents.y.take(point.low);
        }
      }
    }
  }
  return extents;
}

std::string mark(std::size_t style, double x, double y, const std::string& title) {
  const double r = kMarkRadius;
  const std::string inner = title.empty() ? "" : "<title>" + xml_text(title) + "</title>";
  switch (style % 4) {
    case 0:
      return fmt::format("<circle cx='{:.2f}' cy='{:.2f}' r='{}'>{}</circle>", x, y, r, inner);
    case 1:
      return fmt::format("<rect x='{:.2f}' y='{:.2f}' width='{}' height='{}'>{}</rect>", x - r, y - r, 2 * r, 2 * r,
                         inner);
    case 2:
      return fmt::format("<path d='M{:.2f} {:.2f}l{} {}h{}z'>{}</path>", x, y - 1.2 * r, 1.2 * r, 2.2 * r, -2.4 * r,
                         inner);
    default:
      return fmt::format("<path d='M{:.2f} {:.2f}l{} {}l{} {}l{} {}z'>{}</path>", x, y - 1.3 * r, 1.3 * r, 1.3 * r,
                         -1.3 * r, 1.3 * r, -1.3 * r, -1.3 * r, inner);
  }
}

std::string line(const char* kind, double x1, double y1, double x2, double y2) {
  return fmt::format("<line class='{}' x1='{:.2f}' y1='{:.2f}' x2='{:.2f}' y2='{:.2f}'/>", kind, x1, y1, x2, y2);
}

std::string text(const char* anchor, double x, double y, std::string_view what, std::string_view more = "") {
  return fmt::format("<text text-anchor='{}' x='{:.2f}' y='{:.2f}' {}>{}</text>", anchor, x, y, more, xml_text(what));
}

std::string axes(const Chart& chart, const Plot& plot) {
  std::string svg;
  for (const double value : plot.x.minors) {
    svg += line("fine", plot.at_x(value), plot.top, plot.at_x(value), plot.bottom);
  }
  for (const double value : plot.y.minors) {
    svg += line("fine", plot.left, plot.at_y(value), plot.right, plot.at_y(value));
  }
  for (const double value : plot.x.ticks) {
    svg += line("grid", plot.at_x(value), plot.top, plot.at_x(value), plot.bottom);
    svg += text("middle", plot.at_x(value), plot.bottom + 16, tick_label(value));
  }
  for (const double value : plot.y.ticks) {
    svg += line("grid", plot.left, plot.at_y(value), plot.right, plot.at_y(value));
    svg += text("end", plot.left - 6, plot.at_y(value) + 4, tick_label(value));
  }
  svg += fmt::format("<rect class='frame' x='{}' y='{}' width='{}' height='{}'/>", plot.left, plot.top,
                     plot.right - plot.left, plot.bottom - plot.top);
  svg += text("middle", (plot.left + plot.right) / 2, plot.bottom + 36, chart.x_label);
  const double middle = (plot.top + plot.bottom) / 2;
  svg += text("middle", 16, middle, chart.y_label, fmt::format("transform='rotate(-90 16 {:.2f})'", middle));
  return svg;
}

/// The part of y = c·x^slope, through the middle of the points, inside the frame.
std::string guide(const SlopeGuide& guide, const Plot& plot, const Extents& extents) {
  const double mid_x = (std::log10(extents.x.least) + std::log10(extents.x.most)) / 2;
  const double mid_y = (std::log10(extents.y.least) + std::log10(extents.y.most)) / 2;
  double x1 = std::log10(plot.x.low), x2 = std::log10(plot.x.high);
  if (guide.slope != 0) {
    const double at_low = mid_x + (std::log10(plot.y.low) - mid_y) / guide.slope;
    const double at_high = mid_x + (std::log10(plot.y.high) - mid_y) / guide.slope;
    x1 = std::max(x1, std::min(at_low, at_high));
    x2 = std::min(x2, std::max(at_low, at_high));
  }
  const auto y_at = [&](double x) { return std::pow(10, mid_y + guide.slope * (x - mid_x)); };
  const double px = plot.at_x(std::pow(10, x1)), py = plot.at_y(y_at(x1));
  return line("guide", px, py, plot.at_x(std::pow(10, x2)), plot.at_y(y_at(x2))) +
         text("start", px + 10, py + (guide.slope > 0 ? -6 : 14), guide.label, "class='faint'");
}

std::string series_svg(const ChartSeries& series, std::size_t index, const Plot& plot) {
  std::string path, bars, marks;
  for (const ChartPoint& point : series.points) {
    if (!drawable(point)) {
      continue;
    }
    const double x = plot.at_x(point.x), y = plot.at_y(point.y);
    path += fmt::format("{}{:.2f} {:.2f}", path.empty() ? "M" : "L", x, y);
    if (has_bar(point) && point.low < point.high) {
      const double low = point.low > 0 ? plot.at_y(point.low) : plot.bottom;
      const double high = plot.at_y(point.high);
      bars += fmt::format("M{0:.2f} {1:.2f}V{2:.2f}M{3:.2f} {1:.2f}h6M{3:.2f} {2:.2f}h6", x, low, high, x - 3);
    }
    marks += mark(index % kChartStyles, x, y, point.title);
  }
  if (marks.empty()) {
    return "";
  }
  return fmt::format("<g class='s{}'><path class='curve' d='{}'/>{}{}</g>", index % kChartStyles, path,
                     bars.empty() ? "" : fmt::format("<path class='bar' d='{}'/>", bars), marks);
}

/// The legend below `top`, and its height.
std::pair<std::string, double> legend(const Chart& chart, double top) {
  std::string svg;
  double x = kLeft, y = top + kLegendRow / 2.0;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const double wide = 26 + kLetterWidth * static_cast<double>(chart.series[i].name.size()) + 14;
    if (x > kLeft && x + wide > chart.width - kRight) {
      x = kLeft;
      y += kLegendRow;
    }
    svg += fmt::format("<g class='s{}'>{}{}</g>", i % kChartStyles, line("curve", x, y, x + 20, y),
                       mark(i % kChartStyles, x + 10, y, ""));
    svg += text("start", x + 26, y + 4, chart.series[i].name);
    x += wide;
  }
  return {svg, chart.series.empty() ? 0 : y + kLegendRow / 2.0 - top};
}

}  // namespace

double LogAxis::place(double value) const {
  return std::log(value / low) / std::log(high / low);
}

LogAxis make_log_axis(double least, double most) {
  double low = std::log10(least), high = std::log10(most);
  if (high - low < kMinSpan) {
    const double middle = (low + high) / 2;
    low = middle - kMinSpan / 2;
    high = middle + kMinSpan / 2;
  }
  const double span = high - low;
  LogAxis axis;
  axis.low = std::pow(10, low - kRoom * span);
  axis.high = std::pow(10, high + kRoom * span);
  const int first = static_cast<int>(std::floor(std::log10(axis.low)));
  const int last = static_cast<int>(std::ceil(std::log10(axis.high)));
  const int step = 1 + (last - first) / kMaxTicks;
  for (int power = first; power <= last; ++power) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double value = digit * std::pow(10, power);
      if (value < axis.low || value > axis.high) {
        continue;
      }
      const bool labelled = digit == 1 ? (power % step == 0) : (span < kFineDecades && (digit == 2 || digit == 5));
      if (labelled) {
        axis.ticks.push_back(value);
      } else if (step == 1) {
        axis.minors.push_back(value);
      }
    }
  }
  return axis;
}

std::string tick_label(double value) {
  if (value > 0.9e-4 && value < 1.1e5) {
    return fmt::format("{:.6g}", value);
  }
  constexpr std::array<const char*, 10> kRaised{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const int power = static_cast<int>(std::floor(std::log10(value) + 1e-9));
  const double digit = std::round(value / std::pow(10, power));
  std::string label = digit == 1 ? "10" : fmt::format("{}·10", digit);
  label += power < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(power))) {
    label += kRaised[static_cast<std::size_t>(c - '0')];
  }
  return label;
}

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') {
          out += c;
        }
    }
  }
  return out;
}

std::string chart_css() {
  std::string light, dark;
  for (std::size_t i = 0; i < kStyles.size(); ++i) {
    const auto rule = [&](const char* color) {
      return fmt::format(".lm-chart .s{0}{{stroke:{1};fill:{1}}}", i, color);
    };
    light += rule(kStyles[i].light);
    dark += rule(kStyles[i].dark);
  }
  return ".lm-chart{font:12px sans-serif;max-width:100%;height:auto}.lm-chart text{fill:#222}"
         ".lm-chart .title{font-size:14px;font-weight:bold}.lm-chart .faint{fill:#666}"
         ".lm-chart .page{fill:#fff}.lm-chart .frame{fill:none;stroke:#888}"
         ".lm-chart .grid{stroke:#ccc}.lm-chart .fine{stroke:#eee}"
         ".lm-chart .guide{stroke:#888;stroke-dasharray:7 5}.lm-chart .level{stroke:#888;stroke-dasharray:2 4}" +
         light +
         ".lm-chart .curve{fill:none;stroke-width:1.8}.lm-chart .bar{fill:none;stroke-width:1}"
         "@media (prefers-color-scheme:dark){.lm-chart text{fill:#ddd}.lm-chart .faint{fill:#aaa}"
         ".lm-chart .page{fill:#16181c}.lm-chart .grid{stroke:#3a3d44}.lm-chart .fine{stroke:#25282e}" +
         dark + ".lm-chart .curve,.lm-chart .bar{fill:none}}";
}

namespace {

std::string svg_element(const Chart& chart, const std::string& head) {
  const Extents extents = extents_of(chart);
  const bool empty = extents.x.most == 0;
  Plot plot;
  plot.right = chart.width - kRight;
  plot.bottom = plot.top + chart.plot_height;
  std::string body = text("middle", chart.width / 2.0, 20, chart.title, "class='title'");
  if (empty) {
    body += text("middle", chart.width / 2.0, (plot.top + plot.bottom) / 2, "no points yet", "class='faint'");
  } else {
    plot.x = make_log_axis(extents.x.least, extents.x.most);
    plot.y = make_log_axis(extents.y.least, extents.y.most);
    body += axes(chart, plot);
    for (const SlopeGuide& one : chart.guides) {
      body += guide(one, plot, extents);
    }
    for (const LevelLine& level : chart.levels) {
      if (level.y > plot.y.low && level.y < plot.y.high) {
        body += line("level", plot.left, plot.at_y(level.y), plot.right, plot.at_y(level.y));
        body += text("start", plot.left + 6, plot.at_y(level.y) - 4, level.label, "class='faint'");
      }
    }
    for (std::size_t i = 0; i < chart.series.size(); ++i) {
      body += series_svg(chart.series[i], i, plot);
    }
  }
  const auto [key, key_height] = legend(chart, plot.bottom + kAxisHeight);
  const double height = plot.bottom + kAxisHeight + key_height + 6;
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' class='lm-chart' role='img' width='{0}' height='{1:.0f}' "
      "viewBox='0 0 {0} {1:.0f}'>{2}{3}{4}</svg>",
      chart.width, height, head, body, key);
}

}  // namespace

std::string chart_svg(const Chart& chart) {
  return svg_element(chart, "");
}

std::string chart_file(const Chart& chart) {
  return "<?xml version='1.0' encoding='UTF-8'?>\n" +
         svg_element(chart, "<style>" + chart_css() + "</style><rect class='page' width='100%' height='100%'/>") + "\n";
}

}  // namespace lightmill
