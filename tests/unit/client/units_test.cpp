// What people type and read.
#include "client/cli/units.h"

#include <gtest/gtest.h>

#include "client/cli/table.h"
#include "client/cli/text_width.h"

namespace lightmill::cli {
namespace {

TEST(Units, TimesGrowIntoLargerUnits) {
  EXPECT_EQ(human_seconds(0.44), "0.4 s");
  EXPECT_EQ(human_seconds(12.3), "12 s");
  EXPECT_EQ(human_seconds(59.6), "1:00");
  EXPECT_EQ(human_seconds(185), "3:05");
  EXPECT_EQ(human_seconds(7380), "2:03:00");
  EXPECT_EQ(human_seconds(4 * 86400 + 3 * 3600), "4 d 03:00");
  EXPECT_EQ(human_seconds(-1), "?");
  EXPECT_EQ(human_seconds(std::nan("")), "?");
}

TEST(Units, CountsKeepThreeDigits) {
  EXPECT_EQ(human_count(0), "0");
  EXPECT_EQ(human_count(950), "950");
  EXPECT_EQ(human_count(999.7), "1.00 k");
  EXPECT_EQ(human_count(1230), "1.23 k");
  EXPECT_EQ(human_count(45'600'000), "45.6 M");
  EXPECT_EQ(human_bytes(1023), "1023 B");
  EXPECT_EQ(human_bytes(1536), "1.50 KiB");
}

TEST(Units, SizesAreTwoNumbersWithinTheFilm) {
  EXPECT_EQ(*parse_size("640x480"), std::pair(640, 480));
  EXPECT_EQ(*parse_size("1X65536"), std::pair(1, 65536));
  for (const char* bad : {"", "640", "640x", "x480", "0x1", "1x65537", "-1x5", "64x64x64", "6 4x64", "64.5x64"}) {
    EXPECT_EQ(parse_size(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Units, CropsAreFourNumbers) {
  EXPECT_EQ(*parse_crop("0,10,64,32"), (PixelRect{0, 10, 64, 32}));
  for (const char* bad : {"", "1,2,3", "1,2,3,4,5", "0,0,0,1", "-1,0,1,1", "a,0,1,1", "0,0,1,", "0,0,1,1 "}) {
    EXPECT_EQ(parse_crop(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Units, TimesMayHaveAUnit) {
  EXPECT_EQ(*parse_seconds("90"), 90);
  EXPECT_EQ(*parse_seconds("1.5m"), 90);
  EXPECT_EQ(*parse_seconds("2h"), 7200);
  EXPECT_EQ(*parse_seconds("1d"), 86400);
  for (const char* bad : {"", "s", "0", "-5", "nan", "inf", "5x", "5 s"}) {
    EXPECT_EQ(parse_seconds(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Table, PadsColumnsAndCutsLongLines) {
  const std::vector<std::string> lines = format_table({{"A", "ERROR", "NAME"}, {"10", "±2%", "box"}}, 0);
  EXPECT_EQ(lines, (std::vector<std::string>{"A   ERROR  NAME", "10  ±2%    box"}));
  for (const std::string& line : format_table({{"A", "ERROR", "NAME"}, {"10", "±2%", "box"}}, 9)) {
    EXPECT_LE(columns_of(line), 9);
  }
}

}  // namespace
}  // namespace lightmill::cli
