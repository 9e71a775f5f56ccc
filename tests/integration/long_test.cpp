// Like same_bits_test.cpp, but larger and longer.
#include <gtest/gtest.h>

#include "tests/support/farm.h"

namespace lightmill::test {
namespace {

TEST(SameBits, EightKilledWorkersKeepTheBits) {
  Farm farm;
  for (const char* name : {"w1", "w2", "w3"}) {
    farm.add_worker(2, name);
  }
  Picture picture;
  picture.side = 256;
  picture.samples = 400;
  const std::uint64_t job = farm.client().submit(picture).id();
  kill_workers(farm, job, picture, std::uint64_t{256} * 256 * 40, 8);
  expect_reference_film(farm.client(), job, picture);
}

}  // namespace
}  // namespace lightmill::test
