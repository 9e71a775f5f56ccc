// Downloads of job pictures: OpenEXR with the whole film, and PNG.
#pragma once

#include <deque>
#include <memory>
#include <thread>

#include "common/base/mutex.h"
#include "common/image/picture_file.h"
#include "server/operations/messages.h"
#include "server/runtime/access_control.h"
#include "server/web/farm_requests.h"

namespace lightmill {

/// Used on the web thread. Its own thread makes the pictures, one at a time.
class JobPictures {
 public:
  /// Limit of one picture, by the values of its film.
  static constexpr std::uint64_t kMaxBytesOfOne = std::uint64_t{1} << 30;

  /// `most_bytes`: limit of all pictures that are made or sent at a time.
  JobPictures(FarmRequests& farm_requests, const AccessControl& access, std::uint64_t most_bytes);
  /// Waits for the current picture.
  ~JobPictures();
  JobPictures(const JobPictures&) = delete;
  JobPictures& operator=(const JobPictures&) = delete;

  /// Answers with the file that `lightmill fetch -o` writes. The call is admitted. This checks whether it may read the
  /// job.
  void send(const Call& call, JobId job, PictureFormat format, Reply reply);

 private:
  struct Order;
  struct Queue;
  void run();

  FarmRequests& farm_requests_;
  const AccessControl& access_;
  const std::shared_ptr<Queue> queue_;
  std::thread thread_;
};

}  // namespace lightmill
