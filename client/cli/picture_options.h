// The options of every command that writes pictures.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/film_fetch.h"

namespace lightmill::cli {

struct PictureOptions {
  std::vector<std::string> outputs;
  double exposure_stops = 0;
  double gamma = 1;
  std::string view = "plain";
  bool denoise = false;
  std::string png_layer;   ///< the layer that PNG files show; empty: the picture
  std::string png_option;  ///< the last given option that applies only to PNG files

  /// INVALID_ARGUMENT for a file that cannot be written, an unknown view, or an option of PNG files if `outputs` has no
  /// PNG file.
  Result<PictureOutputs> checked() const;
  /// The outputs that are PNG files.
  std::vector<std::string> png_outputs() const;
};

void add_picture_options(CLI::App& command, PictureOptions& options);

}  // namespace lightmill::cli
