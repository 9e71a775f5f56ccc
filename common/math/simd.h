// Eight lanes of floats, integers and masks on AVX2. All operations are exact or exactly rounded.
//
// There are no approximate reciprocals and no fused multiply-add, because their bits differ between processors and
// compilers.
#pragma once

#include <immintrin.h>

#include <bit>
#include <cstdint>

namespace lightmill {

/// A mask of 8 lanes. Each has all bits set, or none.
struct M8 {
  __m256 v;
  M8() : v(_mm256_setzero_ps()) {}
  explicit M8(__m256 value) : v(value) {}
  explicit M8(__m256i value) : v(_mm256_castsi256_ps(value)) {}
  explicit M8(bool all) : v(_mm256_castsi256_ps(_mm256_set1_epi32(all ? -1 : 0))) {}
  /// Lane i of the mask is bit i.
  int bits() const { return _mm256_movemask_ps(v); }
  bool any() const { return bits() != 0; }
  bool none() const { return bits() == 0; }
  int count() const { return std::popcount(static_cast<unsigned>(bits())); }
  __m256i i() const { return _mm256_castps_si256(v); }
};
inline M8 operator&(M8 a, M8 b) {
  return M8(_mm256_and_ps(a.v, b.v));
}
inline M8 operator|(M8 a, M8 b) {
  return M8(_mm256_or_ps(a.v, b.v));
}
inline M8 operator~(M8 a) {
  return M8(_mm256_xor_ps(a.v, M8(true).v));
}
/// a and not b.
inline M8 and_not(M8 a, M8 b) {
  return M8(_mm256_andnot_ps(b.v, a.v));
}

/// 8 unsigned 32-bit integers. Arithmetic wraps.
struct U8 {
  __m256i v;
  U8() : v(_mm256_setzero_si256()) {}
  U8(std::uint32_t all) : v(_mm256_set1_epi32(static_cast<int>(all))) {}  // NOLINT: broadcasts read as scalars
  explicit U8(__m256i value) : v(value) {}
  static U8 load(const std::uint32_t* p) { return U8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))); }
  void store(std::uint32_t* p) const { _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), v); }
  static U8 lane_index() { return U8(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)); }
};
inline U8 operator+(U8 a, U8 b) {
  return U8(_mm256_add_epi32(a.v, b.v));
}
inline U8 operator-(U8 a, U8 b) {
  return U8(_mm256_sub_epi32(a.v, b.v));
}
inline U8 operator*(U8 a, U8 b) {
  return U8(_mm256_mullo_epi32(a.v, b.v));
}
inline U8 operator^(U8 a, U8 b) {
  return U8(_mm256_xor_si256(a.v, b.v));
}
inline U8 operator&(U8 a, U8 b) {
  return U8(_mm256_and_si256(a.v, b.v));
}
inline U8 operator|(U8 a, U8 b) {
  return U8(_mm256_or_si256(a.v, b.v));
}
inline U8 operator>>(U8 a, int n) {
  return U8(_mm256_srli_epi32(a.v, n));
}
inline U8 operator<<(U8 a, int n) {
  return U8(_mm256_slli_epi32(a.v, n));
}
inline M8 operator==(U8 a, U8 b) {
  return M8(_mm256_cmpeq_epi32(a.v, b.v));
}
/// Compares as signed integers.
inline M8 signed_less(U8 a, U8 b) {
  return M8(_mm256_cmpgt_epi32(b.v, a.v));
}
inline U8 select(M8 mask, U8 yes, U8 no) {
  return U8(_mm256_blendv_epi8(no.v, yes.v, mask.i()));
}

