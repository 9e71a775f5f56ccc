#include "common/film/node.h"

#include "common/base/check.h"

namespace lightmill {

Node join(const Node& left, const Node& right, const NodeLayout& layout) {
  LM_CHECK(left.range.sibling() == right.range && left.range.index % 2 == 0);
  const std::uint32_t left_first = NodeLayout::first_samples_in(left.range);
  const std::uint32_t right_first = NodeLayout::first_samples_in(right.range);
  const std::size_t pixels = left.values.size() / layout.values(left.range);
  LM_CHECK(left.values.size() == layout.values(left.range) * pixels &&
           right.values.size() == layout.values(right.range) * pixels);
  const std::size_t sums = layout.summed_values() * pixels;
  Node parent{left.range.parent(), std::vector<float>(sums), left.non_finite + right.non_finite};
  for (std::size_t i = 0; i < sums; ++i) {
    parent.values[i] = left.values[i] + right.values[i];
  }
  if (layout.has_first() && left_first > 0) {
    const auto first = left.values.begin() + static_cast<std::ptrdiff_t>(sums);
    std::vector<float> both(first, left.values.end());
    append_first(layout, pixels, both, left_first, std::span(right.values).subspan(sums), right_first);
    parent.values.insert(parent.values.end(), both.begin(), both.end());
  }
  return parent;
}

Hash128 hash_of(const Node& node) {
  Xxh3Hasher hasher;
  const std::array<std::uint64_t, 3> head{node.range.level, node.range.index, node.non_finite};
  hasher.append(std::as_bytes(std::span(head)));
  hasher.append(std::as_bytes(std::span(node.values)));
  return hasher.finish();
}

}  // namespace lightmill
