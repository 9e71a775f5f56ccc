// The options of every command that writes pictures.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/image/color.h"

namespace lightmill::cli {

struct PictureOptions {
  std::vector<std::string> outputs;
  double exposure_stops = 0;
  double gamma = 1;
  std::string view = "plain";
  std::string png_option;  ///< the last given of those that only PNG files follow

  /// INVALID_ARGUMENT for an unknown view, and if something is asked of PNG files where there is none among `outputs`.
  Result<ViewSettings> view_settings() const;
  /// The outputs that are PNG files.
  std::vector<std::string> png_outputs() const;
};

void add_picture_options(CLI::App& command, PictureOptions& options);

}  // namespace lightmill::cli
