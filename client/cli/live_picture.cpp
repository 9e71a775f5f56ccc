#include "client/cli/live_picture.h"

#include <algorithm>

#include "client/cli/console.h"
#include "common/base/file.h"
#include "common/image/png.h"
#include "common/wire/bytes.h"

namespace lightmill::cli {
namespace {

constexpr Duration kWriteEvery = std::chrono::seconds(1);

}  // namespace

Status LivePicture::update(const v1::WatchJobResponse& response) {
  if (paths_.empty() || response.tiles().empty()) {
    return ok_status();
  }
  if (image_.values.empty()) {
    const v1::PixelRect& crop = response.job().crop();
    window_ = {crop.x(), crop.y(), crop.width(), crop.height()};
    if (window_.width <= 0 || window_.height <= 0) {
      return data_loss("the farm sent tiles of a job without a size");
    }
    image_ = {window_.width, window_.height, std::vector<float>(3 * static_cast<std::size_t>(window_.pixel_count()))};
  }
  for (const v1::PreviewTile& tile : response.tiles()) {
    LM_RETURN_IF_ERROR(place(tile));
  }
  const Time now = clock_.now();
  if (written_ && now - *written_ < kWriteEvery) {
    return ok_status();
  }
  written_ = now;
  LM_ASSIGN_OR_RETURN(const std::string bytes, encode_png(image_.width, image_.height, to_srgb8(image_, view_)));
  for (const std::string& path : paths_) {
    LM_RETURN_IF_ERROR(as_output_error(write_file_atomically(path, as_byte_view(bytes))));
  }
  return ok_status();
}

Status LivePicture::place(const v1::PreviewTile& tile) {
  const v1::PixelRect& rect = tile.rect();
  LM_ASSIGN_OR_RETURN(const std::vector<float> rgb, floats_from_bytes(tile.rgb()));
  const std::int64_t left = std::int64_t{rect.x()} - window_.x;
  const std::int64_t top = std::int64_t{rect.y()} - window_.y;
  const std::int64_t pixels = std::int64_t{rect.width()} * rect.height();
  if (rect.width() <= 0 || rect.height() <= 0 || left < 0 || top < 0 || left + rect.width() > window_.width ||
      top + rect.height() > window_.height || rgb.size() != static_cast<std::size_t>(3 * pixels)) {
    return data_loss("the farm sent a tile at {},{} of {}x{} pixels, outside the picture", rect.x(), rect.y(),
                     rect.width(), rect.height());
  }
  for (std::int64_t channel = 0; channel < 3; ++channel) {
    for (std::int64_t row = 0; row < rect.height(); ++row) {
      const auto from = rgb.begin() + channel * pixels + row * rect.width();
      const std::int64_t to = channel * window_.pixel_count() + (top + row) * window_.width + left;
      std::copy_n(from, rect.width(), image_.values.begin() + to);
    }
  }
  return ok_status();
}

}  // namespace lightmill::cli
