// Log-log charts as SVG text, light and dark by the reader's settings. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// A point and its error bar; drawn only if x and y are positive and finite, the bar only where it is longer than its
/// point.
struct ChartPoint {
  double x = 0, y = 0;
  double low = 0, high = 0;  ///< of the bar; an end that is not positive goes to the chart's edge. Both 0: no bar
  std::string title;         ///< shown when pointed at
};

/// Points joined by lines in their order.
struct ChartSeries {
  std::string name;
  std::vector<ChartPoint> points;
};

/// A dashed straight line through the middle of the points.
struct SlopeGuide {
  double slope = -1;
  std::string label;
};

/// A dotted line across the chart.
struct LevelLine {
  double y = 1;
  std::string label;
};

struct Chart {
  std::string title, x_label, y_label;
  std::vector<ChartSeries> series;  ///< colours and marks repeat after kChartStyles
  std::vector<SlopeGuide> guides;
  std::vector<LevelLine> levels;  ///< outside the points' range they are left out
  int width = 640;                ///< pixels
  int plot_height = 340;          ///< of the axes; title, labels and legend come on top
};

inline constexpr std::size_t kChartStyles = 8;

/// The range of a log axis and its marks.
struct LogAxis {
  double low = 1, high = 10;   ///< positive, low < high
  std::vector<double> ticks;   ///< with labels: powers of ten, or 1, 2 and 5 times them
  std::vector<double> minors;  ///< fine lines without
  /// 0 at low, 1 at high.
  double place(double value) const;
};

/// An axis for values from `least` to `most` (positive) with a little room.
LogAxis make_log_axis(double least, double most);

/// "0.001", "20", "10⁻⁶".
std::string tick_label(double value);

/// `text` with &, <, > and quotes as entities, and without what XML has no place for.
std::string xml_text(std::string_view text);

/// The rules that charts need: once in a page that holds some.
std::string chart_css();

/// The chart's <svg> element, to stand in a page with chart_css().
std::string chart_svg(const Chart& chart);

/// A file of its own: the same with its rules and a background.
std::string chart_file(const Chart& chart);

}  // namespace lightmill
