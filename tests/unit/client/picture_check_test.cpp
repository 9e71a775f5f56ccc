// Pictures that contradict their receipts.
#include "client/cli/picture_check.h"

#include <gtest/gtest.h>

#include <fstream>

#include "client/cli/film_fetch.h"
#include "common/base/file.h"
#include "common/image/exr.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::cli {
namespace {

constexpr ImageWindow kSixTiles{10, 5, 150, 90}, kTwoBlocksOfLines{10, 5, 4, 18};

/// `data` of 200×100 pixels with 3 samples and a layer, of the scene "scene".
FilmPicture example(const ImageWindow& data) {
  FilmPicture picture({0, 0, 200, 100}, data);
  picture.layers.push_back(make_picture_layer("albedo", picture.pixels()));
  const PixelRect crop{data.x, data.y, data.width, data.height};
  const TileGrid grid(crop);
  for (std::uint32_t tile = 0; tile < grid.tile_count(); ++tile) {
    const PixelRect rect = grid.tile_rect(TileId{tile});
    std::vector<float> sums(2 * summed_channels(picture) * static_cast<std::size_t>(rect.pixel_count()));
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] = 0.37f * static_cast<float>((i + tile) * 7919 % 101);
    }
    place_sums(picture, {rect.x, rect.y, rect.width, rect.height}, 2, 1, sums);
  }
  Receipt& receipt = picture.receipt;
  receipt.scene_digest = sha256("scene").hex();
  receipt.renderer_version = "core-x";
  receipt.fingerprint_class = "class";
  receipt.method = "path";
  receipt.seed = 7;
  receipt.min_samples = receipt.max_samples = 3;
  RenderSettings settings;
  settings.scene = "scene";
  settings.width = 200;
  settings.height = 100;
  settings.crop = crop;
  settings.layers = film_layers(std::vector<std::string>{"albedo"}).value();
  settings.seed = 7;
  settings.renderer_version = "core-x";
  receipt.render_digest = render_digest(settings, "class").hex();
  receipt.film_hash = film_hash_of(picture).hex();
  return picture;
}

class PictureFile : public testing::Test {
 protected:
  PictureFile() { write(kSixTiles); }
  void write(const ImageWindow& data) {
    EXPECT_TRUE(write_outputs(example(data), {{path_}}).ok());
    bytes_ = read_file(path_).value();
  }
  const std::string& bytes() const { return bytes_; }
  Status loaded(const std::string& changed) const {
    EXPECT_TRUE(std::ofstream(path_, std::ios::binary) << changed);
    return load_sound_picture(path_).status();
  }
  /// The file with one change, and otherwise sound.
  template <class Change>
  std::string with(const Change& change) const {
    Image image = decode_exr(as_byte_view(bytes_)).value();
    for (const char* name : {"pixelAspectRatio", "screenWindowWidth"}) {
      image.attributes.erase(name);
    }
    change(image);
    return encode_exr(image).value();
  }

  test::TemporaryFolder folder_;
  std::string path_ = (folder_.path() / "picture.exr").string();
  std::string bytes_;  ///< as written
};

TEST_F(PictureFile, IsSoundAsWritten) {
  const Result<FilmPicture> picture = load_sound_picture(path_);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_TRUE(settings_of(*picture, "scene", {}).ok());
  EXPECT_TRUE(loaded(with([](Image&) {})).ok()) << "written again as it is";
}

TEST_F(PictureFile, OneChangedBitOfAnyChannelIsFound) {
  const std::string& whole = bytes();
  const Image image = decode_exr(as_byte_view(whole)).value();
  for (std::size_t i = 0; i < image.channels.size(); ++i) {
    const Status status = loaded(with([&](Image& changed) {
      std::visit(
          [](auto& values) {
            values[values.size() / 3] = std::bit_cast<typename std::decay_t<decltype(values)>::value_type>(
                std::bit_cast<std::uint32_t>(values[values.size() / 3]) ^ 1u);
          },
          changed.channels[i].values);
    }));
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << image.channels[i].name;
  }
}

TEST_F(PictureFile, AChangedAttributeIsFound) {
  const std::string& whole = bytes();
  const Image image = decode_exr(as_byte_view(whole)).value();
  for (const auto& [name, value] : image.attributes) {
    if (name == "pixelAspectRatio" || name == "screenWindowWidth") {
      continue;  // OpenEXR's own
    }
    const Status status = loaded(with([name = name](Image& changed) {
      std::visit(
          [](auto& attribute) {
            using Value = std::decay_t<decltype(attribute)>;
            if constexpr (std::is_same_v<Value, std::string>) {
              attribute += "0";
            } else if constexpr (std::is_arithmetic_v<Value>) {
              attribute += 1;
            } else {
              attribute[0] += 1;
            }
          },
          changed.attributes[name]);
    }));
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << name << ": " << status;
    EXPECT_NE(loaded(with([name = name](Image& changed) { changed.attributes.erase(name); })).code(), StatusCode::kOk)
        << name;
  }
}

