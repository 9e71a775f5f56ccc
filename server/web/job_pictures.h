// The pictures of jobs as files for people: OpenEXR with all that the film holds, and PNG.
#pragma once

#include <deque>
#include <memory>
#include <thread>

#include "common/base/mutex.h"
#include "common/image/picture_file.h"
#include "server/operations/film_messages.h"
#include "server/runtime/gate.h"
#include "server/web/farm_reply.h"

namespace lightmill {

/// Belongs to the web's thread. Pictures are put together and encoded by a thread of its own, one after the other.
class JobPictures {
 public:
  /// What one picture may take, by the values of its film.
  static constexpr std::uint64_t kMostBytesOfOne = std::uint64_t{1} << 30;

  /// `most_bytes`: what the pictures that are made, or on their way, may take together.
  JobPictures(FarmDesk& desk, const Gate& gate, std::uint64_t most_bytes);
  /// Waits for the one that is being made.
  ~JobPictures();
  JobPictures(const JobPictures&) = delete;
  JobPictures& operator=(const JobPictures&) = delete;

  /// Answers with the file that `lightmill fetch -o` would write. The call was admitted; whether it may see this job is
  /// asked here.
  void send(const Call& call, JobId job, PictureFormat format, Reply reply);

 private:
  struct Order;
  struct Queue;
  void run();

  FarmDesk& desk_;
  const Gate& gate_;
  const std::shared_ptr<Queue> queue_;
  std::thread thread_;
};

}  // namespace lightmill
