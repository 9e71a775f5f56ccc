// Block means of an image with their standard errors, and files of them. The z-tests of images compare these.
#pragma once

#include <filesystem>
#include <vector>

#include "tests/support/render_document.h"

namespace lightmill::test {

inline constexpr int kBlock = 8;       ///< pixels on a side
inline constexpr int kTestFilm = 128;  ///< pixels on a side of the films compared

/// One estimate per block and channel, blocks row by row, channels innermost.
using BlockMeans = std::vector<Estimate>;

/// Turns the per-pixel means of several independent seeds into block means. The error is the spread over seeds within
/// each pixel, pooled over the block. `images[seed]` is RGB interleaved, kTestFilm on a side.
BlockMeans block_means(const std::vector<std::vector<double>>& images);

void write_block_means(const std::filesystem::path& path, const std::string& comment, const BlockMeans& means);
BlockMeans read_block_means(const std::filesystem::path& path);

}  // namespace lightmill::test
