#include "common/lights/ies_profile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/lights/ies_light.h"
#include "tests/support/error_message.h"

namespace lightmill {
namespace {

/// A file with these angles and candela values.
std::string file(const std::string& vertical, int verticals, const std::string& horizontal, int horizontals,
                 const std::string& candela, const std::string& head = "IESNA:LM-63-2002", double multiplier = 1) {
  return fmt::format(
      "{}\r\n[TEST] a light\r\n[MANUFAC] none\r\nTILT=NONE\r\n1 1000 {} {} {} 1 2 0.1 0.2 0\r\n1 1 100\r\n{}\r\n{}\r\n"
      "{}\r\n",
      head, multiplier, verticals, horizontals, vertical, horizontal, candela);
}

IesProfile profile_of(const std::string& text) {
  auto profile = read_ies(text, "lamp.ies");
  EXPECT_TRUE(profile.ok()) << message_of(profile.status());
  return profile.ok() ? *profile : IesProfile{{0, 180}, {0, 360}, {0, 0, 0, 0}};
}
std::string error_of(const std::string& text) {
  return test::error_message(read_ies(text, "lamp.ies"));
}

TEST(IesProfile, IsExactAtTheAnglesGivenAndLinearBetween) {
  const IesProfile p = profile_of(file("0 45 90", 3, "0 90 180 360", 4, "10 20 30\n11,21,31 12 22\n32\n13 23 33"));
  for (int h = 0; h < 3; ++h) {
    for (int v = 0; v < 3; ++v) {
      EXPECT_EQ(p.at(45 * v, 90 * h), 10 + 10 * v + h);
    }
  }
  EXPECT_DOUBLE_EQ(p.at(22.5, 0), 15);
  EXPECT_DOUBLE_EQ(p.at(45, 45), 20.5);
  EXPECT_DOUBLE_EQ(p.at(67.5, 135), 26.5);
  EXPECT_DOUBLE_EQ(p.at(45, 270), 22.5);
  EXPECT_EQ(p.at(90.001, 0), 0);
  EXPECT_EQ(p.at(180, 0), 0);
}

TEST(IesProfile, SymmetriesAreMadeExplicit) {
  const IesProfile round = profile_of(file("0 90", 2, "0", 1, "8 2"));
  for (const double h : {0.0, 33.0, 200.0, 359.0, 360.0, -20.0}) {
    EXPECT_DOUBLE_EQ(round.at(45, h), 5);
  }
  const IesProfile quarter = profile_of(file("0 90", 2, "0 30 90", 3, "1 1 2 2 6 6"));
  for (const double h : {30.0, 150.0, 210.0, 330.0, -30.0, 390.0}) {
    EXPECT_DOUBLE_EQ(quarter.at(10, h), 2) << h;
  }
  EXPECT_DOUBLE_EQ(quarter.at(10, 60), 4);
  EXPECT_DOUBLE_EQ(quarter.at(10, 300), 4);
  const IesProfile half = profile_of(file("0 90", 2, "0 60 180", 3, "1 1 3 3 9 9"));
  EXPECT_DOUBLE_EQ(half.at(10, 300), 3);
  EXPECT_DOUBLE_EQ(half.at(10, 120), 6);
  EXPECT_DOUBLE_EQ(half.at(10, 240), 6);
  // 90 to 270: 180° − x has the values of x.
  const IesProfile side = profile_of(file("0 90", 2, "90 150 180 270", 4, "1 1 2 2 4 4 7 7"));
  EXPECT_DOUBLE_EQ(side.at(10, 150), 2);
  EXPECT_DOUBLE_EQ(side.at(10, 30), 2);
  EXPECT_DOUBLE_EQ(side.at(10, 0), 4);
  EXPECT_DOUBLE_EQ(side.at(10, 90), 1);
  EXPECT_DOUBLE_EQ(side.at(10, 270), 7);
  EXPECT_DOUBLE_EQ(side.at(10, 225), 5.5);
  EXPECT_DOUBLE_EQ(side.at(10, 315), 5.5);
}

// The same luminaire with and without the row of 360°.
TEST(IesProfile, ACircleWithoutItsLastAngleIsClosed) {
  for (const int count : {3, 5, 24, 64}) {
    std::string angles, candela;
    for (int i = 0; i < count; ++i) {
      angles += fmt::format("{:.4g} ", i * 360.0 / count);
      candela += fmt::format("{} {} ", i + 1, 2 * i + 1);
    }
    const IesProfile open = profile_of(file("0 180", 2, angles, count, candela));
    const IesProfile closed = profile_of(file("0 180", 2, angles + "360", count + 1, candela + "1 1"));
    EXPECT_EQ(open.horizontal, closed.horizontal);
    EXPECT_EQ(open.candela, closed.candela);
    EXPECT_TRUE(closed.notices.empty());
    ASSERT_EQ(open.notices.size(), 1u);
    EXPECT_EQ(open.notices[0],
              fmt::format("the horizontal angles end at {:.4g}: the values of angle 0 are repeated at 360",
                          (count - 1) * 360.0 / count));
    // Halfway between the last angle and 0.
    EXPECT_NEAR(open.at(0, 360 - 180.0 / count), (count + 1) / 2.0, 0.01 * count);
  }
  EXPECT_EQ(error_of(file("0 90", 2, "0 15 330", 3, "1 2 3 4 5 6")),
            "lamp.ies:9: horizontal angles must go from 0 to 0, 90, 180 or 360, or from 90 to 270, got 0 to 330");
}

TEST(IesProfile, VerticalAnglesThatEndEarlyHaveANotice) {
  for (const char* whole : {"0 90", "0 180", "90 180"}) {
    EXPECT_TRUE(profile_of(file(whole, 2, "0", 1, "8 2")).notices.empty()) << whole;
  }
  for (const auto& [angles, span] : {std::pair("0 85", "0 to 85"), {"5 90", "5 to 90"}, {"90 175", "90 to 175"}}) {
    const IesProfile p = profile_of(file(angles, 2, "0", 1, "8 2"));
    EXPECT_EQ(p.notices,
              (std::vector<std::string>{fmt::format(
                  "the vertical angles go from {}, not from 0 or 90 to 90 or 180: there is no light beyond", span)}));
    EXPECT_EQ(p.at(177, 0), 0);
  }
}

TEST(IesProfile, FactorsMultiplyTheFilesIntensities) {
  std::string text = file("0 90", 2, "0", 1, "8 2", "IESNA:LM-63-1995", 2.5);
  text.replace(text.find("\r\n1 1 100"), 10, "\r\n0.5 0.8 9");
  EXPECT_DOUBLE_EQ(profile_of(text).at(0, 0), 8 * 2.5 * 0.5 * 0.8);
  // Since 2002 the second one is for future use.
  const auto with_head = [&](std::string_view head) {
    std::string other = text;
    other.replace(0, std::string_view("IESNA:LM-63-1995").size(), head);
    return profile_of(other).at(0, 0);
  };
  EXPECT_DOUBLE_EQ(with_head("IESNA:LM-63-2002"), 8 * 2.5 * 0.5);
  EXPECT_DOUBLE_EQ(with_head("IES:LM-63-2019"), 8 * 2.5 * 0.5);
  // A file of 1986 has no such line. It begins with a label of any text.
  EXPECT_DOUBLE_EQ(with_head("REPORT NO. 2002-117 OF 5/20/1987"), 8 * 2.5 * 0.5 * 0.8);
  EXPECT_DOUBLE_EQ(with_head("CATALOG 201907"), 8 * 2.5 * 0.5 * 0.8);
}

TEST(IesProfile, TiltFactorsAreSkipped) {
  std::string text = file("0 90", 2, "0", 1, "8 2");
  text.replace(text.find("TILT=NONE\r\n"), 11, "TILT=INCLUDE\r\n1\r\n3\r\n0 45 90\r\n1 0.9 0.8\r\n");
  EXPECT_DOUBLE_EQ(profile_of(text).at(0, 0), 8);
  const std::vector<std::string> notices{
      "the factors for tilted mounting (TILT) are left out: the light has its measured intensity"};
  EXPECT_EQ(profile_of(text).notices, notices);
  EXPECT_TRUE(profile_of(file("0 90", 2, "90 270", 2, "8 2 8 2")).notices.empty());
  text.replace(text.find("TILT=INCLUDE\r\n1\r\n3\r\n0 45 90\r\n1 0.9 0.8"), 38, "TILT=lamp.tlt");
  EXPECT_EQ(profile_of(text).notices, notices);
  EXPECT_DOUBLE_EQ(profile_of(text).at(0, 0), 8);
}

TEST(IesProfile, FluxIsTheIntegralOfTheIntensity) {
  // Bilinear in the angles, so the midpoint rule converges to the closed form.
  const IesProfile p =
      profile_of(file("0 20 70 130", 4, "0 90 180 300 360", 5, "9 8 4 1  9 7 5 2  9 1 1 1  9 3 6 2  9 8 4 1"));
  double sum = 0;
  constexpr int kSteps = 1300;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < 720; ++j) {
      const double v = 130 * (i + 0.5) / kSteps;
      sum += p.at(v, 0.5 * (j + 0.5)) * std::sin(v * M_PI / 180);
    }
  }
  sum *= (130.0 / kSteps) * 0.5 * std::pow(M_PI / 180, 2);
  EXPECT_NEAR(p.lumen() / sum, 1, 1e-5);
  // A uniform intensity of I cd emits 4π·I lm.
  EXPECT_NEAR(profile_of(file("0 180", 2, "0", 1, "100 100")).lumen(), 400 * M_PI, 1e-9);
}

