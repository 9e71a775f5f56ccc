#include "tests/simulation/fake_renderer.h"

#include <bit>
#include <cmath>

#include "tests/simulation/random.h"

namespace lightmill::simulation {
namespace {

constexpr std::size_t kMaxNodes = 50'000;  ///< some 100 MB

}  // namespace

void FakeRenderer::trim() {
  if (nodes_.size() > kMaxNodes) {
    nodes_.clear();
  }
}

NodePtr FakeRenderer::node(const Sha256& digest, TileId tile, SampleRange range, std::size_t pixels,
                           const NodeLayout& layout, bool rounds_up) {
  NodePtr& known = nodes_[{digest, tile, range, rounds_up}];
  if (known != nullptr) {
    return known;
  }
  if (range.level > 0) {
    const NodePtr left = node(digest, tile, range.left_child(), pixels, layout, rounds_up);
    const NodePtr right = node(digest, tile, range.right_child(), pixels, layout, rounds_up);
    return nodes_[{digest, tile, range, rounds_up}] = std::make_shared<const Node>(join(*left, *right, layout));
  }
  Random bits(std::hash<Sha256>{}(digest) ^ (std::uint64_t{tile.value} << 40) ^ range.index);
  const std::size_t half = layout.summed * pixels;
  Node sample{range, std::vector<float>(layout.values(range) * pixels, 0.0f), range.index % 29 == 3 ? 1u : 0u};
  for (std::size_t i = 0; i < half; ++i) {
    // Values of very different sizes, so that different orders of addition round differently.
    sample.values[range.index % 2 * half + i] =
        static_cast<float>(bits.uniform() * (bits.chance(0.1) ? 1000.0 : 1.0)) + 1e-3f;
  }
  for (std::size_t i = 2 * half; i < sample.values.size(); ++i) {
    sample.values[i] = bits.chance(0.2) ? 0.0f : static_cast<float>(bits.uniform()) + 1e-3f;
  }
  for (float& value : sample.values) {
    value = rounds_up && value != 0 ? std::nextafter(value, 1e30f) : value;
  }
  return nodes_[{digest, tile, range, rounds_up}] = std::make_shared<const Node>(std::move(sample));
}

std::vector<NodePtr> FakeRenderer::forest(const Sha256& digest, TileId tile, std::uint64_t samples, std::size_t pixels,
                                          const NodeLayout& layout) {
  std::vector<NodePtr> parts;
  for (std::uint64_t first = 0; first < samples;) {
    std::uint32_t level = static_cast<std::uint32_t>(std::bit_width(samples - first) - 1);
    while (first % (std::uint64_t{1} << level) != 0) {
      --level;
    }
    const SampleRange range{level, static_cast<std::uint32_t>(first >> level)};
    parts.push_back(node(digest, tile, range, pixels, layout));
    first = range.end();
  }
  return parts;
}

FakeRenderer& shared_renderer() {
  static thread_local FakeRenderer renderer;
  return renderer;
}

}  // namespace lightmill::simulation
