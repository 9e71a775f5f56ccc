// Workers on virtual hosts whose links are cut, work in one direction only, and lose packets.
#include <gtest/gtest.h>

#include "tests/support/farm.h"
#include "tests/support/networks.h"

namespace lightmill::test {
namespace {

constexpr int kPictureSide = 72;
constexpr std::uint64_t kPicturePixels = kPictureSide * kPictureSide;

class FaultyNetworks : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::optional<std::string> missing = Networks::missing()) {
      GTEST_SKIP() << *missing;
    }
    networks_.emplace(2);
    farm_.emplace(std::vector<std::string>{"--insecure"}, Launch{Networks::address(), {}, {}});
    for (int host = 0; host < 2; ++host) {
      farm_->add_worker(1, fmt::format("w{}", host + 1), {"", networks_->on_host(host), {}});
    }
    picture_.side = kPictureSide;
    picture_.samples = 500;
    job_ = client().submit(picture_).id();
    client().wait_for_samples(job_, kPicturePixels);
    ASSERT_TRUE(eventually([&] { return farm_->met("w1") && farm_->met("w2"); }));
  }
  void TearDown() override {
    if (farm_) {
      expect_reference_film(client(), job_, picture_);
    }
  }
  FarmClient client() { return farm_->client(); }

  std::optional<Networks> networks_;
  std::optional<Farm> farm_;
  Picture picture_;
  std::uint64_t job_ = 0;
};

TEST_F(FaultyNetworks, LinksCutInTurnKeepTheBits) {
  for (int host = 0; host < 2; ++host) {
    networks_->cut(host);
    EXPECT_TRUE(eventually([&] { return farm_->missed(fmt::format("w{}", host + 1)); }));
    networks_->mend(host);
  }
}

TEST_F(FaultyNetworks, OneWayLinksKeepTheBits) {
  networks_->lose_said(0, 100);
  networks_->lose_heard(1, 100);
  EXPECT_TRUE(eventually([&] { return farm_->missed("w1"); })) << farm_->server_log();
  EXPECT_TRUE(eventually([&] { return farm_->missed("w2"); })) << farm_->server_log();
  networks_->lose_said(0, 0);
  networks_->lose_heard(1, 0);
}

TEST_F(FaultyNetworks, LosingEveryTenthPacketKeepsTheBits) {
  for (int host = 0; host < 2; ++host) {
    networks_->lose_said(host, 10);
    networks_->lose_heard(host, 10);
  }
  client().wait_while_it_works(job_, picture_, kPicturePixels * 20);
}

}  // namespace
}  // namespace lightmill::test
