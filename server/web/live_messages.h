// Messages of the page's WebSocket (lightmill/v1/web.proto) as bytes. Content for several viewers is encoded once.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/ids.h"
#include "common/base/status.h"
#include "common/farm/job.h"
#include "server/access/identity.h"
#include "server/domain/coordinator.h"
#include "server/web/change_log.h"

namespace lightmill {

namespace v1 {
class FarmGreeting;
}

/// A viewer's request: lightmill.v1.ViewRequest.
struct ViewRequest {
  bool hidden = false, jobs = false, workers = false;
  JobId job;  ///< 0: none
  std::uint64_t seen = 0;
  std::vector<std::string> layers;  ///< besides beauty, without duplicates
  std::string page;                 ///< name of the page for its jobs (PageJobs); empty: none
};

inline constexpr int kMaxViewLayers = 16;

/// Accepts any bytes. INVALID_ARGUMENT if they are not a ViewRequest, or ask for too many layers.
Result<ViewRequest> parse_view_request(std::string_view bytes);

/// First message to a page.
struct FarmGreeting {
  std::string version;
  std::vector<std::string> notices;
  Identity caller;
};
void to_wire(const FarmGreeting& greeting, v1::FarmGreeting* out);

/// Code that closes a WebSocket when the caller's credentials have expired.
inline constexpr std::uint16_t kNoLongerAllowed = 4401;

/// A lightmill.v1.Job, with its history if `whole`.
std::string job_bytes(const JobStatus& job, bool whole);
std::string worker_bytes(const WorkerStatus& worker);
/// A tile of one layer (empty: beauty) as a field of ViewUpdate, with tag and length. These bytes may follow those of
/// any ViewUpdate. `pixels`: as view_pixels gives them.
std::string tile_field(JobId job, const std::string& layer, const PixelRect& rect, std::uint64_t samples,
                       const std::string& pixels);

/// Builds the ViewUpdate of one viewer, without tiles.
class ViewUpdateWriter {
 public:
  void greet(const FarmGreeting& greeting);
  void jobs(const std::vector<SharedBytes>& jobs, const std::vector<JobId>& removed, bool whole);
  void workers(const std::vector<SharedBytes>& workers, const std::vector<std::string>& removed, bool whole);
  void job(const std::string& bytes);
  void job_failure(const Status& why);
  /// OK: the layer's pixels follow.
  void layer_failure(JobId job, const std::string& layer, const Status& why);
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace lightmill
