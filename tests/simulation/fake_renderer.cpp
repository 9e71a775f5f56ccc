#include "tests/simulation/fake_renderer.h"

#include <bit>

#include "tests/simulation/random.h"

namespace lightmill::simulation {

NodePtr FakeRenderer::node(const Sha256& digest, TileId tile, SampleRange range, std::size_t values) {
  NodePtr& known = nodes_[{digest, tile, range}];
  if (known != nullptr && known->values.size() == values) {
    return known;
  }
  if (range.level > 0) {
    const NodePtr left = node(digest, tile, range.left_child(), values);
    const NodePtr right = node(digest, tile, range.right_child(), values);
    return nodes_[{digest, tile, range}] = std::make_shared<const Node>(join(*left, *right));
  }
  Random bits(std::hash<Sha256>{}(digest) ^ (std::uint64_t{tile.value} << 40) ^ range.index);
  Node sample{range, std::vector<float>(values, 0.0f), range.index % 29 == 3 ? 1u : 0u};
  for (std::size_t i = 0; i < values / 2; ++i) {
    // Values of all sizes, so that no two orders of addition round alike.
    sample.values[range.index % 2 * (values / 2) + i] =
        static_cast<float>(bits.uniform() * (bits.chance(0.1) ? 1000.0 : 1.0)) + 1e-3f;
  }
  return nodes_[{digest, tile, range}] = std::make_shared<const Node>(std::move(sample));
}

std::vector<float> FakeRenderer::sums(const Sha256& digest, TileId tile, std::uint64_t samples, std::size_t values) {
  std::vector<float> sums(values, 0.0f);
  for (std::uint64_t first = 0; first < samples;) {
    std::uint32_t level = static_cast<std::uint32_t>(std::bit_width(samples - first) - 1);
    while (first % (std::uint64_t{1} << level) != 0) {
      --level;
    }
    const SampleRange range{level, static_cast<std::uint32_t>(first >> level)};
    const NodePtr part = node(digest, tile, range, values);
    for (std::size_t i = 0; i < values; ++i) {
      sums[i] += part->values[i];
    }
    first = range.end();
  }
  return sums;
}

}  // namespace lightmill::simulation