/// 8 floats.
struct F8 {
  __m256 v;
  F8() : v(_mm256_setzero_ps()) {}
  F8(float all) : v(_mm256_set1_ps(all)) {}  // NOLINT: broadcasts read as scalars
  explicit F8(__m256 value) : v(value) {}
  static F8 load(const float* p) { return F8(_mm256_loadu_ps(p)); }
  void store(float* p) const { _mm256_storeu_ps(p, v); }
};
inline F8 operator+(F8 a, F8 b) {
  return F8(_mm256_add_ps(a.v, b.v));
}
inline F8 operator-(F8 a, F8 b) {
  return F8(_mm256_sub_ps(a.v, b.v));
}
inline F8 operator*(F8 a, F8 b) {
  return F8(_mm256_mul_ps(a.v, b.v));
}
inline F8 operator/(F8 a, F8 b) {
  return F8(_mm256_div_ps(a.v, b.v));
}
inline F8 operator-(F8 a) {
  return F8(_mm256_xor_ps(a.v, _mm256_set1_ps(-0.0f)));
}
inline F8& operator+=(F8& a, F8 b) {
  return a = a + b;
}
inline F8& operator*=(F8& a, F8 b) {
  return a = a * b;
}
inline M8 operator<(F8 a, F8 b) {
  return M8(_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ));
}
inline M8 operator<=(F8 a, F8 b) {
  return M8(_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ));
}
inline M8 operator>(F8 a, F8 b) {
  return M8(_mm256_cmp_ps(a.v, b.v, _CMP_GT_OQ));
}
inline M8 operator>=(F8 a, F8 b) {
  return M8(_mm256_cmp_ps(a.v, b.v, _CMP_GE_OQ));
}
inline M8 operator==(F8 a, F8 b) {
  return M8(_mm256_cmp_ps(a.v, b.v, _CMP_EQ_OQ));
}
/// b if either is NaN.
inline F8 min(F8 a, F8 b) {
  return F8(_mm256_min_ps(a.v, b.v));
}
inline F8 max(F8 a, F8 b) {
  return F8(_mm256_max_ps(a.v, b.v));
}
inline F8 sqrt(F8 a) {
  return F8(_mm256_sqrt_ps(a.v));
}
inline F8 abs(F8 a) {
  return F8(_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v));
}
/// |a| with the sign of b.
inline F8 copysign(F8 a, F8 b) {
  const __m256 sign = _mm256_set1_ps(-0.0f);
  return F8(_mm256_or_ps(_mm256_andnot_ps(sign, a.v), _mm256_and_ps(sign, b.v)));
}
inline F8 select(M8 mask, F8 yes, F8 no) {
  return F8(_mm256_blendv_ps(no.v, yes.v, mask.v));
}
inline M8 select(M8 mask, M8 yes, M8 no) {
  return M8(_mm256_blendv_ps(no.v, yes.v, mask.v));
}
/// a in the lanes of the mask, +0 in the others.
inline F8 masked(M8 mask, F8 a) {
  return F8(_mm256_and_ps(mask.v, a.v));
}

inline U8 masked(M8 mask, U8 a) {
  return U8(_mm256_and_si256(mask.i(), a.v));
}

inline U8 float_bits(F8 a) {
  return U8(_mm256_castps_si256(a.v));
}
inline F8 bits_float(U8 a) {
  return F8(_mm256_castsi256_ps(a.v));
}
/// Exact for integers below 2^24 (taken as signed).
inline F8 to_float(U8 a) {
  return F8(_mm256_cvtepi32_ps(a.v));
}
inline U8 truncate(F8 a) {
  return U8(_mm256_cvttps_epi32(a.v));
}

/// base[index] in the lanes of the mask, 0 in the others.
inline F8 gather(const float* base, U8 index, M8 mask) {
  return F8(_mm256_mask_i32gather_ps(_mm256_setzero_ps(), base, index.v, mask.v, 4));
}
inline U8 gather(const std::uint32_t* base, U8 index, M8 mask) {
  return U8(
      _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), reinterpret_cast<const int*>(base), index.v, mask.i(), 4));
}

/// The first `n` lanes.
inline M8 first_lanes(int n) {
  return M8(_mm256_cmpgt_epi32(_mm256_set1_epi32(n), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)));
}

namespace detail {
/// order[mask] moves the set lanes to the front, in order.
struct CompressTable {
  alignas(32) std::uint32_t order[256][8];
  constexpr CompressTable() : order{} {
    for (int mask = 0; mask < 256; ++mask) {
      int n = 0;
      for (int lane = 0; lane < 8; ++lane) {
        if (mask >> lane & 1) {
          order[mask][n++] = static_cast<std::uint32_t>(lane);
        }
      }
    }
  }
};
inline constexpr CompressTable kCompress{};
}  // namespace detail

/// The permutation that moves the set lanes of a mask to the front, in order.
inline U8 compress_order(int mask_bits) {
  return U8::load(detail::kCompress.order[mask_bits]);
}
inline F8 permute(F8 a, U8 order) {
  return F8(_mm256_permutevar8x32_ps(a.v, order.v));
}
inline U8 permute(U8 a, U8 order) {
  return U8(_mm256_permutevar8x32_epi32(a.v, order.v));
}

/// Reverses the 32 bits of each lane.
inline U8 reverse_bits(U8 x) {
  const __m256i low_nibbles = _mm256_set1_epi8(0x0f);
  const __m256i reversed_nibble = _mm256_setr_epi8(0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15,  //
                                                   0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15);
  const __m256i reversed_bytes = _mm256_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,  //
                                                  3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12);
  const __m256i bytes = _mm256_shuffle_epi8(x.v, reversed_bytes);
  const __m256i low = _mm256_shuffle_epi8(reversed_nibble, _mm256_and_si256(bytes, low_nibbles));
  const __m256i high = _mm256_shuffle_epi8(reversed_nibble, _mm256_and_si256(_mm256_srli_epi32(bytes, 4), low_nibbles));
  return U8(_mm256_or_si256(_mm256_slli_epi32(low, 4), high));
}

}  // namespace lightmill
