// Film files, and the film hash that anyone can compute from a file.
#include "client/cli/film_fetch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/file.h"
#include "common/image/picture_file.h"
#include "tests/support/film_planes.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::cli {
namespace {

/// A film of two tiles with different counts, and its hash by the film's own definition.
std::pair<FilmPicture, Hash128> example_film() {
  const PixelRect crop{60, 10, 10, 5};
  const PixelRect left{60, 10, 4, 5}, right{64, 10, 6, 5};
  FilmPicture picture({0, 0, 128, 64}, {crop.x, crop.y, crop.width, crop.height});
  test::FilmPlanes planes(crop);
  std::uint64_t a = 2, b = 1;
  for (const PixelRect& rect : {left, right}) {
    std::vector<float> sums(6 * static_cast<std::size_t>(rect.pixel_count()));
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] = 0.37f * static_cast<float>(i * 7919 % 101);
    }
    place_sums(picture, {rect.x, rect.y, rect.width, rect.height}, a, b, sums);
    planes.set_tile(rect, sums, a, b);
    a = b = 7;
  }
  return {picture, film_hash(planes)};
}

TEST(FilmFile, HashOfThePictureIsTheHashOfTheFilm) {
  const auto [picture, hash] = example_film();
  EXPECT_EQ(film_hash_of(picture).hex(), hash.hex());
}

TEST(FilmFile, HashComputedFromTheFileEqualsItsStatedHash) {
  auto [picture, hash] = example_film();
  picture.receipt.film_hash = hash.hex();
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "film.exr").string();
  ASSERT_TRUE(write_outputs(picture, {{path}}).ok());
  const Result<FilmPicture> back = load_film_picture(path);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->receipt.film_hash, hash.hex());
  EXPECT_EQ(film_hash_of(*back).hex(), hash.hex());
}

TEST(FilmFile, LayersAreInTheFileAndInItsHash) {
  auto [picture, plain_hash] = example_film();
  for (const char* name : {"direct", "light:key", "normal", "features", "depth", "id"}) {
    picture.layers.push_back(make_picture_layer(name, picture.pixels()));
    for (float& value : picture.layers.back().values) {
      value = 0.25f * static_cast<float>(&value - picture.layers.back().values.data());
    }
  }
  EXPECT_NE(film_hash_of(picture).hex(), plain_hash.hex());
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "film.exr").string();
  ASSERT_TRUE(write_outputs(picture, {{path}}).ok());
  const Result<FilmPicture> back = load_film_picture(path);
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->layers.size(), 6u);
  EXPECT_EQ(back->layers[1].channels[2], "Light.key.B");
  EXPECT_EQ(back->layers[5].values, picture.layers[5].values);
  EXPECT_EQ(film_hash_of(*back).hex(), film_hash_of(picture).hex());
}

TEST(FilmFile, APictureThatCannotBeWrittenDoesNotStopTheOthersAndIsKept) {
  auto [picture, hash] = example_film();
  picture.receipt.film_hash = hash.hex();
  const test::TemporaryFolder folder;
  const std::string good = (folder.path() / "film.png").string(), bad = (folder.path() / "none" / "film.exr").string(),
                    kept = (folder.path() / fmt::format("lightmill-{:.16}.exr", hash.hex())).string();
  PictureOutputs outputs{{bad, good}};
  outputs.remedy = ". Fetch it";
  EXPECT_EQ(message_of(write_outputs(picture, outputs)),
            fmt::format("cannot write {}: No such file or directory. Written: {}. Fetch it", bad, good));
  EXPECT_TRUE(std::filesystem::exists(good));
  const test::ScopedTmpdir temporary(folder.path());
  outputs.is_only_copy = true;
  outputs.remedy = "";
  EXPECT_TRUE(message_of(write_outputs(picture, outputs)).ends_with(". The picture is kept in " + kept));
  const Result<FilmPicture> back = load_film_picture(kept);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(film_hash_of(*back).hex(), hash.hex());
}

