#include "client/cli/scene_options.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/image/exr.h"
#include "common/image/png.h"
#include "tests/support/image_files.h"
#include "tests/support/paths.h"

namespace lightmill::cli {
namespace {

/// A scene with an image, named by "place".
LoadedScene scene_with(const std::string& name, const std::string& bytes, bool environment) {
  LoadedScene loaded;
  const Sha256 asset = sha256(bytes);
  loaded.assets.emplace(asset, bytes);
  loaded.images.push_back({asset, name, "place", environment});
  return loaded;
}

/// An EXR file of one row.
std::string exr(const std::vector<float>& values) {
  const int width = static_cast<int>(values.size());
  Image image;
  image.display = image.data = {0, 0, width, 1};
  for (const char* channel : {"R", "G", "B"}) {
    image.channels.push_back({channel, values});
  }
  return *encode_exr(image);
}

Status check(LoadedScene& loaded) {
  const Signals signals;
  DecoderProcess decoder({.program = test::program("lightmill-image-decoder")});
  return check_images(decoder, loaded, signals);
}

std::string problem(const std::string& name, const std::string& bytes, bool environment = false) {
  LoadedScene loaded = scene_with(name, bytes, environment);
  return message_of(check(loaded));
}

TEST(ImageCheck, UsableImagesAreAccepted) {
  const std::vector<std::uint8_t> grey(6, 128);
  for (const auto& [name, bytes] : {std::pair{"a.png", *encode_png(2, 1, grey)}, std::pair{"a.exr", exr({0, 1e4f})}}) {
    LoadedScene loaded = scene_with(name, bytes, true);
    EXPECT_TRUE(check(loaded).ok()) << check(loaded);
    EXPECT_TRUE(loaded.notices.empty());
  }
}

TEST(ImageCheck, BadImagesAreRefusedWithTheirPlace) {
  const std::vector<std::uint8_t> grey(3 * 64 * 64, 128);
  const std::string png = *encode_png(64, 64, grey);
  const std::string good = exr(std::vector<float>(256, 0.5f));
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"a.png", ""},
           {"a.png", "root:x:0:0:root"},
           {"passwd", "root:x:0:0:root"},
           {"a.png", png.substr(0, png.size() / 2)},
           {"a.exr", good.substr(0, good.size() / 2)},
       }) {
    EXPECT_TRUE(problem(name, bytes).starts_with("place: " + name + ": ")) << problem(name, bytes);
  }
  EXPECT_EQ(problem("a.exr", exr({0, std::numeric_limits<float>::infinity()})),
            "place: a.exr: pixel (1, 0) is not finite");
  EXPECT_EQ(problem("a.exr", test::image_file_of_words("exr", std::numeric_limits<float>::infinity())),
            "place: a.exr: pixel (0, 0) is not finite");
}

TEST(ImageCheck, AnEnvironmentHasALimit) {
  const std::string wide = exr(std::vector<float>(65'537, 0.5f));
  EXPECT_EQ(problem("a.exr", wide, false), "");
  EXPECT_EQ(problem("a.exr", wide, true),
            "place: a.exr: an environment may have at most 65536 pixels on a side, got 65537x1");
}

TEST(ImageCheck, NegativeValuesAreReportedOnce) {
  LoadedScene loaded = scene_with("a.exr", exr({-1, 0, -1e-3f, 2}), false);
  loaded.images.push_back(loaded.images.front());
  ASSERT_TRUE(check(loaded).ok());
  EXPECT_EQ(loaded.notices, std::vector<std::string>{"place: a.exr: negative values count as 0 (pixels: 2 of 4)"});
  LoadedScene halves = scene_with("a.exr", test::image_file_of_words("exr", -0.5f), false);
  ASSERT_TRUE(check(halves).ok());
  EXPECT_EQ(halves.notices, std::vector<std::string>{"place: a.exr: negative values count as 0 (pixels: 256 of 256)"});
  LoadedScene zero = scene_with("a.exr", test::image_file_of_words("exr", -0.0f), false);
  ASSERT_TRUE(check(zero).ok());
  EXPECT_TRUE(zero.notices.empty());
}

TEST(ImageCheck, AnEnvironmentThatIsNotTwiceAsWideAsHighHasANotice) {
  for (const auto& [width, environment, notice] : std::vector<std::tuple<std::size_t, bool, std::string>>{
           {6, true,
            "place: a.exr: its 6x1 pixels are stretched over all longitudes and latitudes. Such an image is twice as "
            "wide as high"},
           {3, true, ""},
           {2, true, ""},
           {6, false, ""}}) {
    LoadedScene loaded = scene_with("a.exr", exr(std::vector<float>(width, 1)), environment);
    ASSERT_TRUE(check(loaded).ok());
    EXPECT_EQ(loaded.notices, notice.empty() ? std::vector<std::string>() : std::vector<std::string>{notice});
  }
}

TEST(ImageCheck, IgnoredPropertiesHaveNotices) {
  // A JPEG whose Exif segment says that the left edge of the pixels is the top of the picture.
  const std::string segment(
      "\xff\xe1\0\x22"
      "Exif\0\0MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\x06\0\0\0\0\0\0",
      36);
  LoadedScene loaded = scene_with("a.jpg", test::image_file("jpg", 0.5f).insert(2, segment), false);
  ASSERT_TRUE(check(loaded).ok());
  EXPECT_EQ(loaded.notices,
            std::vector<std::string>{"place: a.jpg: its Exif orientation is ignored: the pixels count as "
                                     "they are stored"});
}

TEST(ImageCheck, AMissingDecoderIsReported) {
  LoadedScene none, one = scene_with("a.exr", exr({1}), false);
  const Signals signals;
  DecoderProcess decoder({.program = "/nowhere"});
  EXPECT_TRUE(check_images(decoder, none, signals).ok());
  const std::string message = message_of(check_images(decoder, one, signals));
  EXPECT_TRUE(message.starts_with("place: a.exr: cannot start /nowhere: ")) << message;
}

}  // namespace
}  // namespace lightmill::cli
