// Pictures: colour, files and error metrics, compared with closed forms.
#include <gtest/gtest.h>

#include "common/image/cryptomatte.h"
#include "common/image/picture_layers.h"

#include <cmath>
#include <limits>

#include "common/base/file.h"
#include "common/image/color.h"
#include "common/image/error_metrics.h"
#include "common/image/exr.h"
#include "common/image/film_picture.h"
#include "common/image/picture_file.h"
#include "common/image/png.h"

namespace lightmill {
namespace {

FilmPicture example_picture() {
  FilmPicture picture({0, 0, 100, 50}, {10, 20, 6, 4});
  for (const ImageWindow rect : {ImageWindow{10, 20, 4, 4}, ImageWindow{14, 20, 2, 4}}) {
    const auto pixels = static_cast<std::size_t>(rect.pixel_count());
    std::vector<float> sums(6 * pixels);
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] = 0.1f * static_cast<float>(i * i % 17) + static_cast<float>(rect.x);
    }
    place_sums(picture, rect, 3, 2, sums);
  }
  picture.receipt.film_hash = "00ff";
  picture.receipt.asset_digests = {"aa", "bb"};
  picture.receipt.seed = 18'446'744'073'709'551'615u;
  picture.receipt.max_samples = 5;
  picture.receipt.rel_mse = 0.1;
  picture.receipt.rel_mse_half_width = 0.025;
  picture.receipt.ended = "reached relMSE 0.098 ± 0.025 at 5 samples per pixel";
  picture.receipt.seconds = 1.5;
  picture.receipt.method_reasons = {"it finds all"};
  picture.receipt.notices = {"path: light is missing", "and more"};
  picture.receipt.owner = "ada";
  return picture;
}

TEST(Color, SrgbHitsTheStandardsValues) {
  EXPECT_EQ(srgb_encode(0.0f), 0.0f);
  EXPECT_EQ(srgb_encode(1.0f), 1.0f);
  EXPECT_EQ(srgb_encode(7.0f), 1.0f);
  EXPECT_EQ(srgb_encode(-1.0f), 0.0f);
  EXPECT_EQ(srgb_encode(std::nanf("")), 0.0f);
  EXPECT_NEAR(srgb_encode(0.0031308f), 0.04045f, 1e-5);
  EXPECT_NEAR(srgb_encode(0.5f), 0.7353570f, 1e-6);
  EXPECT_NEAR(srgb_encode(0.2140411f), 0.5f, 1e-6);
  for (int i = 0; i <= 1000; ++i) {
    const float x = static_cast<float>(i) / 1000;
    EXPECT_NEAR(srgb_decode(srgb_encode(x)), x, 2e-6) << i;
  }
}

TEST(Color, EveryByteSurvivesDecodeAndEncode) {
  for (int byte = 0; byte < 256; ++byte) {
    EXPECT_EQ(std::lround(255 * srgb_encode(srgb_decode(static_cast<float>(byte) / 255))), byte);
  }
}

TEST(Color, FilmicRisesFromBlackTowardsWhite) {
  EXPECT_EQ(filmic_curve(0), 0);
  EXPECT_NEAR(filmic_curve(1), 2.54 / 3.16, 1e-6);
  EXPECT_NEAR(filmic_curve(0.18f), 0.18 * 0.4818 / (0.18 * 1.0274 + 0.14), 1e-6);
  EXPECT_EQ(filmic_curve(std::numeric_limits<float>::infinity()), 1);
  EXPECT_EQ(filmic_curve(std::nanf("")), 0);
  for (float x = 0; x < 5; x += 0.01f) {
    EXPECT_LE(filmic_curve(x), filmic_curve(x + 0.01f));
  }
}

TEST(Color, GammaRaisesShownValuesToAPower) {
  const RgbImage image{1, 1, {0.25f, 0.0f, 4.0f}}, root{1, 1, {0.5f, 0.0f, 1.0f}};
  EXPECT_EQ(to_srgb8(image, {0, View::plain, 2}), to_srgb8(root, {}));
  const RgbImage filmic{1, 1, {filmic_curve(0.25f), 0.0f, filmic_curve(4.0f)}};
  EXPECT_EQ(to_srgb8(image, {0, View::filmic, 0.5}), to_srgb8(filmic, {0, View::plain, 0.5}));
}