TEST(IesProfile, MistakesAreNamedWithTheirLine) {
  EXPECT_EQ(error_of(""), "lamp.ies:1: there is no line TILT=. Is this an IES file?");
  EXPECT_EQ(error_of("hello\nworld\n"), "lamp.ies:2: there is no line TILT=. Is this an IES file?");
  EXPECT_EQ(error_of("IESNA91\nTILT=NONE\n1 1000 1 2"),
            "lamp.ies:3: the number of horizontal angles is expected, but the file ends");
  EXPECT_EQ(error_of(file("0 x", 2, "0", 1, "1 2")), "lamp.ies:7: vertical angle is expected, got \"x\"");
  EXPECT_EQ(error_of(file("0 190", 2, "0", 1, "1 2")), "lamp.ies:7: vertical angle must be in [0, 180], got 190");
  EXPECT_EQ(error_of(file("90 0", 2, "0", 1, "1 2")), "lamp.ies:7: vertical angles must ascend, got 0 after 90");
  EXPECT_EQ(error_of(file("0 90", 2, "0 100", 2, "1 2 3 4")),
            "lamp.ies:9: horizontal angles must go from 0 to 0, 90, 180 or 360, or from 90 to 270, got 0 to 100");
  EXPECT_EQ(error_of(file("0 90", 2, "0", 1, "1 -2")),
            "lamp.ies:9: a candela value must be in [0, 1000000000000], got -2");
  EXPECT_EQ(error_of(file("0 90", 2, "0", 1, "1 nan")), "lamp.ies:9: a candela value is expected, got \"nan\"");
  EXPECT_EQ(error_of(file("0", 1, "0", 1, "1")),
            "lamp.ies:5: the number of vertical angles must be in [2, 4096], got 1");
  std::string type_b = file("0 90", 2, "0", 1, "1 2");
  type_b.replace(type_b.find(" 1 2 0.1"), 4, " 2 2");
  EXPECT_EQ(error_of(type_b), "lamp.ies:5: only photometric type C (1) can be read, this file is of type B (2)");
  std::string type_a = type_b;
  type_a.replace(type_a.find(" 2 2 0.1"), 4, " 3 2");
  EXPECT_EQ(error_of(type_a), "lamp.ies:5: only photometric type C (1) can be read, this file is of type A (3)");
}

