#include "client/lab/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "client/chart/chart.h"
#include "client/lab/analysis.h"
#include "client/lab/page.h"
#include "common/base/number_text.h"

namespace lightmill::lab {
namespace {

using nlohmann::json;

constexpr double kReferenceShare = 0.1;  // a reference needs a tenth of the error that it measures

double rel_mse(const LabResult& result) {
  return result.error.rel_mse;
}
double trimmed(const LabResult& result) {
  return result.error.rel_mse_trimmed;
}
double flip(const LabResult& result) {
  return result.flip;
}

/// Three significant digits, or a whole number.
std::string number(double value) {
  if (!std::isfinite(value)) {
    return "∞";
  }
  return value >= 999.5 && value < 1e6 ? fmt::format("{:.0f}", value) : significant(value, 3);
}

/// Means of counts have fractions.
std::string count_text(double value) {
  return fmt::format("{:.6g}", value);
}

/// "1.23×", with "≈" for extrapolated curves.
std::string factor_text(double factor, bool about) {
  return fmt::format("{}{}×", about ? "≈ " : "", number(factor));
}

std::string row(const char* cell, const std::vector<std::string>& cells) {
  std::string html = "<tr>";
  for (const std::string& text : cells) {
    html += fmt::format("<{0}>{1}</{0}>", cell, xml_text(text));
  }
  return html + "</tr>\n";
}

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class='scroll'><table>\n" + row("th", rows.front());
  for (std::size_t i = 1; i < rows.size(); ++i) {
    html += row("td", rows[i]);
  }
  return html + "</table></div>\n";
}

bool is_chooser(const std::string& method) {
  return method == "auto" || method.starts_with("auto:");
}

/// The numbers of one scene.
struct SceneFacts {
  std::vector<std::vector<CurvePoint>> curves;  ///< by method
  std::vector<std::optional<SpeedUp>> speed_ups;
  std::optional<Regret> regret;
  std::string chooser;
};

SceneFacts facts_of(const ReportInput& input, const std::string& scene) {
  SceneFacts facts;
  const std::vector<std::string>& methods = input.experiment.methods;
  for (const std::string& method : methods) {
    facts.curves.push_back(curve_of(input.results, scene, method, rel_mse));
    facts.speed_ups.push_back(speed_up(facts.curves.back(), facts.curves.front()));
    if (is_chooser(method)) {
      facts.chooser = method;
      facts.regret = regret_of(input.results, scene, method, methods, rel_mse);
    }
  }
  return facts;
}

// ---- charts ----

Chart chart_for(const ReportInput& input, const ReportScene& scene, const std::string& title, const char* y_label,
                const Metric& metric, bool monte_carlo) {
  Chart chart;
  chart.title = title;
  chart.x_label = input.experiment.others.empty() ? "thread seconds" : "seconds (of threads, or as stated)";
  chart.y_label = y_label;
  for (const std::string& method : input.experiment.methods) {
    ChartSeries series{method, {}};
    for (const CurvePoint& point : curve_of(input.results, scene.name, method, metric)) {
      series.points.push_back(
          {point.seconds.median, point.error.median, point.error.least, point.error.most,
           fmt::format("{}: {} samples, {} thread seconds, {} ({} to {}, {} seeds)", method, count_text(point.samples),
                       number(point.seconds.median), number(point.error.median), number(point.error.least),
                       number(point.error.most), point.seeds)});
    }
    chart.series.push_back(std::move(series));
  }
  if (monte_carlo) {
    chart.guides = {{-1, "slope −1"}};
    if (scene.reference_error > 0) {
      chart.levels = {{scene.reference_error, "the reference's own error"}};
    }
  } else {
    chart.guides = {{-0.5, "slope −½"}};
  }
  return chart;
}

struct NamedChart {
  const char* name;
  Chart chart;
};

std::vector<NamedChart> charts_of(const ReportInput& input, const ReportScene& scene) {
  return {{"relmse", chart_for(input, scene, "relMSE", "relMSE", rel_mse, true)},
          {"trimmed", chart_for(input, scene, "relMSE without the worst 0.1%", "trimmed relMSE", trimmed, true)},
          {"flip", chart_for(input, scene, "FLIP", "mean FLIP", flip, false)}};
}

std::string charts(const ReportInput& input, const ReportScene& scene) {
  std::string html = "<div class='charts'>\n";
  for (const NamedChart& each : charts_of(input, scene)) {
    html += chart_svg(each.chart) + "\n";
  }
  return html + "</div>\n";
}

// ---- tables ----

std::string time_text(const std::vector<CurvePoint>& curve, double error) {
  const std::optional<TimeToError> time = time_to_error(curve, error);
  return time ? fmt::format("{}{}", time->extrapolated ? "≈ " : "", number(time->seconds)) : "–";
}

std::string method_table(const ReportInput& input, const ReportScene& scene, const SceneFacts& facts) {
  std::vector<std::vector<std::string>> rows{{"method", "seeds", "samples", "thread s", "relMSE", "worst", "trimmed",
                                              "energy", "SMAPE", "FLIP", "slope", "s to 0.01", "s to 0.001",
                                              "speed-up"}};
  const std::vector<std::string>& methods = input.experiment.methods;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const std::vector<CurvePoint>& curve = facts.curves[m];
    if (curve.empty()) {
      continue;
    }
    const auto last = [&](const Metric& metric) {
      return curve_of(input.results, scene.name, methods[m], metric).back().error;
    };
    const Spread energy = last([](const LabResult& result) { return result.error.energy_ratio; });
    const std::optional<double> slope = slope_of(curve);
    const std::optional<SpeedUp>& gain = facts.speed_ups[m];
    rows.push_back(
        {methods[m], std::to_string(curve.back().seeds), count_text(curve.back().samples),
         number(curve.back().seconds.median), number(curve.back().error.median), number(curve.back().error.most),
         number(last(trimmed).median), fmt::format("{:.5f}", energy.median),
         number(last([](const LabResult& result) { return result.error.smape; }).median), number(last(flip).median),
         slope ? fmt::format("{:.3f}", *slope) : "–", time_text(curve, 0.01), time_text(curve, 0.001),
         gain ? fmt::format("{} at {}", factor_text(gain->factor, gain->extrapolated), number(gain->at_error)) : "–"});
  }
  return rows.size() < 2 ? "<p class='faint'>No results yet.</p>\n" : table(rows);
}

