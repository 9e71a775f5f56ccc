// An experiment's results as one self-contained HTML page. Pure: everything that it shows is given.
#pragma once

#include <string>
#include <vector>

#include "client/lab/experiment.h"
#include "client/lab/results.h"

namespace lightmill::lab {

/// A picture of the last level, PNG bytes; empty where there is none yet.
struct ReportPicture {
  std::string caption;
  std::string png;
  std::string difference_png;  ///< against the reference; empty for the reference itself
};

struct ReportScene {
  std::string name;
  double reference_error = -1;  ///< relMSE that the reference states of itself; negative: it does not
  std::string reference_text;   ///< what the reference is
  std::vector<ReportPicture> pictures;
};

struct ReportInput {
  Experiment experiment;
  std::vector<LabResult> results;   ///< of this experiment
  std::vector<ReportScene> scenes;  ///< in its order
  std::size_t wanted = 0;           ///< results of a complete run
};

std::string report_html(const ReportInput& input);

/// A chart of the page as an SVG file of its own.
struct ReportChart {
  std::string name;  ///< of the file: the scene's number, counted from 1, and what is drawn
  std::string svg;
};
std::vector<ReportChart> report_charts(const ReportInput& input);

/// The numbers that the page states, and all results.
std::string report_json(const ReportInput& input);

}  // namespace lightmill::lab