TEST(FilmFile, ADenoisedPictureIsBesideTheRawOneAndNotInItsHash) {
  auto [picture, hash] = example_film();
  EXPECT_EQ(message_of(denoise(picture)),
            "the picture cannot be denoised, because its film has no layer \"features\": render it with --denoise");
  picture.layers.push_back(make_picture_layer("features", picture.pixels()));
  const std::string raw_hash = film_hash_of(picture).hex();
  ASSERT_TRUE(denoise(picture).ok());
  EXPECT_NE(picture.denoised, picture.beauty);
  EXPECT_EQ(film_hash_of(picture).hex(), raw_hash);
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "film.exr").string(), png = (folder.path() / "film.png").string();
  ASSERT_TRUE(write_outputs(picture, {{path, png}}).ok());
  const Result<FilmPicture> back = load_film_picture(path);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->beauty, picture.beauty);
  EXPECT_EQ(back->denoised, picture.denoised);
  EXPECT_EQ(to_image(*back).text(kFileChecksum), to_image(picture).text(kFileChecksum));
  // The PNG shows the denoised picture.
  FilmPicture only(picture.display, picture.data);
  only.beauty = picture.denoised;
  EXPECT_EQ(encode_picture(only, PictureFormat::png, {}).value(),
            encode_picture(picture, PictureFormat::png, {}).value());
  EXPECT_EQ(read_file(png).value(), encode_picture(picture, PictureFormat::png, {}).value());
}

TEST(FilmFile, APngShowsTheWantedLayer) {
  auto [picture, hash] = example_film();
  for (const char* name : {"albedo", "normal", "depth", "features"}) {
    picture.layers.push_back(make_picture_layer(name, picture.pixels()));
  }
  const std::size_t pixels = picture.pixels();
  std::vector<float>& albedo = picture.layers[0].values;
  std::vector<float>& normal = picture.layers[1].values;
  std::vector<float>& depth = picture.layers[2].values;
  albedo[0] = 1;              // red
  normal[0] = -1;             // of x
  normal[pixels] = 1;         // of y
  normal[2 * pixels] = 0.2f;  // of z
  depth[0] = 4;               // the nearest
  depth[1] = 8;
  const auto first_bytes = [&](const std::string& layer) {
    const test::TemporaryFolder folder;
    const std::string path = (folder.path() / "layer.png").string();
    EXPECT_TRUE(write_outputs(picture, {{path}, {}, false, layer}).ok());
    const RgbImage shown = load_rgb(path).value();
    std::vector<int> bytes;
    for (std::size_t pixel : {0, 1, 2}) {
      for (std::size_t channel : {0, 1, 2}) {
        bytes.push_back(static_cast<int>(std::lround(255 * srgb_encode(shown.values[channel * pixels + pixel]))));
      }
    }
    return bytes;
  };
  EXPECT_EQ(first_bytes("albedo"), (std::vector<int>{255, 0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(first_bytes("normal"), (std::vector<int>{0, 255, 153, 128, 128, 128, 128, 128, 128}));
  // Half the brightness is 188 of 255 in sRGB.
  EXPECT_EQ(first_bytes("depth"), (std::vector<int>{255, 255, 255, 188, 188, 188, 0, 0, 0}));
  EXPECT_EQ(message_of(write_outputs(picture, {{"layer.png"}, {}, false, "features"})),
            "the picture has no layer \"features\" that can be shown. Layers that can be shown: albedo, normal, depth");
  EXPECT_EQ(message_of(write_outputs(picture, {{"layer.png"}, {}, false, "direct"})),
            "the picture has no layer \"direct\" that can be shown. Layers that can be shown: albedo, normal, depth. "
            "Submit the job again with --layers direct");
  picture.layers.clear();
  EXPECT_EQ(message_of(write_outputs(picture, {{"layer.png"}, {}, false, "none-such"})),
            "the picture has no layer \"none-such\" that can be shown. Layers that can be shown: none");
}

TEST(FilmFile, OneChangedBitIsDetected) {
  const auto [picture, hash] = example_film();
  for (std::vector<float> FilmPicture::*half : {&FilmPicture::half_a, &FilmPicture::half_b}) {
    FilmPicture changed = picture;
    float& value = (changed.*half)[17];
    value = std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) ^ 1u);
    EXPECT_NE(film_hash_of(changed).hex(), hash.hex());
  }
}

TEST(Outputs, AreCheckedBeforeAnythingIsRendered) {
  const test::TemporaryFolder folder;
  const std::string good = (folder.path() / "a.exr").string();
  EXPECT_TRUE(check_outputs({good, (folder.path() / "b.PNG").string()}).ok());
  std::filesystem::create_directory(folder.path() / "c.png");
  for (const std::string& bad : {(folder.path() / "a.jpg").string(), (folder.path() / "no" / "a.exr").string(),
                                 (folder.path() / "c.png").string()}) {
    const Status status = check_outputs({good, bad});
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << bad;
    EXPECT_NE(message_of(status).find(bad), std::string::npos) << status;
  }
}

}  // namespace
}  // namespace lightmill::cli