// 1025 vertical and 1025 horizontal angles up to 90°: 4097 with the other quarters, 4.2 million values.
TEST(IesProfile, SizeIsLimitedWithTheSymmetries) {
  std::string angles = "0";
  for (int i = 1; i < 1025; ++i) {
    angles += fmt::format(" {}", i * 90 / 1024.0);
  }
  EXPECT_EQ(
      error_of(file(angles, 1025, angles, 1025, "")),
      "lamp.ies:8: 1025 vertical and 1025 horizontal angles, 4097 with their symmetry, are more than the limit of "
      "4194304 values");
  // One vertical angle less would be accepted if there were values.
  const std::string fewer = angles.substr(0, angles.rfind(' '));
  EXPECT_EQ(error_of(file(fewer, 1024, "0 90", 2, "")), "lamp.ies:10: a candela value is expected, but the file ends");
}

/// Intensity (1 W/sr for each candela) that a light with the profile sends towards a direction.
double sent(const IesProfile& profile, const Vec3d& direction) {
  IesLights lights;
  const std::size_t index = lights.add_profile(profile);
  lights.add({Vec3(0), {0, -1, 0}, {1, 0, 0}, Vec3(1), index});
  alignas(32) float weight[8];
  lights.sample(broadcast(Vec3(direction * 2.0)), U8(0u), M8(true)).weight.x.store(weight);
  return weight[3] * 4;  // at distance 2
}

