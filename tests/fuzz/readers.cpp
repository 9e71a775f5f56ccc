#include "tests/fuzz/readers.h"

#include <array>

#include "common/base/address.h"
#include "common/base/check.h"
#include "common/base/text.h"
#include "common/image/exr.h"
#include "common/image/film_picture.h"
#include "common/image/png.h"
#include "common/lights/ies_profile.h"
#include "common/security/certificate.h"
#include "common/security/openssl_handles.h"
#include "common/security/roles.h"
#include "common/security/token.h"
#include "tests/support/read_image.h"

namespace lightmill::fuzz {
namespace {

constexpr std::int64_t kPixels = std::int64_t{1} << 20;  ///< larger images only cost time

/// The rest of the bytes, and which of `count` the first byte chooses.
std::pair<std::string_view, std::size_t> chosen(std::string_view bytes, std::size_t count) {
  return bytes.empty() ? std::pair{bytes, std::size_t{0}}
                       : std::pair{bytes.substr(1), static_cast<unsigned char>(bytes[0]) % count};
}

bool refused(const Status& status) {
  LM_CHECK(!status.ok() && !message_of(status).empty(), "refused without a reason");
  return false;
}

bool try_exr(std::string_view bytes) {
  const Result<Image> image = decode_exr(as_byte_view(bytes));
  if (!image.ok()) {
    return refused(image.status());
  }
  const auto pixels = static_cast<std::size_t>(image->data.pixel_count());
  for (const ImageChannel& channel : image->channels) {
    LM_CHECK(std::visit([](const auto& values) { return values.size(); }, channel.values) == pixels);
  }
  LM_CHECK(file_checksum(*image).size() == 64);
  const Result<FilmPicture> picture = from_image(*image);
  if (!picture.ok()) {
    return refused(picture.status());
  }
  LM_CHECK(picture->pixels() == pixels && picture->beauty.size() == 3 * pixels);
  LM_CHECK(smoothed_standard_error(*picture).size() == 3 * pixels);
  const Result<FilmPicture> again = from_image(to_image(*picture));
  LM_CHECK(again.ok(), "a picture that was read cannot be written and read again: {}", message_of(again.status()));
  LM_CHECK(again->samples_a == picture->samples_a && again->samples_b == picture->samples_b);
  return true;
}

bool try_png(std::string_view bytes) {
  const Result<RgbImage> image = decode_png(as_byte_view(bytes));
  if (!image.ok()) {
    return refused(image.status());
  }
  LM_CHECK(image->values.size() == 3 * image->pixels());
  return true;
}

bool try_pem(std::string_view bytes) {
  const Result<std::vector<CertificateFacts>> facts = read_certificates(bytes);
  const auto certificates = openssl::certificates_in(bytes);
  LM_CHECK(certificates.ok() || !facts.ok());  // a certificate may have an invalid date
  const auto key = openssl::key_in(bytes);
  if (!key.ok()) {
    refused(key.status());
  }
  if (!facts.ok()) {
    return refused(facts.status());
  }
  for (const CertificateFacts& each : *facts) {
    LM_CHECK(!date_text(each.from_unix_s).empty() && !date_text(each.until_unix_s).empty());
  }
  return true;
}

bool try_token(std::string_view bytes) {
  const Result<std::string> id = token_id(bytes);
  if (!id.ok()) {
    LM_CHECK(bytes.empty() || bytes.size() < 20 || message_of(id.status()).find(bytes) == std::string::npos,
             "a refusal repeats the secret");
    return refused(id.status());
  }
  LM_CHECK(is_token_id(*id));
  return true;
}

bool try_text(std::string_view bytes) {
  const std::string shown = printable(bytes);
  LM_CHECK(printable(shown) == shown, "printable() changes its own result");
  LM_CHECK(check_name("a name", as_name(bytes)).ok(), "as_name() gives an invalid name");
  const Result<Roles> roles = parse_roles(bytes);
  const Result<HostPort> address = parse_host_port(bytes);
  if (!roles.ok()) {
    refused(roles.status());
  }
  return address.ok() || refused(address.status()) || roles.ok();
}

}  // namespace

bool try_image(std::string_view bytes) {
  constexpr std::array<std::string_view, 6> kNames{"a.png", "a.jpg", "a.hdr", "a.exr", "a.tif", "a.tga"};
  const auto [file, choice] = chosen(bytes, kNames.size());
  const std::string name(kNames[choice]);
  const Result<ImageSize> size = read_size(as_byte_view(file), name);
  if (!size.ok() || size->pixels() > static_cast<std::uint64_t>(kPixels)) {
    const Result<Texels> texels = size.ok() ? read_image_within(as_byte_view(file), name, kPixels) : size.status();
    LM_CHECK(!texels.ok() && message_of(texels.status()).starts_with(name + ":"), "the refusal does not name the file");
    return false;
  }
  const Result<Texels> texels = read_image_within(as_byte_view(file), name, kPixels);
  if (!texels.ok()) {
    LM_CHECK(message_of(texels.status()).starts_with(name + ":"), "{}", message_of(texels.status()));
    return false;
  }
  const auto pixels = static_cast<std::size_t>(texels->width) * static_cast<std::size_t>(texels->height);
  LM_CHECK(pixels == size->pixels(), "the image has {} pixels instead of {}", pixels, size->pixels());
  LM_CHECK(size_bytes(*texels) == pixels * size->bytes_per_pixel);
  return true;
}

bool try_picture(std::string_view bytes) {
  const auto [file, choice] = chosen(bytes, 2);
  return choice == 0 ? try_exr(file) : try_png(file);
}

bool try_credential(std::string_view bytes) {
  const auto [text, choice] = chosen(bytes, 3);
  return choice == 0 ? try_pem(text) : choice == 1 ? try_token(text) : try_text(text);
}

bool try_profile(std::string_view bytes) {
  const Result<IesProfile> profile = read_ies(bytes, "fuzz.ies");
  if (!profile.ok()) {
    LM_CHECK(message_of(profile.status()).starts_with("fuzz.ies"), "{}", message_of(profile.status()));
    return false;
  }
  return true;
}

}  // namespace lightmill::fuzz
