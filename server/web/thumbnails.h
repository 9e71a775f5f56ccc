// The thumbnails of jobs, each made once for its film.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "server/api/gate.h"
#include "server/web/farm_reply.h"

namespace lightmill {

/// Belongs to the web's thread.
class Thumbnails {
 public:
  Thumbnails(FarmDesk& desk, const Gate& gate) : desk_(desk), gate_(gate) {}

  /// Answers with a PNG. The call was admitted; whether it may see this job is asked here.
  void send(const Call& call, JobId job, Reply reply);

 private:
  struct Thumbnail {
    std::uint64_t film_version = 0;
    std::string png;
  };
  using Made = std::map<JobId, Thumbnail>;
  static ApiReply answer(Made& made, JobId job, const PixelRect& crop, const std::vector<TileSnapshot>& tiles,
                         std::uint64_t version);

  FarmDesk& desk_;
  const Gate& gate_;
  const std::shared_ptr<Made> made_ = std::make_shared<Made>();
};

}  // namespace lightmill