TEST_F(PictureFile, AChangedBitOfTheHeaderOrTheLineTableIsFound) {
  write(kTwoBlocksOfLines);
  const std::string& whole = bytes();
  const std::size_t end = whole.find("screenWindowWidth") + 40;  // its header, and part of the table of lines
  ASSERT_LT(end, whole.size());
  for (std::size_t byte = 4; byte < end; ++byte) {  // the first four say that it is an EXR
    std::string changed = whole;
    changed[byte] = static_cast<char>(changed[byte] ^ 1 << byte % 8);
    const Status status = loaded(changed);
    ASSERT_EQ(status.code(), StatusCode::kDataLoss) << "bit " << byte % 8 << " of byte " << byte << ": " << status;
  }
}

TEST_F(PictureFile, TrailingBytesAreFound) {
  EXPECT_EQ(loaded(bytes() + "x").code(), StatusCode::kDataLoss);
}

TEST_F(PictureFile, AnotherKindOfFileIsNotADamagedPicture) {
  EXPECT_EQ(loaded("\x89PNG\r\n\x1a\n and more").code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(loaded(with([](Image& changed) { changed.attributes.clear(); })).code(), StatusCode::kInvalidArgument);
}

TEST_F(PictureFile, ATruncatedFileIsFound) {
  const std::string& whole = bytes();
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{5}, whole.size() / 3, whole.size() / 2, whole.size() - 1}) {
    EXPECT_EQ(loaded(whole.substr(0, size)).code(), StatusCode::kDataLoss) << size;
  }
}

TEST_F(PictureFile, AContradictoryReceiptIsFoundUnderAnyChecksum) {
  const auto forged = [&](const char* name, const char* value) {
    const Status status = loaded(with([&](Image& changed) {
      changed.attributes[name] = std::string(value);
      changed.attributes[kFileChecksum] = file_checksum(changed);
    }));
    return status.ok() ? settings_of(*load_sound_picture(path_), "scene", {}).status() : status;
  };
  EXPECT_TRUE(forged("lightmill.name", "other").ok()) << "the job's name is not checked";
  for (const auto& [name, value] :
       {std::pair("lightmill.seed", "8"), std::pair("lightmill.method", "ppm"),
        std::pair("lightmill.fingerprintClass", "other"), std::pair("lightmill.maxBounces", "3"),
        std::pair("lightmill.maxSamples", "4"), std::pair("lightmill.filmHash", "00112233445566778899aabbccddeeff")}) {
    EXPECT_EQ(forged(name, value).code(), StatusCode::kDataLoss) << name;
  }
}

TEST(PictureSettings, AnotherSceneOrAssetIsRefused) {
  const FilmPicture picture = example(kSixTiles);
  EXPECT_EQ(settings_of(picture, "another scene", {}).status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(settings_of(picture, "scene", {sha256("asset")}).status().code(), StatusCode::kDataLoss);
}

TEST(DrawnTiles, AreAShareOfAtLeastOneWithEqualChances) {
  const FilmPicture picture = example(kSixTiles);
  EXPECT_EQ(draw_tiles(picture, 0, 1).size(), 1u);
  EXPECT_EQ(draw_tiles(picture, 0.5, 1).size(), 3u);
  EXPECT_EQ(draw_tiles(picture, 1, 1).size(), 6u);
  EXPECT_EQ(draw_tiles(picture, 0.5, 9), draw_tiles(picture, 0.5, 9));
  std::map<TileId, int> drawn;
  for (std::uint64_t seed = 0; seed < 6000; ++seed) {
    for (const TileId tile : draw_tiles(picture, 0.01, seed)) {
      ++drawn[tile];
    }
  }
  for (const auto& [tile, times] : drawn) {
    EXPECT_NEAR(times, 1000, 145) << tile.value;  // five standard deviations of binomial(6000, 1/6)
  }
}

TEST(ComparedTile, DiffersByOneBitOfAnyChannel) {
  const FilmPicture picture = example(kSixTiles);
  const PixelRect rect{64, 5, 64, 59};
  const auto again = [&] {
    FilmPicture tile(picture.display, {rect.x, rect.y, rect.width, rect.height});
    tile.layers.push_back(make_picture_layer("albedo", tile.pixels()));
    std::vector<float> sums(2 * summed_channels(tile) * tile.pixels());
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] = 0.37f * static_cast<float>((i + 1) * 7919 % 101);
    }
    place_sums(tile, {rect.x, rect.y, rect.width, rect.height}, 2, 1, sums);
    return tile;
  };
  EXPECT_EQ(compare_tile(picture, again(), rect), "");
  EXPECT_EQ(samples_of(picture, rect).value(), 3u);
  FilmPicture changed = again();
  changed.half_b[changed.pixels() + 17] = std::nextafter(changed.half_b[changed.pixels() + 17], 1e9f);
  EXPECT_EQ(compare_tile(picture, changed, rect), "B.G (1 values)");
  changed = again();
  changed.layers[0].values.back() += 1;
  EXPECT_EQ(compare_tile(picture, changed, rect), changed.layers[0].channels.back() + " (1 values)");
  changed = again();
  changed.samples_a[3] += 1;
  EXPECT_EQ(compare_tile(picture, changed, rect), "A.samples (1 values)");
}

TEST(ComparedTile, HasNoGapsInItsSamples) {
  FilmPicture picture = example(kSixTiles);
  const PixelRect rect{64, 5, 64, 59};
  picture.samples_a[100] += 1;
  EXPECT_EQ(samples_of(picture, rect).status().code(), StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace lightmill::cli
