// What an experiment asks for: methods × scenes × seeds, at several numbers of samples or errors, against a reference.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill::lab {

/// What is taken for the truth: a picture, or a render of its own.
struct Reference {
  std::string file;  ///< if not empty, the rest says nothing
  std::string method;
  std::uint64_t samples = 0;  ///< per pixel; 0: no limit
  double error = 0;           ///< as a job's goal; 0: no limit
  std::uint64_t seed = 0;
};

struct LabScene {
  std::string name;
  std::vector<std::string> files;  ///< as the command line takes them
  std::string camera;              ///< likewise; empty: the scene's own
  Reference reference;
};

/// A picture that was made elsewhere, as by another program.
struct OtherPicture {
  std::string scene, method;  ///< the experiment's name of the scene; what its maker is called
  std::uint64_t seed = 0;
  std::uint64_t samples = 0;
  double seconds = 0;  ///< what it cost, on the page's axis
  double wall = 0;     ///< by the clock on the wall
  std::string file;
};

struct Experiment {
  std::string title;
  std::vector<LabScene> scenes;
  std::vector<std::string>
      methods;         ///< the first is what the rest is compared with; may be empty where `others` is not
  std::string others;  ///< a file for parse_others; empty: none
  std::vector<std::uint64_t> seeds;
  int width = 0, height = 0;           ///< 0: each scene's own
  std::vector<std::uint64_t> samples;  ///< levels, ascending; empty where errors are
  std::vector<double> errors;          ///< levels, descending
  std::uint64_t max_samples = 0;       ///< where an error is not reached; 0 where samples are

  std::size_t levels() const { return samples.empty() ? errors.size() : samples.size(); }
};

/// Reads a JSON document (docs/guide/lab.md); files are relative to `folder`. INVALID_ARGUMENT names the field.
Result<Experiment> parse_experiment(std::string_view text, const std::filesystem::path& folder);

/// Reads JSON lines (docs/guide/lab.md); files are relative to `folder`. INVALID_ARGUMENT names line and field.
Result<std::vector<OtherPicture>> parse_others(std::string_view text, const std::filesystem::path& folder);

}  // namespace lightmill::lab