/// A warning about results below ten times the reference's own error, which may change them by a tenth.
std::string reference_warning(const ReportScene& scene, const SceneFacts& facts) {
  if (scene.reference_error <= 0) {
    return "";
  }
  std::size_t close = 0;
  for (const std::vector<CurvePoint>& curve : facts.curves) {
    close += static_cast<std::size_t>(std::ranges::count_if(
        curve, [&](const CurvePoint& point) { return point.error.median < scene.reference_error / kReferenceShare; }));
  }
  return close == 0 ? ""
                    : fmt::format(
                          "<p class='warn'>Points with less than ten times the reference's own error of {}: {}. "
                          "Their true error is lower.</p>\n",
                          number(scene.reference_error), close);
}

std::string overview(const ReportInput& input, const std::vector<SceneFacts>& facts) {
  const std::vector<std::string>& methods = input.experiment.methods;
  std::vector<std::vector<std::string>> rows{
      {"equal-error speed-up over " + methods.front(), "geometric mean", "least", "most", "scenes"}};
  for (std::size_t m = 1; m < methods.size(); ++m) {
    std::vector<double> factors;
    bool about = false;
    for (const SceneFacts& scene : facts) {
      if (scene.speed_ups[m]) {
        factors.push_back(scene.speed_ups[m]->factor);
        about = about || scene.speed_ups[m]->extrapolated;
      }
    }
    const Summary summary = summarise(factors);
    rows.push_back({methods[m], summary.count == 0 ? "–" : factor_text(summary.mean, about),
                    summary.count == 0 ? "–" : factor_text(summary.least, about),
                    summary.count == 0 ? "–" : factor_text(summary.most, about), std::to_string(summary.count)});
  }
  std::string html = rows.size() > 1 ? table(rows) : "";
  std::vector<double> regrets;
  std::vector<std::vector<std::string>> regret_rows{{"regret of the choice", "time relative to the best", "the best"}};
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (facts[i].regret) {
      regrets.push_back(facts[i].regret->factor);
      regret_rows.push_back({input.scenes[i].name, factor_text(regrets.back(), false), facts[i].regret->best});
    }
  }
  if (!regrets.empty()) {
    const Summary summary = summarise(regrets);
    regret_rows.push_back({"geometric mean", factor_text(summary.mean, false), ""});
    regret_rows.push_back({"worst", factor_text(summary.most, false), ""});
    html += table(regret_rows);
  }
  return html;
}

// ---- pictures ----