TEST(IesLight, LanesAgreeWithTheProfile) {
  const IesProfile p =
      profile_of(file("0 20 70 130", 4, "0 90 180 300 360", 5, "9 8 4 1  9 7 5 2  9 1 1 1  9 3 6 2  9 8 4 1"));
  for (double v = 1; v < 130; v += 7.3) {
    for (double h = 1; h < 360; h += 11.9) {
      const double theta = v * M_PI / 180, phi = h * M_PI / 180;
      // Vertical 0 is down; horizontal 0 is +x, and 90 is −direction × reference = −z.
      const Vec3d d(std::sin(theta) * std::cos(phi), -std::cos(theta), -std::sin(theta) * std::sin(phi));
      ASSERT_NEAR(sent(p, d), p.at(v, h), 2e-5 * p.at(v, h)) << v << ' ' << h;
    }
  }
  EXPECT_EQ(sent(p, {0, 1, 0}), 0);
  EXPECT_NEAR(sent(p, {0, -1, 0}), 9, 1e-5);
}

// Neighbouring columns differ much, so a lookup that misses by one column shows.
TEST(IesLight, FindsOneOf16381HorizontalAngles) {
  std::string angles, candela;
  for (int i = 0; i < 4096; ++i) {
    angles += fmt::format("{} ", i == 4095 ? 90 : i * 90 / 4095.0);
    candela += i % 2 == 0 ? "1 1 " : "3 3 ";
  }
  const IesProfile p = profile_of(file("0 180", 2, angles, 4096, candela));
  ASSERT_EQ(p.horizontal.size(), 16381u);
  for (double h = 0.3; h < 360; h += 3.7) {
    const double phi = h * M_PI / 180;
    // Single precision resolves angles to about 0.00003°, and a column is 0.022° wide: 2 cd · 0.0014.
    EXPECT_NEAR(sent(p, {std::cos(phi), 0, -std::sin(phi)}), p.at(90, h), 0.02) << h;
  }
}

}  // namespace
}  // namespace lightmill
