// Positions of points, bars, guides and ticks in charts, whose SVG is valid XML.
#include "client/chart/chart.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/xml.h"

namespace lightmill {
namespace {

using test::xml_tags;
using test::XmlTag;

ChartPoint at(double x, double y) {
  return {x, y, 0, 0, ""};
}

/// The centres of the circles, which mark the first series; the legend's is the last.
std::vector<std::pair<double, double>> circles(const std::string& svg) {
  std::vector<std::pair<double, double>> centres;
  for (const XmlTag& tag : xml_tags(svg)) {
    if (tag.name == "circle") {
      centres.emplace_back(std::stod(tag.attribute("cx")), std::stod(tag.attribute("cy")));
    }
  }
  return centres;
}

std::vector<XmlTag> lines(const std::string& svg, const std::string& kind) {
  std::vector<XmlTag> found;
  for (const XmlTag& tag : xml_tags(svg)) {
    if (tag.name == "line" && tag.attribute("class") == kind) {
      found.push_back(tag);
    }
  }
  return found;
}

TEST(Chart, EqualFactorsAreEqualDistances) {
  Chart chart;
  chart.series = {{"one", {at(1, 1), at(10, 0.1), at(1000, 0.001)}}};
  const auto centres = circles(chart_svg(chart));
  ASSERT_EQ(centres.size(), 4u);  // and the legend's
  const double decade_x = centres[1].first - centres[0].first;
  const double decade_y = centres[1].second - centres[0].second;
  EXPECT_GT(decade_x, 50);
  EXPECT_GT(decade_y, 50);  // y goes down as values fall
  EXPECT_NEAR(centres[2].first - centres[1].first, 2 * decade_x, 0.05);
  EXPECT_NEAR(centres[2].second - centres[1].second, 2 * decade_y, 0.05);
}

TEST(Chart, TicksStandAtTheirValues) {
  Chart chart;
  chart.series = {{"one", {at(1, 1), at(100, 100)}}};
  const std::string svg = chart_svg(chart);
  const auto centres = circles(svg);
  const std::vector<XmlTag> grid = lines(svg, "grid");
  ASSERT_EQ(grid.size(), 6u);  // 1, 10 and 100 twice
  EXPECT_NEAR(std::stod(grid[0].attribute("x1")), centres[0].first, 0.02);
  EXPECT_NEAR(std::stod(grid[2].attribute("x1")), centres[1].first, 0.02);
  EXPECT_NEAR(std::stod(grid[3].attribute("y1")), centres[0].second, 0.02);
  EXPECT_NEAR(std::stod(grid[5].attribute("y1")), centres[1].second, 0.02);
}

TEST(Chart, GuidesHaveTheirSlopeAndStayInside) {
  for (const double slope : {-1.0, -2.0 / 3, 0.0, 1.0}) {
    Chart chart;
    chart.series = {{"one", {at(1, 1), at(100, 1e-5)}}};
    chart.guides = {{slope, "slope"}};
    const std::string svg = chart_svg(chart);
    const auto centres = circles(svg);
    const double decade_x = (centres[1].first - centres[0].first) / 2;
    const double decade_y = (centres[1].second - centres[0].second) / 5;
    const std::vector<XmlTag> guides = lines(svg, "guide");
    ASSERT_EQ(guides.size(), 1u);
    const double x1 = std::stod(guides[0].attribute("x1")), x2 = std::stod(guides[0].attribute("x2"));
    const double y1 = std::stod(guides[0].attribute("y1")), y2 = std::stod(guides[0].attribute("y2"));
    EXPECT_NEAR((y2 - y1) / decade_y, -slope * (x2 - x1) / decade_x, 2e-3);
    EXPECT_GE(x1, 0);
    EXPECT_LE(x2, chart.width);
    EXPECT_GT(x2, x1);
  }
}

TEST(Chart, BarsReachFromLowToHigh) {
  Chart chart;
  chart.series = {{"one", {{1, 1, 0.1, 10, "a & b"}, {10, 1, 0, 0, ""}}}};
  const std::string svg = chart_svg(chart);
  const auto centres = circles(svg);
  const double decade = centres[1].first - centres[0].first;
  EXPECT_GT(decade, 0);
  std::vector<std::string> bars;
  for (const XmlTag& tag : xml_tags(svg)) {
    if (tag.name == "path" && tag.attribute("class") == "bar") {
      bars.push_back(tag.attribute("d"));
    }
  }
  ASSERT_EQ(bars.size(), 1u);
  double x = 0, low = 0, high = 0;
  ASSERT_EQ(std::sscanf(bars[0].c_str(), "M%lf %lfV%lf", &x, &low, &high), 3);
  EXPECT_NEAR(x, centres[0].first, 0.02);
  EXPECT_NEAR(low - centres[0].second, centres[0].second - high, 0.03);  // a decade down and one up
  EXPECT_NE(svg.find("<title>a &amp; b</title>"), std::string::npos);
}

TEST(Chart, UndrawablePointsAreLeftOut) {
  Chart chart;
  chart.title = "a < b & \"c\"";
  chart.series = {{"none", {at(0, 1), at(1, -1), at(1, std::nan("")), at(INFINITY, 1)}}};
  const std::string empty = chart_file(chart);
  EXPECT_FALSE(xml_tags(empty).empty());
  EXPECT_NE(empty.find("no points yet"), std::string::npos);
  chart.series.push_back({"one point", {at(3, 3)}});
  chart.levels = {{3, "here"}, {1e9, "far away"}};
  chart.guides = {{-1, "slope −1"}};
  const std::string one = chart_file(chart);
  EXPECT_FALSE(xml_tags(one).empty());
  EXPECT_EQ(lines(one, "level").size(), 1u);
  EXPECT_EQ(one.find("nan"), std::string::npos) << one;
  EXPECT_EQ(one.find("inf"), std::string::npos) << one;
}

TEST(Chart, AxesHaveReadableTicks) {
  for (const double factor : {1.0, 1.01, 3.0, 20.0, 1e3, 1e6, 1e30}) {
    const LogAxis axis = make_log_axis(0.7, 0.7 * factor);
    EXPECT_LT(axis.low, 0.7);
    EXPECT_GT(axis.high, 0.7 * factor);
    EXPECT_GE(axis.ticks.size(), factor == 1e30 ? 4u : 1u) << factor;
    EXPECT_LE(axis.ticks.size(), 9u) << factor;
    for (const double tick : axis.ticks) {
      EXPECT_GE(axis.place(tick), 0);
      EXPECT_LE(axis.place(tick), 1);
    }
  }
  EXPECT_EQ(tick_label(0.001), "0.001");
  EXPECT_EQ(tick_label(20), "20");
  EXPECT_EQ(tick_label(100'000), "100000");
  EXPECT_EQ(tick_label(1e-6), "10⁻⁶");
  EXPECT_EQ(tick_label(2e-5), "2·10⁻⁵");
  EXPECT_EQ(tick_label(1e12), "10¹²");
}

}  // namespace
}  // namespace lightmill