std::string pictures(const ReportScene& scene) {
  if (scene.pictures.empty()) {
    return "";
  }
  std::string html =
      "<div><label><input type='checkbox' class='differences'> differences from the reference (red: too bright, blue: "
      "too dark)</label> <span class='faint'>· click to enlarge all</span>\n<div class='pictures'>\n";
  for (const ReportPicture& picture : scene.pictures) {
    const std::string caption = xml_text(picture.caption);
    const bool both = !picture.difference_png.empty();
    html += fmt::format("<figure><div class='frame{}'><img class='plain' alt='{}' src='{}'>", both ? " both" : "",
                        caption, png_data_uri(picture.png));
    if (both) {
      html += fmt::format("<img class='difference' alt='difference of {}' src='{}'>", caption,
                          png_data_uri(picture.difference_png));
    }
    html += fmt::format("</div><figcaption>{}</figcaption></figure>\n", caption);
  }
  return html + "</div></div>\n";
}

std::string title_of(const ReportInput& input) {
  return input.experiment.title.empty() ? "Lightmill: methods compared" : input.experiment.title;
}

constexpr const char* kHowToRead =
    "<p class='faint'>Each point is the median over seeds. Its bar goes from the best to the worst. relMSE = mean((x "
    "− r)² / (r² + 0.01)). Thread seconds are those of the farm's render threads. A speed-up compares times at the "
    "same error, the greater of the two last errors. ≈ marks an extrapolation with slope −1. The slope is that of "
    "relMSE against samples.</p>\n";

}  // namespace

std::string report_html(const ReportInput& input) {
  std::vector<SceneFacts> facts;
  for (const ReportScene& scene : input.scenes) {
    facts.push_back(facts_of(input, scene.name));
  }
  const std::string title = xml_text(title_of(input));
  std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width'>\n<title>{}</title>\n<style>{}</style></head>\n<body>\n<h1>{}</h1>\n",
      title, page_css(), title);
  html += fmt::format("<p>{} of {} results{}.</p>\n", input.results.size(), input.wanted,
                      input.results.size() < input.wanted ? " <span class='warn'>(run it again to resume)</span>" : "");
  html += kHowToRead + overview(input, facts);
  for (std::size_t i = 0; i < input.scenes.size(); ++i) {
    const ReportScene& scene = input.scenes[i];
    html += fmt::format("<section><h2>{}</h2>\n<p class='faint'>Reference: {}</p>\n", xml_text(scene.name),
                        xml_text(scene.reference_text));
    html += reference_warning(scene, facts[i]) + charts(input, scene) + method_table(input, scene, facts[i]) +
            pictures(scene) + "</section>\n";
  }
  return html + "<script>" + page_script() + "</script>\n</body></html>\n";
}

std::vector<ReportChart> report_charts(const ReportInput& input) {
  std::vector<ReportChart> files;
  for (std::size_t i = 0; i < input.scenes.size(); ++i) {
    for (NamedChart& each : charts_of(input, input.scenes[i])) {
      each.chart.title = input.scenes[i].name + ": " + each.chart.title;
      files.push_back({fmt::format("{}-{}.svg", i + 1, each.name), chart_file(each.chart)});
    }
  }
  return files;
}

std::string report_json(const ReportInput& input) {
  json results = json::array(), scenes = json::array();
  for (const LabResult& result : input.results) {
    results.push_back(to_json(result));
  }
  for (const ReportScene& scene : input.scenes) {
    const SceneFacts facts = facts_of(input, scene.name);
    json methods = json::array();
    for (std::size_t m = 0; m < facts.curves.size(); ++m) {
      json points = json::array();
      for (const CurvePoint& point : facts.curves[m]) {
        points.push_back({{"samples", point.samples},
                          {"thread_seconds", point.seconds.median},
                          {"rel_mse", point.error.median},
                          {"rel_mse_least", point.error.least},
                          {"rel_mse_most", point.error.most},
                          {"seeds", point.seeds}});
      }
      json method{{"method", input.experiment.methods[m]}, {"curve", points}};
      if (const std::optional<double> slope = slope_of(facts.curves[m])) {
        method["slope"] = *slope;
      }
      if (const std::optional<SpeedUp>& gain = facts.speed_ups[m]) {
        method["speed_up"] = {
            {"factor", gain->factor}, {"at_rel_mse", gain->at_error}, {"extrapolated", gain->extrapolated}};
      }
      methods.push_back(std::move(method));
    }
    json object{{"scene", scene.name}, {"reference", scene.reference_text}, {"methods", methods}};
    if (scene.reference_error >= 0) {
      object["reference_rel_mse"] = scene.reference_error;
    }
    if (facts.regret) {
      object["regret"] = {{"factor", facts.regret->factor}, {"best", facts.regret->best}};
    }
    scenes.push_back(std::move(object));
  }
  return json{{"title", title_of(input)}, {"wanted", input.wanted}, {"scenes", scenes}, {"results", results}}.dump(1) +
         "\n";
}

}  // namespace lightmill::lab
