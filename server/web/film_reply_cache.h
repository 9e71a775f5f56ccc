// Cached answers that are computed from a film: thumbnails and readings of meters. They are computed once per state of
// the film, and at most once per second while the job runs.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <vector>

#include "server/runtime/access_control.h"
#include "server/web/farm_requests.h"

namespace lightmill {

class Film;
class FilmOutline;

/// Answers of one kind. Used on the web thread.
class FilmReplyCache {
 public:
  struct Kind {
    std::vector<TileSnapshot> (*take)(const Film& film);  ///< on the farm thread: the tiles that the answer needs
    Status (*check)(JobId job, const FilmOutline& film);  ///< whether such an answer exists
    Result<ApiReply> (*make)(const PixelRect& crop, const std::vector<TileSnapshot>& tiles);
  };
  FilmReplyCache(FarmRequests& farm_requests, const AccessControl& access, const Kind& kind)
      : farm_requests_(farm_requests), access_(access), kind_(kind) {}

  /// The call is admitted. This checks whether it may read the job.
  void send(const Call& call, JobId job, Reply reply);

 private:
  struct Made {
    std::uint64_t film_version = 0;
    std::chrono::steady_clock::time_point at;
    ApiReply answer;
  };
  using AllMade = std::map<JobId, Made>;
  static ApiReply remember(AllMade& all, JobId job, std::uint64_t version, Result<ApiReply> answer);

  FarmRequests& farm_requests_;
  const AccessControl& access_;
  const Kind kind_;
  const std::shared_ptr<AllMade> made_ = std::make_shared<AllMade>();
};

/// A PNG. NOT_FOUND for films without samples, or with too many tiles.
extern const FilmReplyCache::Kind kThumbnailAnswer;
/// lightmill.v1.MeterReadings: one per meter that the job's method reads, in the scene's order.
extern const FilmReplyCache::Kind kMetersAnswer;

}  // namespace lightmill
