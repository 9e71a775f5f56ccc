#include "client/tev/tev_picture.h"

#include <gtest/gtest.h>

#include "client/tev/tev_packets.h"

namespace lightmill {
namespace {

constexpr int kPictureRows = 8;

/// A row of a picture two pixels wide.
TevTile row(int y, float value) {
  return {0, y, 2, 1, std::vector<float>(6, value)};
}
std::string packet_of(const TevTile& tile) {
  return tev_update_image("job", static_cast<int>(tile.x), static_cast<int>(tile.y), tile.width, tile.height,
                          tile.planes);
}
TevPicture picture() {
  return {"job", 2, kPictureRows};
}

TEST(TevPicture, IsCreatedFirstAndThenFilled) {
  TevPicture picture = lightmill::picture();
  picture.put(row(1, 0.5f));
  EXPECT_EQ(picture.next_packet(), tev_create_image("job", 2, kPictureRows, true));
  EXPECT_EQ(picture.next_packet(), packet_of(row(1, 0.5f)));
  EXPECT_EQ(picture.next_packet(), "");
}

TEST(TevPicture, AllTilesAreSentWhileTheTopChangesFasterThanItIsSent) {
  TevPicture picture = lightmill::picture();
  for (int y = 0; y < kPictureRows; ++y) {
    picture.put(row(y, 1));
  }
  picture.next_packet();
  std::set<std::string> sent;
  for (int i = 0; i < 2 * kPictureRows; ++i) {  // each row once, and the two at the top between
    sent.insert(picture.next_packet());
    picture.put(row(0, 2));
    picture.put(row(1, 2));
  }
  for (int y = 2; y < kPictureRows; ++y) {
    EXPECT_TRUE(sent.contains(packet_of(row(y, 1)))) << y;
  }
}

TEST(TevPicture, AWaitingTileIsSentOnceInItsNewestState) {
  TevPicture picture = lightmill::picture();
  picture.put(row(0, 1));
  picture.put(row(1, 1));
  picture.put(row(0, 2));
  picture.next_packet();
  EXPECT_EQ(picture.next_packet(), packet_of(row(0, 2)));
  EXPECT_EQ(picture.next_packet(), packet_of(row(1, 1)));
  EXPECT_EQ(picture.next_packet(), "");
}

TEST(TevPicture, ANewViewerGetsTheWholePicture) {
  TevPicture picture = lightmill::picture();
  picture.put(row(0, 1));
  picture.put(row(1, 1));
  picture.next_packet();
  picture.next_packet();  // one waits, one does not
  picture.start_over();
  EXPECT_EQ(picture.next_packet(), tev_create_image("job", 2, kPictureRows, true));
  EXPECT_EQ(picture.next_packet(), packet_of(row(0, 1)));
  EXPECT_EQ(picture.next_packet(), packet_of(row(1, 1)));
  EXPECT_EQ(picture.next_packet(), "");
}

TEST(TevPicture, TilesOutsideThePictureAreIgnored) {
  TevPicture picture = lightmill::picture();
  picture.next_packet();
  const std::vector<float> two(6);
  picture.put({1, 0, 2, 1, two});
  picture.put({-1, 0, 2, 1, two});
  picture.put({0, kPictureRows, 2, 1, two});
  picture.put({0, -1, 2, 1, two});
  picture.put({std::int64_t{1} << 40, 0, 2, 1, two});
  picture.put({0, 0, 0, 0, {}});
  picture.put({0, 0, 2, 2, two});
  picture.put({0, 0, std::numeric_limits<int>::min(), std::numeric_limits<int>::min(), two});
  EXPECT_EQ(picture.next_packet(), "");
}

}  // namespace
}  // namespace lightmill