TEST(Color, AStopDoublesTheLight) {
  const RgbImage image{1, 1, {0.25f, 0.1f, 0.0f}};
  const RgbImage twice{1, 1, {0.5f, 0.2f, 0.0f}};
  EXPECT_EQ(to_srgb8(image, {1.0, View::plain}), to_srgb8(twice, {}));
  EXPECT_EQ(to_srgb8(image, {}), (std::vector<std::uint8_t>{137, 89, 0}));
}

TEST(Exr, ARoundTripKeepsValuesAttributesAndWindows) {
  Image image;
  image.display = {0, 0, 100, 50};
  image.data = {10, 20, 3, 2};
  image.channels.push_back({"N.X", std::vector<float>{1e-30f, -2.5f, 65505.0f, 0.1f, 3.4e38f, 0.0f}});
  image.channels.push_back({"samples", std::vector<std::uint32_t>{0, 1, 2, 4'000'000'000u, 4, 5}});
  image.attributes = {{"owner", "ada"},
                      {"samplesPerPixel", 7},
                      {"renderTimeSeconds", 1.5f},
                      {"lightmill.relMse", 0.1},
                      {"worldToCamera", ImageMatrix{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}}};
  const Result<std::string> bytes = encode_exr(image);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const Result<Image> back = decode_exr(as_byte_view(*bytes));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->display, image.display);
  EXPECT_EQ(back->data, image.data);
  ASSERT_NE(back->floats("N.X"), nullptr);
  EXPECT_EQ(*back->floats("N.X"), *image.floats("N.X"));
  ASSERT_NE(back->counts("samples"), nullptr);
  EXPECT_EQ(*back->counts("samples"), *image.counts("samples"));
  for (const auto& [name, value] : image.attributes) {
    EXPECT_EQ(back->attributes.at(name), value) << name;
  }
}

TEST(Exr, EqualImagesGiveEqualBytes) {
  EXPECT_EQ(*encode_exr(to_image(example_picture())), *encode_exr(to_image(example_picture())));
}

// Here the primaries red and green are exchanged.
TEST(Exr, ColoursOfOtherPrimariesAreConverted) {
  Image image{{0, 0, 1, 1}, {0, 0, 1, 1}, {}, {}};
  image.channels = {{"B", std::vector<float>{0.25f}}, {"G", std::vector<float>{2}}, {"R", std::vector<float>{1}}};
  std::string bytes = *encode_exr(image);
  const std::string name = std::string("chromaticities\0chromaticities\0", 30);
  const std::size_t at = bytes.find(name) + name.size() + 4;
  ASSERT_LT(at, bytes.size());
  const std::string red = bytes.substr(at, 8);
  bytes.replace(at, 8, bytes.substr(at + 8, 8));
  bytes.replace(at + 8, 8, red);
  const Result<FramedPicture> picture = framed_picture(decode_exr(as_byte_view(bytes)).value());
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_NEAR(picture->rgb.values.at(0), 2, 1e-6);
  EXPECT_NEAR(picture->rgb.values.at(1), 1, 1e-6);
  EXPECT_NEAR(picture->rgb.values.at(2), 0.25, 1e-6);
  bytes.replace(at, 8, bytes.substr(at + 8, 8));  // two equal primaries
  EXPECT_FALSE(framed_picture(decode_exr(as_byte_view(bytes)).value()).ok());
}

TEST(Exr, HostileBytesAreRefused) {
  const std::string good = *encode_exr(to_image(example_picture()));
  EXPECT_EQ(decode_exr({}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(decode_exr(as_byte_view("not a picture at all")).status().code(), StatusCode::kInvalidArgument);
  for (std::size_t size = 0; size < good.size(); size += 7) {  // every cut: an error, or (after the pixels) a picture
    const Result<Image> cut = decode_exr(as_byte_view(good).first(size));
    EXPECT_TRUE(cut.ok() || cut.status().code() == StatusCode::kInvalidArgument) << size;
    EXPECT_TRUE(cut.ok() || message_of(cut.status()).find("memory") == std::string::npos) << cut.status();
  }
  std::uint32_t state = 1;
  for (int trial = 0; trial < 1000; ++trial) {
    std::string bad = good;
    for (int flips = 0; flips < 3; ++flips) {
      state = state * 1664525u + 1013904223u;
      bad[(state >> 8) % bad.size()] ^= static_cast<char>(1u << (state % 8));
    }
    const Result<Image> got = decode_exr(as_byte_view(bad));
    EXPECT_TRUE(got.ok() || got.status().code() == StatusCode::kInvalidArgument) << trial;
    EXPECT_TRUE(got.ok() || message_of(got.status()).find("memory") == std::string::npos) << got.status();
  }
}

// OpenEXR would allocate the 2 GiB that this file states for a text.
TEST(Exr, AnAttributeLargerThanTheFileIsRefusedBeforeAllocation) {
  Image image = to_image(example_picture());
  image.attributes["comment"] = std::string("0123456789");
  std::string bytes = *encode_exr(image);
  EXPECT_TRUE(exr_header_end(as_byte_view(bytes)).ok());
  const std::string type("comment\0string\0", 15);
  const std::size_t size_at = bytes.find(type) + type.size();
  bytes.replace(size_at, 4, std::string("\xff\xff\xff\x7f", 4));
  const Result<Image> refused = decode_exr(as_byte_view(bytes));
  EXPECT_EQ(refused.status().code(), StatusCode::kInvalidArgument);
  EXPECT_NE(message_of(refused.status()).find("the attribute at byte"), std::string::npos) << refused.status();
  bytes.replace(size_at, 4, std::string("\xff\xff\xff\xff", 4));
  EXPECT_FALSE(exr_header_end(as_byte_view(bytes)).ok());
  EXPECT_FALSE(exr_header_end(as_byte_view(bytes).first(size_at + 2)).ok());
}

TEST(Png, ARoundTripGivesLinearValues) {
  const std::vector<std::uint8_t> rgb{0, 128, 255, 1, 2, 3};
  const Result<std::string> bytes = encode_png(2, 1, rgb);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const Result<RgbImage> image = decode_png(as_byte_view(*bytes));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->width, 2);
  EXPECT_EQ(image->height, 1);
  EXPECT_EQ(to_srgb8(*image, {}), rgb);
  EXPECT_NEAR(image->values[2], 0.2158605f, 1e-6);  // green of the first pixel
}

TEST(Png, HostileBytesAreRefused) {
  const std::string good = *encode_png(3, 2, std::vector<std::uint8_t>(18, 200));
  for (std::size_t size = 0; size + 16 < good.size(); ++size) {
    EXPECT_EQ(decode_png(as_byte_view(good).first(size)).status().code(), StatusCode::kInvalidArgument) << size;
  }
}

TEST(FilmPicture, MeansAreSumsOverCounts) {
  FilmPicture picture({0, 0, 2, 1}, {0, 0, 2, 1});
  place_sums(picture, {1, 0, 1, 1}, 2, 1, std::vector<float>{2, 4, 6, 4, 5, 9});
  EXPECT_EQ(picture.half_a, (std::vector<float>{0, 1, 0, 2, 0, 3}));
  EXPECT_EQ(picture.half_b, (std::vector<float>{0, 4, 0, 5, 0, 9}));
  EXPECT_EQ(picture.beauty, (std::vector<float>{0, 2, 0, 3, 0, 5}));
  EXPECT_EQ(picture.samples_a, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(picture.samples_b, (std::vector<std::uint32_t>{0, 1}));
}

TEST(FilmPicture, StandardErrorOfEqualHalvesIsHalfTheirDistance) {
  FilmPicture picture({0, 0, 20, 20}, {0, 0, 20, 20});
  std::vector<float> sums(6 * 400);
  std::fill(sums.begin() + 3 * 400, sums.end(), 8.0f);  // A = 0, B = 8 / 4 = 2
  place_sums(picture, picture.data, 4, 4, sums);
  for (const float error : smoothed_standard_error(picture)) {
    EXPECT_NEAR(error, 1.0f, 1e-6);
  }
}

TEST(FilmPicture, StandardErrorIsAveragedOnlyOverItsNeighbourhood) {
  FilmPicture picture({0, 0, 40, 40}, {0, 0, 40, 40});
  std::vector<float> sums(6 * 1600);
  sums[20 * 40 + 20] = 2.0f;  // one red pixel: variance (2−0)²/4 = 1
  place_sums(picture, picture.data, 1, 1, sums);
  const std::vector<float> error = smoothed_standard_error(picture);
  EXPECT_NEAR(error[20 * 40 + 20], 1.0 / 9, 1e-6);  // sqrt(1 / 81)
  EXPECT_NEAR(error[24 * 40 + 24], 1.0 / 9, 1e-6);
  EXPECT_NEAR(error[25 * 40 + 20], 0.0, 1e-6);
  EXPECT_NEAR(error[1600 + 20 * 40 + 20], 0.0, 1e-6);
}

TEST(FilmPicture, StandardErrorIsZeroWhereOneHalfIsMissing) {
  FilmPicture picture({0, 0, 1, 1}, {0, 0, 1, 1});
  place_sums(picture, {0, 0, 1, 1}, 1, 0, std::vector<float>{5, 5, 5, 0, 0, 0});
  EXPECT_EQ(smoothed_standard_error(picture), (std::vector<float>{0, 0, 0}));
}

TEST(FilmPicture, SurvivesARoundTripThroughItsFile) {
  const FilmPicture picture = example_picture();
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "film_picture_test.exr";
  const Result<std::string> bytes = encode_picture(picture, PictureFormat::exr, {});
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  ASSERT_TRUE(write_file_atomically(path, as_byte_view(*bytes)).ok());
  const Result<FilmPicture> back = load_film_picture(path);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->beauty, picture.beauty);
  EXPECT_EQ(back->half_a, picture.half_a);
  EXPECT_EQ(back->half_b, picture.half_b);
  EXPECT_EQ(back->samples_a, picture.samples_a);
  EXPECT_EQ(back->samples_b, picture.samples_b);
  EXPECT_EQ(back->display, picture.display);
  EXPECT_EQ(back->receipt.seed, picture.receipt.seed);
  EXPECT_EQ(back->receipt.film_hash, "00ff");
  EXPECT_EQ(back->receipt.ended, picture.receipt.ended);
  EXPECT_EQ(back->receipt.method_reasons, picture.receipt.method_reasons);
  EXPECT_EQ(back->receipt.notices, picture.receipt.notices);
  EXPECT_EQ(back->receipt.asset_digests, picture.receipt.asset_digests);
  EXPECT_EQ(back->receipt.rel_mse, 0.1);
  EXPECT_EQ(back->receipt.owner, "ada");
  const Result<RgbImage> rgb = load_rgb(path);
  ASSERT_TRUE(rgb.ok()) << rgb.status();
  EXPECT_EQ(rgb->values, picture.beauty);
  std::filesystem::remove(path);
}

TEST(PictureFile, FormatFollowsTheName) {
  EXPECT_EQ(*picture_format("a/b.exr"), PictureFormat::exr);
  EXPECT_EQ(*picture_format("b.PNG"), PictureFormat::png);
  for (const char* name : {"b.jpg", "b", "exr", ".png.txt"}) {
    const Status status = picture_format(name).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_NE(message_of(status).find(name), std::string::npos);
  }
  EXPECT_EQ(load_rgb("/nowhere/at/all.exr").status().code(), StatusCode::kNotFound);
}

TEST(ErrorMetrics, EqualPicturesHaveNoError) {
  const RgbImage image{2, 1, {1, 2, 3, 4, 5, 0}};
  const Result<PictureError> error = compare_pictures(image, image);
  ASSERT_TRUE(error.ok());
  EXPECT_EQ(error->rel_mse, 0);
  EXPECT_EQ(error->smape, 0);
  EXPECT_EQ(error->energy_ratio, 1);
}

TEST(ErrorMetrics, HitClosedForms) {
  const RgbImage reference{1, 1, {1.0f, 0.0f, 0.5f}};
  const RgbImage picture{1, 1, {1.5f, 0.1f, 0.5f}};
  const Result<PictureError> error = compare_pictures(picture, reference);
  ASSERT_TRUE(error.ok());
  EXPECT_NEAR(error->rel_mse, (0.25 / 1.01 + 0.01 / 0.01 + 0) / 3, 1e-6);
  EXPECT_NEAR(error->smape, (0.5 / 2.5 + 1.0 + 0) / 3, 1e-6);
  EXPECT_NEAR(error->energy_ratio, 2.1 / 1.5, 1e-6);
  EXPECT_NEAR(error->energy_ratio_rgb[0], 1.5, 1e-6);
  EXPECT_EQ(error->energy_ratio_rgb[1], std::numeric_limits<double>::infinity());
  EXPECT_EQ(error->energy_ratio_rgb[2], 1);
  EXPECT_NEAR(error->max_abs, 0.5, 1e-6);
}

TEST(ErrorMetrics, TrimmingDropsTheWorstPixelInAThousand) {
  RgbImage reference{1000, 1, std::vector<float>(3000, 1.0f)};
  RgbImage picture = reference;
  for (float& value : picture.values) {
    value = 1.1f;
  }
  picture.values[500] = picture.values[1500] = picture.values[2500] = 1e4f;
  const Result<PictureError> error = compare_pictures(picture, reference);
  ASSERT_TRUE(error.ok());
  EXPECT_NEAR(error->rel_mse_trimmed, 0.01 / 1.01, 1e-6);
  EXPECT_GT(error->rel_mse, 9e4);
}

TEST(ErrorMetrics, IncomparablePicturesAreRefused) {
  const RgbImage one{1, 1, {1, 1, 1}};
  EXPECT_FALSE(compare_pictures(one, RgbImage{2, 1, std::vector<float>(6)}).ok());
  EXPECT_FALSE(compare_pictures(RgbImage{1, 1, {1, std::nanf(""), 1}}, one).ok());
}

// Values of the reference implementation's known answers.
TEST(Cryptomatte, HashesNamesByMurmurHash3) {
  EXPECT_EQ(murmur_hash3(""), 0u);
  EXPECT_EQ(murmur_hash3("", 1), 0x514e28b7u);
  EXPECT_EQ(murmur_hash3("", 0xffffffffu), 0x81f16f39u);
  EXPECT_EQ(murmur_hash3("aaaa", 0x9747b28cu), 0x5a97808au);
  EXPECT_EQ(murmur_hash3("aaa", 0x9747b28cu), 0x283e0130u);
  EXPECT_EQ(murmur_hash3("aa", 0x9747b28cu), 0x5d211726u);
  EXPECT_EQ(murmur_hash3("a", 0x9747b28cu), 0x7fa09ea6u);
  EXPECT_EQ(murmur_hash3("Hello, world!", 0x9747b28cu), 0x24884cbau);
  EXPECT_EQ(murmur_hash3("The quick brown fox jumps over the lazy dog", 0x9747b28cu), 0x2fa826cdu);
}

TEST(Cryptomatte, IdentifiersAreOrdinaryFloats) {
  EXPECT_EQ(std::bit_cast<std::uint32_t>(cryptomatte_id("hello")), 0x248bfa47u);  // the unchanged hash
  for (int i = 0; i < 2000; ++i) {
    EXPECT_TRUE(std::isnormal(cryptomatte_id(std::to_string(i)))) << i;
  }
}

TEST(Cryptomatte, RanksDescendInCoverageAndDropTheSmallest) {
  const std::vector<float> ids{5, 0, 7, 5, 9, 9, 5, 11, 12, 13, 14, 7, 0, 0, 0, 0};
  const auto ranks = cryptomatte_ranks(ids);
  const std::array<float, 12> expected{5,  3 / 16.0f, 7,  2 / 16.0f, 9,  2 / 16.0f,
                                       11, 1 / 16.0f, 12, 1 / 16.0f, 13, 1 / 16.0f};
  EXPECT_EQ(ranks, expected);
  EXPECT_EQ(cryptomatte_ranks(std::vector<float>(16, 0.0f)), (std::array<float, 12>{}));
}

TEST(Cryptomatte, TheHeaderDescribesTheLayer) {
  std::map<std::string, ImageAttribute> attributes;
  add_cryptomatte_attributes(attributes, "CryptoObject", {"a \"b\"\\", "hello"});
  ASSERT_EQ(attributes.size(), 4u);
  for (const auto& [name, value] : attributes) {
    EXPECT_EQ(name.substr(0, 20), "cryptomatte/3ae39a5/");  // the first seven digits of the layer's hash
  }
  EXPECT_EQ(std::get<std::string>(attributes.at("cryptomatte/3ae39a5/name")), "CryptoObject");
  EXPECT_EQ(std::get<std::string>(attributes.at("cryptomatte/3ae39a5/hash")), "MurmurHash3_32");
  EXPECT_EQ(std::get<std::string>(attributes.at("cryptomatte/3ae39a5/conversion")), "uint32_to_float32");
  const std::string manifest = std::get<std::string>(attributes.at("cryptomatte/3ae39a5/manifest"));
  EXPECT_TRUE(manifest.starts_with("{\"a \\\"b\\\"\\\\\":\"")) << manifest;
  EXPECT_TRUE(manifest.ends_with(",\"hello\":\"248bfa47\"}")) << manifest;
  EXPECT_EQ(cryptomatte_channels("CryptoObject")[6], "CryptoObject01.B");
}

// Objects of one name count as one, with any ids. Ids without an object cover nothing.
TEST(PictureLayers, IdsOfOneNameShareARank) {
  std::vector<PictureLayer> layers{make_picture_layer("id", 1)};
  PictureIds ids({"leaf", "trunk", "leaf", "hidden"}, {"green", "brown", "brown", "green"});
  std::vector<float> values{3, 1, 2, 0, 5, 3, -1, std::numeric_limits<float>::quiet_NaN()};
  ASSERT_TRUE(place_first_samples(layers, {0, 0, 1, 1}, {0, 0, 1, 1}, 8, values, ids));
  const std::vector<float>& v = layers[0].values;
  EXPECT_EQ((std::vector<float>(v.begin(), v.begin() + 6)),
            (std::vector<float>{cryptomatte_id("leaf"), 3 / 8.0f, cryptomatte_id("trunk"), 1 / 8.0f, 0, 0}));
  EXPECT_EQ((std::vector<float>(v.begin() + 12, v.begin() + 18)),
            (std::vector<float>{cryptomatte_id("brown"), 3 / 8.0f, cryptomatte_id("green"), 1 / 8.0f, 0, 0}));
  EXPECT_EQ(ids.seen(PictureIds::kObject), (std::set<std::string>{"leaf", "trunk"}));
  EXPECT_EQ(ids.seen(PictureIds::kMaterial), (std::set<std::string>{"brown", "green"}));
  values.resize(17, 1.0f);
  EXPECT_FALSE(place_first_samples(layers, {0, 0, 1, 1}, {0, 0, 1, 1}, 17, values, ids));
}

TEST(PictureLayers, ComeFromSamples0To15) {
  std::vector<PictureLayer> layers{make_picture_layer("direct", 2), make_picture_layer("normal", 2),
                                   make_picture_layer("features", 2), make_picture_layer("depth", 2),
                                   make_picture_layer("id", 2)};
  PictureIds ids({"cup", "table"}, {"glass", "wood"});
  // The second of two pixels. Two samples saw the table, the others nothing.
  std::vector<float> values{0, 1, -2};
  for (int i = 0; i < 20; ++i) {
    values.push_back(static_cast<float>(i));
  }
  values.insert(values.end(), {3.5f, 2, 0});
  ASSERT_TRUE(place_first_samples(layers, {0, 0, 2, 1}, {1, 0, 1, 1}, 2, values, ids));
  EXPECT_EQ(layers[1].values, (std::vector<float>{0, 0, 0, 0.5f, 0, -1}));
  EXPECT_EQ(layers[2].channels[16], "Features.B.InverseZ");
  EXPECT_EQ(layers[2].values[2 * 16], 0);
  EXPECT_EQ(layers[2].values[2 * 16 + 1], 8);
  EXPECT_EQ(layers[3].values, (std::vector<float>{kNoDepth, 3.5f}));
  EXPECT_EQ(layers[4].channels.size(), 24u);
  EXPECT_EQ(layers[4].values[1], cryptomatte_id("table"));
  EXPECT_EQ(layers[4].values[3], 0.5f);
  EXPECT_EQ(layers[4].values[2 * 12 + 1], cryptomatte_id("wood"));
  EXPECT_EQ(ids.seen(PictureIds::kObject), std::set<std::string>{"table"});
  EXPECT_EQ(ids.seen(PictureIds::kMaterial), std::set<std::string>{"wood"});
  EXPECT_FALSE(place_first_samples(layers, {0, 0, 2, 1}, {1, 0, 1, 1}, 3, values, ids));
}

}  // namespace
}  // namespace lightmill
