// An experiment's results as one self-contained HTML page. Pure.
#pragma once

#include <string>
#include <vector>

#include "client/lab/experiment.h"
#include "client/lab/results.h"

namespace lightmill::lab {

/// A picture of the last level as PNG bytes. Empty while there is none.
struct ReportPicture {
  std::string caption;
  std::string png;
  std::string difference_png;  ///< from the reference; empty for the reference itself
};

struct ReportScene {
  std::string name;
  double reference_error = -1;  ///< the reference's own relMSE; negative: unknown
  std::string reference_text;   ///< a description of the reference
  std::vector<ReportPicture> pictures;
};

struct ReportInput {
  Experiment experiment;
  std::vector<LabResult> results;   ///< results of this experiment
  std::vector<ReportScene> scenes;  ///< in the experiment's order
  std::size_t wanted = 0;           ///< number of results of a complete run
};

std::string report_html(const ReportInput& input);

/// A chart of the page as an SVG file of its own.
struct ReportChart {
  std::string name;  ///< file name: the scene's number, counted from 1, and the chart's subject
  std::string svg;
};
std::vector<ReportChart> report_charts(const ReportInput& input);

/// The numbers of the page, and all results.
std::string report_json(const ReportInput& input);

}  // namespace lightmill::lab
