#include "common/methods/sample_sums.h"

#include <cmath>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// No sum of kMaxSamples of these, nor of both halves' sums, overflows.
constexpr float kLargestSample = 0x1p97f;

}  // namespace

void SampleSums::start(SampleRange range, std::size_t pixels) {
  range_ = range;
  pixels_ = pixels;
  next_ = range.first();
  non_finite_ = 0;
  for (Half& half : halves_) {
    half.count = 0;
    half.partial.resize(std::max<std::size_t>(half.partial.size(), range.level + 1));
  }
}

void SampleSums::add(std::span<float> planes) {
  LM_CHECK(planes.size() == 3 * pixels_ && next_ < range_.end());
  for (std::size_t p = 0; p < pixels_; ++p) {
    // Any NaN or infinity makes this sum NaN or infinite, and fails the comparison.
    const float sum = planes[p] + planes[pixels_ + p] + planes[2 * pixels_ + p];
    if (!(std::abs(sum) <= kLargestSample)) [[unlikely]] {
      ++non_finite_;
      planes[p] = planes[pixels_ + p] = planes[2 * pixels_ + p] = 0.0f;
    }
  }
  push(halves_[next_ & 1], planes);
  ++next_;
}

void SampleSums::push(Half& half, std::span<const float> planes) {
  // A binary counter: a sample meets the waiting subtree of its size, their sum meets the next larger one, and so on.
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

Node SampleSums::finish() {
  LM_CHECK(next_ == range_.end());
  Node node{range_, {}, non_finite_};
  node.values.reserve(6 * pixels_);
  for (const Half& half : halves_) {
    if (half.count == 0) {
      node.values.resize(node.values.size() + 3 * pixels_, 0.0f);
    } else {
      const std::vector<float>& root = half.partial[std::bit_width(half.count) - 1];
      node.values.insert(node.values.end(), root.begin(), root.end());
    }
  }
  return node;
}

}  // namespace lightmill
