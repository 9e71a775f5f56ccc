// An experiment: methods × scenes × seeds, at several numbers of samples or errors, against a reference.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill::lab {

/// The ground truth: a picture file, or a render.
struct Reference {
  std::string file;  ///< if not empty, the other fields are unused
  std::string method;
  std::uint64_t samples = 0;  ///< per pixel; 0: no limit
  double error = 0;           ///< as a job's goal; 0: no limit
  std::uint64_t seed = 0;
};

struct LabScene {
  std::string name;
  std::vector<std::string> files;  ///< as on the command line
  std::string camera;              ///< as on the command line; empty: the scene's own
  Reference reference;
};

/// A picture of another program.
struct OtherPicture {
  std::string scene, method;  ///< the experiment's name of the scene; the name of the other program
  std::uint64_t seed = 0;
  std::uint64_t samples = 0;
  double seconds = 0;  ///< its cost, on the page's axis
  double wall = 0;     ///< wall-clock time
  std::string file;
};

struct Experiment {
  std::string title;
  std::vector<LabScene> scenes;
  std::vector<std::string> methods;  ///< the first is the baseline; may be empty if `others` is not
  std::string others;                ///< a file for parse_others; empty: none
  std::vector<std::uint64_t> seeds;
  int width = 0, height = 0;           ///< 0: each scene's own
  std::vector<std::uint64_t> samples;  ///< levels, ascending; empty if `errors` is not
  std::vector<double> errors;          ///< levels, descending
  std::uint64_t max_samples = 0;       ///< limit for an error that is not reached; 0 if `samples` is given

  std::size_t levels() const { return samples.empty() ? errors.size() : samples.size(); }
};

/// Reads a JSON document (docs/guide/lab.md). Files are relative to `folder`. INVALID_ARGUMENT names the field.
Result<Experiment> parse_experiment(std::string_view text, const std::filesystem::path& folder);

/// Reads JSON lines (docs/guide/lab.md). Files are relative to `folder`. INVALID_ARGUMENT names line and field.
Result<std::vector<OtherPicture>> parse_others(std::string_view text, const std::filesystem::path& folder);

}  // namespace lightmill::lab
