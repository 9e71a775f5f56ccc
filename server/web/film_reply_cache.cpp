#include "server/web/film_reply_cache.h"

#include "common/film/film.h"
#include "common/image/color.h"
#include "common/image/png.h"
#include "common/scene/meter_reading.h"
#include "lightmill/v1/web.pb.h"
#include "server/runtime/action_records.h"
#include "server/web/list_changes.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxAnswers = 1'000;
constexpr auto kFresh = std::chrono::seconds(1);
constexpr int kThumbnailSide = 128;
/// Films with more tiles have no thumbnail, because adding up their pixels would take too long.
constexpr std::uint32_t kMaxThumbnailTiles = 8192;

std::vector<TileSnapshot> tiles_between(const Film& film, std::uint32_t begin, std::uint32_t end) {
  std::vector<TileSnapshot> tiles;
  for (std::uint32_t tile = begin; tile < end; ++tile) {
    tiles.push_back(snapshot(film, TileId{tile}));
  }
  return tiles;
}

std::vector<TileSnapshot> picture_of(const Film& film) {
  return tiles_between(film, 0, film.grid().picture_tiles());
}

std::vector<TileSnapshot> meters_of(const Film& film) {
  return tiles_between(film, film.grid().picture_tiles(), film.grid().tile_count());
}

Status check_thumbnail(JobId job, const FilmOutline& film) {
  if (film.pixel_samples() > 0 && film.grid().picture_tiles() <= kMaxThumbnailTiles) {
    return ok_status();
  }
  return not_found("job {} has no thumbnail: {}", job.value,
                   film.pixel_samples() == 0 ? "it has no samples yet" : "its film is too large");
}

/// Scales a coordinate from `from` pixels to `to` pixels.
std::size_t scaled(int at, int from, int to) {
  return static_cast<std::size_t>(std::int64_t{at} * to / from);
}

/// An 8-bit sRGB PNG whose longer side has at most kThumbnailSide pixels. Each is the mean of the crop's pixels that it
/// covers; black without samples.
Result<std::string> thumbnail_png(const PixelRect& crop, const std::vector<TileSnapshot>& tiles) {
  const int longer = std::max(crop.width, crop.height);
  const int most = std::min(kThumbnailSide, longer);
  RgbImage image;
  image.width = std::max(1, crop.width * most / longer);
  image.height = std::max(1, crop.height * most / longer);
  image.values.assign(3 * image.pixels(), 0.0f);
  std::vector<float> counts(image.pixels(), 0.0f);
  for (const TileSnapshot& tile : tiles) {
    const std::vector<float> rgb = mean_rgb(tile);
    const auto pixels = static_cast<std::size_t>(tile.rect.pixel_count());
    for (std::size_t i = 0; i < pixels; ++i) {
      const int x = tile.rect.x - crop.x + static_cast<int>(i) % tile.rect.width;
      const int y = tile.rect.y - crop.y + static_cast<int>(i) / tile.rect.width;
      const std::size_t at = scaled(y, crop.height, image.height) * static_cast<std::size_t>(image.width) +
                             scaled(x, crop.width, image.width);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        image.values[channel * image.pixels() + at] += rgb[channel * pixels + i];
      }
      counts[at] += 1;
    }
  }
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    image.values[i] /= std::max(counts[i % image.pixels()], 1.0f);
  }
  return encode_png(image.width, image.height, to_srgb8(image, {}));
}

Result<ApiReply> make_thumbnail(const PixelRect& crop, const std::vector<TileSnapshot>& tiles) {
  LM_ASSIGN_OR_RETURN(std::string png, thumbnail_png(crop, tiles));
  return ApiReply{200, "image/png", std::move(png)};
}

/// Assumes an area of 1 for flux, because the coordinator does not know the scene.
Result<ApiReply> make_readings(const PixelRect&, const std::vector<TileSnapshot>& meters) {
  const Meter meter{"", IrradianceMeter{}};
  v1::MeterReadings wire;
  for (const TileSnapshot& tile : meters) {
    v1::MeterReading* const out = wire.add_readings();
    if (tile.samples > 0) {
      const MeterReading reading = read_meter(meter, sums_of(tile), tile.layout.summed, tile.samples);
      out->set_samples(reading.samples);
      out->set_value(reading.value);
      out->set_half_width(reading.half_width);
      out->set_photometric(reading.photometric);
      out->set_photometric_half_width(reading.photometric_width);
    }
  }
  return json_reply(wire);
}

}  // namespace

const FilmReplyCache::Kind kThumbnailAnswer{picture_of, check_thumbnail, make_thumbnail};
const FilmReplyCache::Kind kMetersAnswer{meters_of, [](JobId, const FilmOutline&) { return ok_status(); },
                                         make_readings};

/// Takes the tiles on the farm thread. The web thread adds them up, unless the cached answer is of this state of the
/// film.
void FilmReplyCache::send(const Call& call, JobId job, Reply reply) {
  const auto kept = made_->find(job);
  const std::uint64_t known = kept == made_->end() ? 0 : kept->second.film_version;
  const bool fresh = kept != made_->end() && std::chrono::steady_clock::now() - kept->second.at < kFresh;
  farm_requests_.post(std::move(reply), [job, known, fresh, call, kind = kind_, &access = access_, made = made_](
                                            FarmLoop::TaskContext& context, const PendingReply& back) {
    Status status = check_job_call(context, access, call, job);
    const FilmOutline* const film = context.farm.outline(job);
    if (status.ok()) {
      status = kind.check(job, *film);
    }
    if (!status.ok()) {
      return back(error_reply(status));
    }
    const std::uint64_t version = film->version();
    const bool recent =
        fresh && !has_ended(context.farm.status(job, context.now)->state);  // a cached answer would remain the last one
    if (recent || (version == known && known != 0)) {
      return back.compute([job, made] {
        const auto at = made->find(job);
        return at != made->end() ? at->second.answer
                                 : error_reply(unavailable("this state of the film is gone: try again"));
      });
    }
    context.with_film(job, [job, kind, made, back](FarmLoop::TaskContext& later, const Status& here) {
      if (!here.ok()) {
        return back(error_reply(here));
      }
      const Film& film = *later.farm.film(job);
      back.compute([job, version = film.version(), kind, made, crop = film.grid().crop(), tiles = kind.take(film)] {
        return remember(*made, job, version, kind.make(crop, tiles));
      });
    });
  });
}

ApiReply FilmReplyCache::remember(AllMade& all, JobId job, std::uint64_t version, Result<ApiReply> answer) {
  if (!answer.ok()) {
    return error_reply(answer.status());
  }
  if (all.size() >= kMaxAnswers && !all.contains(job)) {
    all.erase(all.begin());
  }
  all[job] = {version, std::chrono::steady_clock::now(), *answer};
  return *std::move(answer);
}

}  // namespace lightmill
