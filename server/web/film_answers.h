// What is asked of a job's film by many, and made once for each state of the film, at most once a second while its job
// is at work: thumbnails, meters' readings.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <vector>

#include "server/runtime/gate.h"
#include "server/web/farm_reply.h"

namespace lightmill {

class Film;
class FilmOutline;

/// Answers of one kind. Belongs to the web's thread.
class FilmAnswers {
 public:
  struct Kind {
    std::vector<TileSnapshot> (*take)(const Film& film);  ///< on the farm thread: the tiles that it is made of
    Status (*check)(JobId job, const FilmOutline& film);  ///< whether there is such an answer
    Result<ApiReply> (*make)(const PixelRect& crop, const std::vector<TileSnapshot>& tiles);
  };
  FilmAnswers(FarmDesk& desk, const Gate& gate, const Kind& kind) : desk_(desk), gate_(gate), kind_(kind) {}

  /// The call was admitted; whether it may see this job is asked here.
  void send(const Call& call, JobId job, Reply reply);

 private:
  struct Made {
    std::uint64_t film_version = 0;
    std::chrono::steady_clock::time_point at;
    ApiReply answer;
  };
  using AllMade = std::map<JobId, Made>;
  static ApiReply remember(AllMade& all, JobId job, std::uint64_t version, Result<ApiReply> answer);

  FarmDesk& desk_;
  const Gate& gate_;
  const Kind kind_;
  const std::shared_ptr<AllMade> made_ = std::make_shared<AllMade>();
};

/// A PNG; NOT_FOUND of films without samples, or too large.
extern const FilmAnswers::Kind kThumbnailAnswer;
/// lightmill.v1.MeterReadings: one of each meter that the job's method reads, in the scene's order.
extern const FilmAnswers::Kind kMetersAnswer;

}  // namespace lightmill
