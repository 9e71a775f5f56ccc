#include "common/film/node.h"

#include "common/base/check.h"

namespace lightmill {

Node join(const Node& left, const Node& right) {
  LM_CHECK(left.range.sibling() == right.range && left.range.index % 2 == 0);
  LM_CHECK(left.values.size() == right.values.size());
  Node parent{left.range.parent(), std::vector<float>(left.values.size()), left.non_finite + right.non_finite};
  for (std::size_t i = 0; i < parent.values.size(); ++i) {
    parent.values[i] = left.values[i] + right.values[i];
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
