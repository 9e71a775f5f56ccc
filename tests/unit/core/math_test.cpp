#include <gtest/gtest.h>

#include <cmath>

#include "common/math/column.h"
#include "common/math/transcendental.h"
#include "common/math/vec.h"

namespace lightmill {
namespace {

TEST(Simd, ReverseBitsReversesAll32) {
  alignas(32) std::uint32_t in[8] = {1, 2, 0x80000000, 0xdeadbeef, 0, 0xffffffff, 0x00ff00ff, 0x12345678}, out[8];
  reverse_bits(U8::load(in)).store(out);
  for (int i = 0; i < 8; ++i) {
    std::uint32_t expected = 0;
    for (int bit = 0; bit < 32; ++bit) {
      expected |= (in[i] >> bit & 1u) << (31 - bit);
    }
    EXPECT_EQ(out[i], expected);
  }
}

TEST(Simd, CompressKeepsSetLanesInOrder) {
  for (int mask = 0; mask < 256; ++mask) {
    alignas(32) std::uint32_t out[8];
    permute(U8::lane_index(), compress_order(mask)).store(out);
    int n = 0;
    for (std::uint32_t lane = 0; lane < 8; ++lane) {
      if (mask >> lane & 1) {
        EXPECT_EQ(out[n++], lane);
      }
    }
  }
}

TEST(Column, EachLaneLoadsItsRowFromColumnsOfAnyLength) {
  for (std::uint32_t rows : {1u, 7u, 8u, 9u, 40u}) {
    Column<std::uint32_t> column;
    VectorColumn vectors;
    std::vector<float> rows_of_four;
    for (std::uint32_t row = 0; row < rows; ++row) {
      column.push_back(100 + row);
      const auto x = static_cast<float>(row);
      vectors.push_back({x, x + 0.25f, x + 0.5f});
      rows_of_four.insert(rows_of_four.end(), {x, x + 0.25f, x + 0.5f, -1});
    }
    for (int mask = 0; mask < 256; ++mask) {
      alignas(32) std::uint32_t wanted[8], on[8], found[8];
      for (std::uint32_t lane = 0; lane < 8; ++lane) {
        on[lane] = mask >> lane & 1 ? 0xffffffff : 0;
        wanted[lane] = on[lane] != 0 ? lane * 5 % rows : 0xfffffff0;  // masked lanes may hold anything
      }
      const U8 row = U8::load(wanted);
      const M8 lanes(U8::load(on).v);
      column.at(row, lanes).store(found);
      const V8 by_column = vectors.at(row, lanes), by_row = gather_rows_of_four(rows_of_four.data(), row, lanes);
      alignas(32) float values[2][3][8];
      int which = 0;
      for (const V8& v : {by_column, by_row}) {
        v.x.store(values[which][0]);
        v.y.store(values[which][1]);
        v.z.store(values[which++][2]);
      }
      for (std::uint32_t lane = 0; lane < 8; ++lane) {
        const bool set = on[lane] != 0;
        ASSERT_EQ(found[lane], set ? 100 + wanted[lane] : 0) << rows << " rows, mask " << mask;
        for (int axis = 0; axis < 3; ++axis) {
          const float expected = set ? static_cast<float>(wanted[lane]) + 0.25f * static_cast<float>(axis) : 0;
          ASSERT_EQ(values[0][axis][lane], expected);
          ASSERT_EQ(values[1][axis][lane], expected);
        }
      }
    }
  }
}

TEST(Transcendental, FloatSinCosTurnsAgreesWithTheCLibrary) {
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const float u = static_cast<float>(i) / 100'000.0f;
    alignas(32) float s[8], c[8];
    const SinCos8 r = sin_cos_turns(F8(u));
    r.sin.store(s);
    r.cos.store(c);
    worst = std::max(worst, std::abs(s[0] - std::sin(2 * M_PI * static_cast<double>(u))));
    worst = std::max(worst, std::abs(c[0] - std::cos(2 * M_PI * static_cast<double>(u))));
  }
  EXPECT_LT(worst, 4e-7);
}

float first_lane(F8 x) {
  alignas(32) float lanes[8];
  x.store(lanes);
  return lanes[0];
}

TEST(Transcendental, FloatAtan2AgreesWithTheCLibrary) {
  for (int i = 0; i < 20'000; ++i) {
    const double phi = -M_PI + 2 * M_PI * (i + 0.5) / 20'000;
    for (const double r : {1e-20, 0.3, 1.0, 7e10}) {
      const auto x = static_cast<float>(r * std::cos(phi)), y = static_cast<float>(r * std::sin(phi));
      const double exact = std::atan2(static_cast<double>(y), static_cast<double>(x));
      ASSERT_NEAR(first_lane(atan2(F8(y), F8(x))), exact, 3e-7 * std::abs(exact)) << phi;
    }
  }
  EXPECT_EQ(first_lane(atan2(F8(0.0f), F8(0.0f))), 0);
  EXPECT_EQ(first_lane(atan2(F8(0.0f), F8(2.0f))), 0);
  EXPECT_FLOAT_EQ(first_lane(atan2(F8(0.0f), F8(-2.0f))), kPi);
  EXPECT_FLOAT_EQ(first_lane(atan2(F8(-3.0f), F8(0.0f))), -kPi / 2);
}

TEST(Transcendental, DoubleFunctionsAgreeWithTheCLibrary) {
  for (int i = -20'000; i <= 20'000; ++i) {
    const double x = i * 0.4999;
    EXPECT_NEAR(sin_fixed(x), std::sin(x), 2e-14) << x;
    EXPECT_NEAR(cos_fixed(x), std::cos(x), 2e-14) << x;
  }
  for (int i = -157; i <= 157; ++i) {
    const double x = i * 0.01;
    EXPECT_NEAR(tan_fixed(x), std::tan(x), 1e-13 * (1 + std::tan(x) * std::tan(x))) << x;
  }
  for (int i = -700; i <= 700; ++i) {
    EXPECT_NEAR(exp_fixed(i) / std::exp(i), 1.0, 1e-13) << i;
  }
  for (int i = -1000; i <= 1000; ++i) {
    const double phi = i * M_PI / 1000.5, r = std::exp(i % 40);
    EXPECT_NEAR(atan2_fixed(r * std::sin(phi), r * std::cos(phi)), phi, 1e-14) << phi;
  }
  EXPECT_EQ(atan2_fixed(0, 0), 0);
}

TEST(Frame, IsOrthonormalForEveryNormal) {
  for (int i = 0; i < 2000; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 2000, phi = i * 2.399963;
    const double r = std::sqrt(1 - z * z);
    const V8 n = broadcast(Vec3(r * std::cos(phi), r * std::sin(phi), z));
    const Frame8 frame(n);
    alignas(32) float v[6][8];
    dot(frame.s, frame.s).store(v[0]);
    dot(frame.t, frame.t).store(v[1]);
    dot(frame.s, frame.t).store(v[2]);
    dot(frame.s, n).store(v[3]);
    dot(frame.t, n).store(v[4]);
    dot(cross(frame.s, frame.t), n).store(v[5]);
    EXPECT_NEAR(v[0][0], 1, 1e-5);
    EXPECT_NEAR(v[1][0], 1, 1e-5);
    EXPECT_NEAR(v[2][0], 0, 1e-5);
    EXPECT_NEAR(v[3][0], 0, 1e-5);
    EXPECT_NEAR(v[4][0], 0, 1e-5);
    EXPECT_NEAR(v[5][0], 1, 1e-5);
  }
}

}  // namespace
}  // namespace lightmill
