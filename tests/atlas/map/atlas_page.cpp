#include "tests/atlas/map/atlas_page.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "client/chart/chart.h"
#include "client/lab/page.h"
#include "common/image/color.h"
#include "common/image/png.h"

namespace lightmill::test {
namespace {

constexpr const char* kCss = R"css(
table.map{border-collapse:separate;border-spacing:3px}
table.map td{vertical-align:top;text-align:left;border:0;white-space:normal;font-size:.85em;line-height:1.25}
table.map td.case{max-width:22em}table.map tr.subject td{font-weight:600;padding-top:1em}
td.cell{width:10.5em;border-radius:4px}td.cell b{display:block}
td.cell img{float:right;width:44px;height:44px;image-rendering:pixelated;margin-left:.4em}
td.right{background:#bfe3c3;color:#122}td.slow{background:#f3e3a0;color:#221}td.alone{background:#cfd8e6;color:#122}
td.vetoed{background:#dcdcdc;color:#333}td.wrong{background:#c62828;color:#fff}td.stopped{background:none}
@media (prefers-color-scheme:dark){td.right{background:#1f4d2b;color:#dfd}td.slow{background:#5d4f10;color:#ffd}
td.alone{background:#2b3a55;color:#def}td.vetoed{background:#3a3a3a;color:#ccc}td.wrong{background:#b71c1c;color:#fff}}
p.verdict{font-size:1.2em;font-weight:600}
)css";

std::string number(double value) {
  return fmt::format("{:.3g}", value);
}

std::string seconds(double value) {
  return value < 1e-3 ? "< 1 ms" : value < 1 ? fmt::format("{:.0f} ms", 1e3 * value) : fmt::format("{:.3g} s", value);
}

/// Exposed so that the expected value is a middle tone.
std::string picture(const AtlasCell& cell, double expected) {
  ViewSettings view;
  const double level = expected > 0 ? expected : std::abs(cell.mean);
  view.exposure_stops = level > 0 ? std::clamp(std::log2(0.3 / level), -30.0, 30.0) : 0.0;
  const auto png = encode_png(cell.picture.width, cell.picture.height, to_srgb8(cell.picture, view));
  return png.ok() ? fmt::format("<img alt='' src='{}'>", lab::png_data_uri(*png)) : "";
}

std::string all_of(const AtlasRow& row, const AtlasCell& cell) {
  if (!cell.measured) {
    return cell.reason;
  }
  return fmt::format("{} ± {} (expected {}, from {}); energy {:.5f}; z {:.2f}; {} CPU, {} to 1 %{}{}{}", cell.mean,
                     number(cell.standard_error),
                     row.expected_from == "a formula" ? fmt::format("{:.7g}", row.expected) : "the others'",
                     row.expected_from.empty() ? "nothing" : row.expected_from, cell.energy, cell.z,
                     seconds(cell.cpu_seconds), seconds(cell.seconds_to_percent),
                     cell.non_finite > 0 ? fmt::format("; {} samples not finite", cell.non_finite) : "",
                     cell.reason.empty() ? "" : "; ", cell.reason);
}

std::string cell_html(const AtlasRow& row, const AtlasCell& cell) {
  std::string html = fmt::format("<td class='cell {}' title='{}'>", name_of(cell.outcome), xml_text(all_of(row, cell)));
  if (cell.measured) {
    html += picture(cell, row.expected);
  }
  html += fmt::format("<b>{}</b>", name_of(cell.outcome));
  if (cell.measured) {
    html += cell.outcome == Outcome::alone ? seconds(cell.seconds_to_percent)
                                           : fmt::format("{:+.2f} %<br>z {:.1f}<br>{}", 100 * (cell.energy - 1), cell.z,
                                                         seconds(cell.seconds_to_percent));
  }
  return html + "</td>";
}

std::string totals(std::span<const AtlasRow> rows, const std::vector<std::string>& methods) {
  std::string html =
      "<div class='scroll'><table><tr><th>method</th><th>right</th><th>slow</th><th>alone</th><th>vetoed</th>"
      "<th>wrong</th></tr>\n";
  for (const std::string& method : methods) {
    const OutcomeCounts n = count_outcomes(rows, method);
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        xml_text(method), n.right, n.slow, n.alone, n.vetoed, n.wrong);
  }
  return html + "</table></div>\n";
}

std::string how_to_read(const AtlasSettings& settings) {
  return fmt::format(
      "<p class='faint'>Each case is rendered by each method with {} seeds. In a cell: how much the mean is off what a "
      "formula gives, or another method; z, that in standard errors of the spread over seeds; and the CPU time to an "
      "error of 1 %, extrapolated by 1/N. <b>Wrong</b>: off by more than {} standard errors and the bias that the case "
      "states together, or samples that are no finite numbers, though the planner admits the method. <b>Slow</b>: "
      "right, but 1 % takes more time than the case allows. <b>Vetoed</b>: the planner says what is missing, or the "
      "scene or the method is refused; numbers there tell what the veto is for. <b>Alone</b>: there is no formula, and "
      "no other method is admitted.</p>\n",
      settings.seeds, kWrongZ);
}

}  // namespace

OutcomeCounts count_outcomes(std::span<const AtlasRow> rows, const std::string& method) {
  OutcomeCounts counts;
  for (const AtlasRow& row : rows) {
    for (const AtlasCell& cell : row.cells) {
      if (cell.method == method) {
        counts.right += cell.outcome == Outcome::right;
        counts.slow += cell.outcome == Outcome::slow;
        counts.alone += cell.outcome == Outcome::alone;
        counts.vetoed += cell.outcome == Outcome::vetoed;
        counts.wrong += cell.outcome == Outcome::wrong;
      }
    }
  }
  return counts;
}

std::string atlas_html(std::span<const AtlasRow> rows, const AtlasSettings& settings) {
  int wrong = 0;
  for (const std::string& method : settings.methods) {
    wrong += count_outcomes(rows, method).wrong;
  }
  std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
      "\n<title>Lightmill: the failure atlas</title>\n<style>{}{}</style></head>\n<body>\n<h1>Lightmill: the failure "
      "atlas</h1>\n<p class='verdict{}'>Wrong without a veto: {}</p>\n<p>{} cases, {} methods.</p>\n",
      lab::page_css(), kCss, wrong > 0 ? " warn" : "", wrong, rows.size(), settings.methods.size());
  html +=
      totals(rows, settings.methods) + how_to_read(settings) + "<div class='scroll'><table class='map'>\n<tr><th></th>";
  for (const std::string& method : settings.methods) {
    html += fmt::format("<th>{}</th>", xml_text(method));
  }
  html += "</tr>\n";
  std::string subject;
  for (const AtlasRow& row : rows) {
    if (row.what.subject != subject) {
      subject = row.what.subject;
      html += fmt::format("<tr class='subject'><td colspan='{}'>{}</td></tr>\n", settings.methods.size() + 1,
                          xml_text(subject));
    }
    html += fmt::format("<tr><td class='case'>{}</td>", xml_text(row.what.name));
    for (const AtlasCell& cell : row.cells) {
      html += cell_html(row, cell);
    }
    html += "</tr>\n";
  }
  return html + "</table></div>\n</body></html>\n";
}

std::string atlas_csv(std::span<const AtlasRow> rows) {
  const auto quoted = [](const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
      out += c == '"' ? "\"\"" : std::string(1, c);
    }
    return out + "\"";
  };
  std::string csv =
      "subject,case,method,outcome,expected,mean,standard_error,z,energy,cpu_seconds,seconds_to_percent,non_finite,"
      "reason\n";
  for (const AtlasRow& row : rows) {
    for (const AtlasCell& cell : row.cells) {
      csv += fmt::format("{},{},{},{},", quoted(row.what.subject), quoted(row.what.name), cell.method,
                         name_of(cell.outcome));
      csv += cell.measured ? fmt::format("{},{:.9g},{:.4g},{:.4g},{:.7g},{:.4g},{:.4g},{},",
                                         row.expected_from == "a formula" ? fmt::format("{:.9g}", row.expected) : "",
                                         cell.mean, cell.standard_error, cell.z, cell.energy, cell.cpu_seconds,
                                         cell.seconds_to_percent, cell.non_finite)
                           : ",,,,,,,,";
      csv += quoted(cell.reason) + "\n";
    }
  }
  return csv;
}

std::string atlas_json(std::span<const AtlasRow> rows, const AtlasSettings& settings) {
  using nlohmann::json;
  json totals = json::object(), cases = json::array();
  for (const std::string& method : settings.methods) {
    const OutcomeCounts n = count_outcomes(rows, method);
    totals[method] = {
        {"right", n.right}, {"slow", n.slow}, {"alone", n.alone}, {"vetoed", n.vetoed}, {"wrong", n.wrong}};
  }
  for (const AtlasRow& row : rows) {
    json cells = json::array();
    for (const AtlasCell& cell : row.cells) {
      json one{{"method", cell.method}, {"outcome", name_of(cell.outcome)}, {"reason", cell.reason}};
      if (cell.measured) {
        one.update({{"mean", cell.mean},
                    {"standard_error", cell.standard_error},
                    {"z", cell.z},
                    {"energy", cell.energy},
                    {"cpu_seconds", cell.cpu_seconds},
                    {"seconds_to_percent", cell.seconds_to_percent},
                    {"non_finite", cell.non_finite}});
      }
      cells.push_back(std::move(one));
    }
    json one{
        {"subject", row.what.subject}, {"case", row.what.name}, {"expected_from", row.expected_from}, {"cells", cells}};
    if (row.what.exact) {
      one["expected"] = row.expected;
      one["tolerance"] = row.what.tolerance;
    }
    cases.push_back(std::move(one));
  }
  return json{{"seeds", settings.seeds}, {"totals", totals}, {"cases", cases}}.dump(1, ' ', false,
                                                                                    json::error_handler_t::replace) +
         "\n";
}

}  // namespace lightmill::test
