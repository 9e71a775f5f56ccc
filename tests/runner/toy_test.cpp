// Tests of every kind, for the test of the runner. runner_test.py picks some for each run.
#include <cstdlib>

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(Toy, Passes) {}

TEST(Toy, Fails) {
  EXPECT_EQ(1, 2);
}

TEST(Toy, EndsTheProgram) {
  std::exit(0);
}

TEST(Toy, Crashes) {
  std::abort();
}

TEST(Toy, IsSkipped) {
  GTEST_SKIP() << "no such tool";
}

TEST(Toy, DISABLED_IsOff) {}

template <class T>
class TypedToy : public testing::Test {};
TYPED_TEST_SUITE(TypedToy, testing::Types<int>);

TYPED_TEST(TypedToy, PassesToo) {}

class ToyOfNothing : public testing::TestWithParam<int> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ToyOfNothing);

TEST_P(ToyOfNothing, IsNeverRun) {}

}  // namespace
}  // namespace lightmill
