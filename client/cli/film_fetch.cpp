#include "client/cli/film_fetch.h"

#include <unistd.h>

#include <ctime>

#include "client/cli/console.h"
#include "common/base/file.h"
#include "common/film/film_hash.h"
#include "common/image/picture_file.h"
#include "common/wire/bytes.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 30;

std::string capture_date(std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / 1000;
  std::tm parts{};
  localtime_r(&seconds, &parts);
  return fmt::format("{:04}:{:02}:{:02} {:02}:{:02}:{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday,
                     parts.tm_hour, parts.tm_min, parts.tm_sec);
}

ImageWindow to_window(const v1::PixelRect& rect) {
  return {rect.x(), rect.y(), rect.width(), rect.height()};
}

bool lies_within(const ImageWindow& inner, const ImageWindow& outer) {
  return inner.width > 0 && inner.height > 0 && inner.x >= outer.x && inner.y >= outer.y &&
         std::int64_t{inner.x} + inner.width <= std::int64_t{outer.x} + outer.width &&
         std::int64_t{inner.y} + inner.height <= std::int64_t{outer.y} + outer.height;
}

Receipt receipt_of(const v1::FilmHeader& header) {
  const v1::Job& job = header.job();
  const v1::RenderSettings& settings = header.settings();
  Receipt receipt;
  receipt.render_digest =
      job.render_digest().empty() ? "" : digest_from_bytes(job.render_digest()).value_or(Sha256{}).hex();
  receipt.scene_digest = sha256(settings.scene()).hex();
  for (const std::string& asset : settings.assets()) {
    receipt.asset_digests.push_back(digest_from_bytes(asset).value_or(Sha256{}).hex());
  }
  receipt.renderer_version = settings.renderer_version();
  receipt.fingerprint_class = job.fingerprint_class();
  receipt.method = settings.method();
  receipt.max_bounces = settings.max_bounces();
  receipt.seed = settings.seed();
  receipt.job = job.id();
  receipt.name = job.name();
  receipt.owner = job.owner();
  receipt.host = job.host();
  if (job.has_error()) {
    receipt.rel_mse = job.error().rel_mse();
    receipt.rel_mse_half_width = job.error().half_width();
  }
  receipt.seconds = job.active_seconds();
  receipt.worker_seconds = job.worker_seconds();
  const std::int64_t when =
      job.finished_unix_ms() != 0 ? job.finished_unix_ms() : std::int64_t{std::time(nullptr)} * 1000;
  receipt.capture_date = capture_date(when);
  return receipt;
}

Result<FetchedFilm> begin_film(const v1::FilmHeader& header) {
  const ImageWindow frame{0, 0, header.settings().width(), header.settings().height()};
  const ImageWindow crop = to_window(header.settings().crop());
  if (!lies_within(crop, frame) || crop.pixel_count() > kMaxPixels) {
    return data_loss("the farm sent a film of {}x{} pixels with crop {},{},{},{}", frame.width, frame.height, crop.x,
                     crop.y, crop.width, crop.height);
  }
  FetchedFilm film{header.job(), FilmPicture(frame, crop)};
  film.picture.receipt = receipt_of(header);
  return film;
}

Status add_tile(FilmPicture& picture, const v1::FilmTile& tile) {
  const ImageWindow rect = to_window(tile.rect());
  LM_ASSIGN_OR_RETURN(const std::vector<float> sums, floats_from_bytes(tile.sums()));
  if (!lies_within(rect, picture.data) || sums.size() != 6 * static_cast<std::size_t>(rect.pixel_count())) {
    return data_loss("the farm sent a tile at {},{} of {}x{} pixels with {} sums, outside the film", rect.x, rect.y,
                     rect.width, rect.height, sums.size());
  }
  if (tile.samples_a() > tile.samples()) {
    return data_loss("the farm sent a tile with {} of {} samples in half A", tile.samples_a(), tile.samples());
  }
  place_sums(picture, rect, tile.samples_a(), tile.samples() - tile.samples_a(), sums);
  return ok_status();
}

}  // namespace

Hash128 film_hash_of(const FilmPicture& picture) {
  FilmPlanes planes(PixelRect{picture.data.x, picture.data.y, picture.data.width, picture.data.height}, 3);
  planes.mean_a = picture.half_a;
  planes.mean_b = picture.half_b;
  std::ranges::transform(picture.samples_a, picture.samples_b, planes.counts.begin(), std::plus<>());
  return film_hash(planes);
}

Result<FetchedFilm> fetch_film(FarmConnection& connection, std::uint64_t id) {
  std::optional<FetchedFilm> film;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max(), most = 0;
  LM_RETURN_IF_ERROR(connection.get_film(id, [&](const v1::GetFilmResponse& part) -> Status {
    if (part.has_header()) {
      LM_ASSIGN_OR_RETURN(FetchedFilm begun, begin_film(part.header()));
      film.emplace(std::move(begun));
      return ok_status();
    }
    if (!film) {
      return data_loss("the farm sent a tile before the film's header");
    }
    least = std::min(least, part.tile().samples());
    most = std::max(most, part.tile().samples());
    return add_tile(film->picture, part.tile());
  }));
  if (!film || least > most) {
    return data_loss("the farm sent no film for job {}", id);
  }
  film->picture.receipt.min_samples = least;
  film->picture.receipt.max_samples = most;
  film->picture.receipt.film_hash = film_hash_of(film->picture).hex();
  return std::move(*film);
}

Status check_outputs(const std::vector<std::string>& paths) {
  for (const std::string& text : paths) {
    const fs::path path(text);
    LM_RETURN_IF_ERROR(picture_format(path).status());
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
      return invalid_argument("cannot write {}: there is no folder {}", text, folder.string());
    }
    if (fs::is_directory(path, error)) {
      return invalid_argument("cannot write {}: it is a folder", text);
    }
    if (const Status status = check_can_write(path); !status.ok()) {
      return invalid_argument("cannot write {}: {}", text, message_of(status));
    }
  }
  return ok_status();
}

Status write_outputs(const FilmPicture& picture, const std::vector<std::string>& paths, const ViewSettings& view) {
  for (const std::string& path : paths) {
    LM_ASSIGN_OR_RETURN(const PictureFormat format, picture_format(path));
    LM_ASSIGN_OR_RETURN(const std::string bytes, encode_picture(picture, format, view));
    LM_RETURN_IF_ERROR(as_output_error(write_file_atomically(path, as_byte_view(bytes))));
  }
  return ok_status();
}

}  // namespace lightmill::cli
