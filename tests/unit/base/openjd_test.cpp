#include "common/base/openjd.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(OpenJd, LinesAreThoseOfTheSpecification) {
  EXPECT_EQ(openjd_progress(0), "openjd_progress: 0.0");
  EXPECT_EQ(openjd_progress(0.1234), "openjd_progress: 12.3");
  EXPECT_EQ(openjd_progress(1.7), "openjd_progress: 100.0");
  EXPECT_EQ(openjd_status("half done"), "openjd_status: half done");
  EXPECT_EQ(openjd_fail("no\nline\x1b[31m of its own"), "openjd_fail: no line\\x1b[31m of its own");
}

}  // namespace
}  // namespace lightmill
