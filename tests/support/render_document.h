// Renderer of a scene document in this process, for tests that compare with exact answers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/methods/method.h"
#include "common/scene_io/load.h"

namespace lightmill::test {

/// Half means of an image: RGB interleaved, row by row.
struct HalfImages {
  int width = 0, height = 0;
  std::vector<double> a, b;
  std::uint64_t non_finite = 0;  ///< NaN or infinite samples, which count as zero
  double mean(std::size_t i) const { return (a[i] + b[i]) / 2; }
  /// Variance of the mean, estimated from the halves.
  double variance(std::size_t i) const { return (a[i] - b[i]) * (a[i] - b[i]) / 4; }
};

/// An estimate and its standard error.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

/// Loads the text of a document. `files` are the files it names, by name. Ends the process on an error.
LoadedScene load_text(const std::string& document, const std::map<std::string, std::string>& files = {});

/// Why reading or compiling refuses a document, or "".
std::string refusal(const std::string& document, const std::map<std::string, std::string>& files = {},
                    const CompiledScene::ImageDecoder& images = nullptr);

/// A scene that was read from files and compiled. Ends the process with the message on an error.
class TestScene {
 public:
  explicit TestScene(const std::filesystem::path& path, const CompiledScene::ImageDecoder& images = nullptr);
  /// From the text of a document. `files` are the files that it names, by name. Images need a decoder
  /// (common/image/read).
  static TestScene from_text(const std::string& document, const std::map<std::string, std::string>& files = {},
                             const CompiledScene::ImageDecoder& images = nullptr);

  const Scene& scene() const { return loaded_.scene; }
  CompiledScene::AssetSource assets() const;
  std::shared_ptr<const CompiledScene> compiled() const { return compiled_; }
  /// The same scene with a film of another size.
  TestScene resized(int width, int height) const;

  /// Samples [0, 2^level) of every pixel of `rect`, or of the film if `rect` is empty. level >= 1. `channel`: first of
  /// the three in a node (NodeLayout).
  HalfImages render(const MethodSettings& settings, std::uint32_t level, PixelRect rect = {},
                    std::size_t channel = 0) const;

 private:
  explicit TestScene(LoadedScene loaded, const CompiledScene::ImageDecoder& images = nullptr);
  LoadedScene loaded_;
  CompiledScene::ImageDecoder images_;
  std::shared_ptr<const CompiledScene> compiled_;
};

/// The mean over all pixels of one channel.
Estimate mean_of(const HalfImages& image, int channel);

}  // namespace lightmill::test
