// Fuzz tests of files from users and programs: a damaged file is accepted, or refused with a reason.
#include <gtest/gtest.h>

#include <functional>

#include "common/image/exr.h"
#include "common/image/film_picture.h"
#include "common/image/png.h"
#include "common/security/authority.h"
#include "common/security/token.h"
#include "tests/fuzz/fuzz_loop.h"
#include "tests/fuzz/readers.h"

namespace lightmill {
namespace {

constexpr std::array<std::string_view, 8> kWords{"\xff\xff\xff\xff",
                                                 std::string_view("\0\0\0\0", 4),
                                                 std::string_view("\x7f\xff\xff\xff", 4),
                                                 std::string_view("\xff\xff\xff\x7f", 4),
                                                 "\n",
                                                 "99999999999",
                                                 std::string_view("\0\0\xc0\x7f", 4),
                                                 "\xff\xd8"};

/// The byte that chooses the reader, and its input.
std::string choose(char reader, std::string_view bytes) {
  return fmt::format("{}{}", reader, bytes);
}

/// All `originals` must be accepted. Some of the damaged ones must be accepted, and some refused.
void expect_survival(const std::vector<std::string>& originals, const std::function<bool(std::string_view)>& reader,
                     std::uint64_t seed, int usual_rounds) {
  for (std::size_t i = 0; i < originals.size(); ++i) {
    EXPECT_TRUE(reader(originals[i])) << "original " << i;
  }
  const auto damaged = [&](const std::string& original, FuzzRandom& random) {
    // The first byte chooses the reader, and stays.
    return reader(choose(original[0], mutate(std::string_view(original).substr(1), kWords, random)));
  };
  expect_both_outcomes(originals, seed, fuzz_cases(usual_rounds), damaged, 0.005);
}

std::string png() {
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < 16 * 16 * 3; ++i) {
    rgb.push_back(static_cast<std::uint8_t>(i * 7));
  }
  return encode_png(16, 16, rgb).value();
}

std::string film_exr() {
  FilmPicture picture({0, 0, 20, 12}, {2, 1, 16, 8});
  for (std::size_t i = 0; i < picture.beauty.size(); ++i) {
    picture.beauty[i] = picture.half_a[i] = picture.half_b[i] = static_cast<float>(i) / 7;
  }
  std::fill(picture.samples_a.begin(), picture.samples_a.end(), 4u);
  std::fill(picture.samples_b.begin(), picture.samples_b.end(), 4u);
  picture.receipt.render_digest = std::string(64, 'a');
  picture.receipt.method = "path";
  picture.receipt.seed = 7;
  return encode_exr(to_image(picture)).value();
}

/// Radiance's RGBE, 8×2 pixels, with runs and without (tests/unit/core/image_formats_test.cpp).
std::string hdr() {
  std::string text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n";
  for (int row = 0; row < 2; ++row) {
    text += std::string("\x02\x02\x00\x08", 4);
    for (int channel = 0; channel < 4; ++channel) {
      text += std::string("\x84\x80\x04\x40\x41\x42\x43", 7);
    }
  }
  return text;
}

TEST(ReaderFuzz, DamagedImagesAreReadOrRefused) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "libpng leaves a truncated file by a jump that leaks a string of OpenImageIO's";
#endif
  expect_survival({choose('\0', png()), choose('\2', hdr()), choose('\3', film_exr())}, fuzz::try_image, 10, 500);
}

TEST(ReaderFuzz, DamagedPicturesOfFilmsAreReadOrRefused) {
  expect_survival({choose('\0', film_exr()), choose('\1', png())}, fuzz::try_picture, 11, 1000);
}

TEST(ReaderFuzz, DamagedCertificatesTokensAndNamesAreReadOrRefused) {
  const auto authority = make_authority("an authority", {1'700'000'000, 2'000'000'000});
  ASSERT_TRUE(authority.ok()) << authority.status();
  const Result<NewToken> token = make_token();
  ASSERT_TRUE(token.ok()) << token.status();
  expect_survival({choose('\0', authority->certificate + authority->key), choose('\1', token->text), "\2view,submit",
                   "\2[::1]:7350", "\2worker.example:1"},
                  fuzz::try_credential, 12, 4000);
}

TEST(ReaderFuzz, DamagedLightProfilesAreReadOrRefused) {
  expect_survival(
      {"IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 1000 1 3 2 1 2 0.1 0.2 0\n1 1 100\n0 45 90\n0 90\n8 4 2\n7 3 1\n"},
      [](std::string_view text) { return fuzz::try_profile(text); }, 13, 4000);
}

}  // namespace
}  // namespace lightmill
