// Text of meter readings.
#include "client/cli/job_report.h"

#include <gtest/gtest.h>

namespace lightmill::cli {
namespace {

std::string text_of(double value, double half_width) {
  return reading_text({{"m", IrradianceMeter{}}, {value, half_width, 0, 0, {}, 16}});
}

TEST(MeterReport, ReadingsHaveTwoDigitsOfTheirError) {
  EXPECT_EQ(text_of(0.18071, 0.00034), "0.18071 ± 0.00034 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(123.4567, 0.2), "123.46 ± 0.20 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(540, 23), "540 ± 23 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(543.21, 230), "543 ± 230 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(0.4, 7.3), "0.4 ± 7.3 W/m², 0 ± 0 lx");
}

TEST(MeterReport, OnlyVeryLargeAndVerySmallNumbersHaveAnExponent) {
  EXPECT_EQ(text_of(999'999, 12'000), "999999 ± 12000 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(5.4321e7, 2.3e5), "5.432e+07 ± 2.3e+05 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(0.00012, 0.00001), "0.000120 ± 0.000010 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(5.4321e-7, 2.3e-9), "5.432e-07 ± 2.3e-09 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(0, 2.3e-9), "0e+00 ± 2.3e-09 W/m², 0 ± 0 lx");
}

TEST(MeterReport, ExactReadingsHaveAnErrorOfZero) {
  EXPECT_EQ(text_of(540, 0), "540 ± 0 W/m², 0 ± 0 lx");
  EXPECT_EQ(text_of(0.1, 1e-12), "0.1 ± 1e-12 W/m², 0 ± 0 lx");
}

}  // namespace
}  // namespace lightmill::cli
