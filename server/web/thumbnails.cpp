#include "server/web/thumbnails.h"

#include "common/film/film.h"
#include "server/api/records.h"
#include "server/web/thumbnail.h"

namespace lightmill {
namespace {

constexpr std::size_t kMostThumbnails = 1'000;

Status check_thumbnail(JobId job, const Film& film) {
  if (film.pixel_samples() > 0 && film.grid().picture_tiles() <= kMostThumbnailTiles) {
    return ok_status();
  }
  return not_found("job {} has no thumbnail: {}", job.value,
                   film.pixel_samples() == 0 ? "it has no samples yet" : "its film is too large");
}

}  // namespace

/// Takes the tiles on the farm thread, and adds them up on the web's unless that was done for just this film.
void Thumbnails::send(const Call& call, JobId job, Reply reply) {
  const auto kept = made_->find(job);
  const std::uint64_t known = kept == made_->end() ? 0 : kept->second.film_version;
  desk_.ask(std::move(reply),
            [job, known, call, &gate = gate_, made = made_](FarmLoop::Turn& turn, const FarmReply& back) {
              Status status = check_job_call(turn, gate, call, job);
              const Film* const film = turn.farm.film(job);
              if (status.ok()) {
                status = check_thumbnail(job, *film);
              }
              if (!status.ok()) {
                return back(error_reply(status));
              }
              std::vector<TileSnapshot> tiles;
              for (std::uint32_t tile = 0; film->version() != known && tile < film->grid().picture_tiles(); ++tile) {
                tiles.push_back(snapshot(*film, TileId{tile}));
              }
              back.compute([job, made, tiles = std::move(tiles), crop = film->grid().crop(),
                            version = film->version()] { return answer(*made, job, crop, tiles, version); });
            });
}

/// Without tiles, what was made before is still true.
ApiReply Thumbnails::answer(Made& made, JobId job, const PixelRect& crop, const std::vector<TileSnapshot>& tiles,
                            std::uint64_t version) {
  if (!tiles.empty()) {
    Result<std::string> png = thumbnail_png(crop, tiles);
    if (!png.ok()) {
      return error_reply(png.status());
    }
    if (made.size() >= kMostThumbnails && !made.contains(job)) {
      made.erase(made.begin());
    }
    made[job] = {version, std::move(*png)};
  }
  const auto at = made.find(job);
  return at != made.end() ? ApiReply{200, "image/png", at->second.png}
                          : error_reply(unavailable("the thumbnail is gone: try again"));
}

}  // namespace lightmill
