#include "common/methods/sample_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// For layers other than beauty: values that cannot be summed become zero, and −0 becomes 0.
void make_sound(std::span<float> values) {
  for (float& value : values) {
    value = std::abs(value) <= kLargestSample ? value + 0.0f : 0.0f;
  }
}

void clear_pixel(std::span<float> planes, std::size_t pixel, std::size_t pixels) {
  for (std::size_t i = pixel; i < planes.size(); i += pixels) {
    planes[i] = 0.0f;
  }
}

}  // namespace

void SampleSums::start(SampleRange range, std::size_t pixels, const NodeLayout& layout) {
  range_ = range;
  pixels_ = pixels;
  layout_ = layout;
  next_ = range.first();
  non_finite_ = 0;
  first_.clear();
  for (Half& half : halves_) {
    half.count = 0;
    half.partial.resize(std::max<std::size_t>(half.partial.size(), range.level + 1));
  }
}

void SampleSums::add(std::span<float> planes, std::span<float> first) {
  const bool takes_first = layout_.has_first() && next_ < kFirstSamples;
  LM_CHECK(planes.size() == layout_.summed * pixels_ && next_ < range_.end());
  LM_CHECK(!takes_first || first.size() == layout_.first_values(1) * pixels_);
  if (layout_.summed > kBeautyChannels) {
    make_sound(planes.subspan(kBeautyChannels * pixels_));
  }
  if (takes_first) {
    make_sound(first);
  }
  for (std::size_t p = 0; p < pixels_; ++p) {
    // A NaN or infinity makes the sum NaN or infinite, and the comparison false.
    const float sum = planes[p] + planes[pixels_ + p] + planes[2 * pixels_ + p];
    if (!(std::abs(sum) <= kLargestSample)) [[unlikely]] {
      ++non_finite_;
      clear_pixel(planes, p, pixels_);
      if (takes_first) {
        clear_pixel(first, p, pixels_);
      }
    }
  }
  push(halves_[next_ & 1], planes);
  if (takes_first) {
    first_.emplace_back(first.begin(), first.end());
  }
  ++next_;
}

void SampleSums::push(Half& half, std::span<const float> planes) {
  // Works like a binary counter: equal subtrees are added, and their sum carries to the next level.
  std::size_t level = 0;
  std::vector<float>* carry = nullptr;
  for (; half.count >> level & 1; ++level) {
    std::vector<float>& left = half.partial[level];
    const float* right = carry == nullptr ? planes.data() : carry->data();
    for (std::size_t i = 0; i < left.size(); ++i) {
      left[i] += right[i];
    }
    carry = &left;
  }
  ++half.count;
  if (carry == nullptr) {
    half.partial[0].assign(planes.begin(), planes.end());
  } else {
    std::swap(half.partial[level], *carry);
  }
}

std::vector<float> SampleSums::first_tree(std::size_t begin, std::size_t count) const {
  if (count == 1) {
    return first_[begin];
  }
  const std::size_t half = count / 2;
  std::vector<float> left = first_tree(begin, half);
  append_first(layout_, pixels_, left, static_cast<std::uint32_t>(half), first_tree(begin + half, half),
               static_cast<std::uint32_t>(half));
  return left;
}

Node SampleSums::finish() {
  LM_CHECK(next_ == range_.end());
  const std::size_t half_size = layout_.summed * pixels_;
  Node node{range_, {}, non_finite_};
  node.values.reserve(layout_.values(range_) * pixels_);
  for (const Half& half : halves_) {
    if (half.count == 0) {
      node.values.resize(node.values.size() + half_size, 0.0f);
    } else {
      const std::vector<float>& root = half.partial[std::bit_width(half.count) - 1];
      node.values.insert(node.values.end(), root.begin(), root.end());
    }
  }
  if (!first_.empty()) {
    const std::vector<float> first = first_tree(0, first_.size());
    node.values.insert(node.values.end(), first.begin(), first.end());
  }
  return node;
}

}  // namespace lightmill
