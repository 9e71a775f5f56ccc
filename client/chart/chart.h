// Log-log charts as SVG text, light or dark by the reader's settings. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// A point and its error bar. It is drawn only if x and y are positive and finite. The bar is drawn only if it is
/// longer than its point.
struct ChartPoint {
  double x = 0, y = 0;
  double low = 0, high = 0;  ///< ends of the bar; an end that is not positive goes to the chart's edge. Both 0: no bar
  std::string title;         ///< tooltip
};

/// Points joined by lines in the given order.
struct ChartSeries {
  std::string name;
  std::vector<ChartPoint> points;
};

/// A dashed straight line of given slope through the middle of the points.
struct SlopeGuide {
  double slope = -1;
  std::string label;
};

/// A dotted horizontal line.
struct LevelLine {
  double y = 1;
  std::string label;
};

struct Chart {
  std::string title, x_label, y_label;
  std::vector<ChartSeries> series;  ///< colours and marks repeat after kChartStyles
  std::vector<SlopeGuide> guides;
  std::vector<LevelLine> levels;  ///< those outside the points' range are left out
  int width = 640;                ///< pixels
  int plot_height = 340;          ///< of the axes; title, labels and legend add to it
};

inline constexpr std::size_t kChartStyles = 8;

/// The range and the ticks of a log axis.
struct LogAxis {
  double low = 1, high = 10;   ///< positive, low < high
  std::vector<double> ticks;   ///< labelled: powers of ten, or 1, 2 and 5 times them
  std::vector<double> minors;  ///< fine lines without labels
  /// 0 at low, 1 at high.
  double place(double value) const;
};

/// An axis for values from `least` to `most` (positive) with a little room.
LogAxis make_log_axis(double least, double most);

/// "0.001", "20", "10⁻⁶".
std::string tick_label(double value);

/// `text` with &, <, > and quotes as entities, and without characters that XML forbids.
std::string xml_text(std::string_view text);

/// CSS of charts. A page with charts needs it once.
std::string chart_css();

/// The chart's <svg> element, for a page with chart_css().
std::string chart_svg(const Chart& chart);

/// The chart as a file of its own, with its CSS and a background.
std::string chart_file(const Chart& chart);

}  // namespace lightmill
