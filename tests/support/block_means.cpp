#include "tests/support/block_means.h"

#include <cmath>
#include <fstream>

#include "common/base/check.h"

namespace lightmill::test {

BlockMeans block_means(const std::vector<std::vector<double>>& images) {
  constexpr int kBlocks = kTestFilm / kBlock;
  const auto seeds = static_cast<double>(images.size());
  std::vector<double> sum(kBlocks * kBlocks * 3), variance(sum.size());
  for (int y = 0; y < kTestFilm; ++y) {
    for (int x = 0; x < kTestFilm; ++x) {
      for (int c = 0; c < 3; ++c) {
        const std::size_t in = (static_cast<std::size_t>(y) * kTestFilm + x) * 3 + c;
        const std::size_t out = (static_cast<std::size_t>(y / kBlock) * kBlocks + x / kBlock) * 3 + c;
        double mean = 0, squares = 0;
        for (const auto& image : images) {
          mean += image[in] / seeds;
        }
        for (const auto& image : images) {
          squares += (image[in] - mean) * (image[in] - mean);
        }
        sum[out] += mean;
        variance[out] += squares / (seeds - 1) / seeds;
      }
    }
  }
  BlockMeans means;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    means.push_back({sum[i] / (kBlock * kBlock), std::sqrt(variance[i]) / (kBlock * kBlock)});
  }
  return means;
}

void write_block_means(const std::filesystem::path& path, const std::string& comment, const BlockMeans& means) {
  std::ofstream file(path);
  file << "# " << comment << "\n";
  for (const Estimate& e : means) {
    file << fmt::format("{:.7g} {:.3g}\n", e.value, e.standard_error);
  }
  LM_CHECK(file.good(), "cannot write {}", path.string());
}

BlockMeans read_block_means(const std::filesystem::path& path) {
  std::ifstream file(path);
  LM_CHECK(file.good(), "cannot read {}", path.string());
  std::string comment;
  std::getline(file, comment);
  BlockMeans means;
  for (Estimate e; file >> e.value >> e.standard_error;) {
    means.push_back(e);
  }
  return means;
}

}  // namespace lightmill::test
