// Jobs and what they are made of, in and out over HTTP: requests and answers that may be large, and take their time.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "server/runtime/gate.h"
#include "server/store/asset_store.h"
#include "server/web/byte_budget.h"
#include "server/web/farm_reply.h"
#include "server/web/page_jobs.h"

namespace lightmill {

/// Calls whose bodies may be large: whether one may be made is asked before its body is taken in.
struct LargeCall {
  std::string_view path;
  Rpc rpc;
  std::uint64_t most_bytes;  ///< of the body
};
/// Null if bodies of this path are small.
const LargeCall* find_large_call(std::string_view path);

struct LargeBody {
  std::string text;
  ByteBudget::Place place;  ///< null: it is small
};

/// Runs something on a thread for what takes its time; drops it when the web ends. Thread-safe.
using OnSideThread = std::function<void(std::function<void()>)>;

/// Belongs to the web's thread. Calls were admitted.
class JobIntake {
 public:
  /// What large answers may hold together until they are read; those of one caller half.
  static constexpr std::uint64_t kMostAnswerBytes = std::uint64_t{256} << 20;
  JobIntake(FarmDesk& desk, const Gate& gate, const AssetStore& assets, PageJobs& page_jobs,
            OnSideThread on_side_thread)
      : desk_(desk), gate_(gate), assets_(assets), page_jobs_(page_jobs), on_side_thread_(std::move(on_side_thread)) {}

  /// Of a SubmitJobRequest: the job, once it is stored. It ends with this page, unless that is empty.
  void submit(const Call& call, std::string_view page, LargeBody body, Reply reply);
  /// Of a FindMissingAssetsRequest.
  void find_missing(LargeBody body, Reply reply);
  /// Of an InspectSceneRequest: what a worker has found (inspections.cpp).
  void inspect(const Call& call, LargeBody body, Reply reply);
  /// What was submitted. Whether the caller may see this job is asked here.
  void send_spec(const Call& call, JobId job, Reply reply);

 private:
  FarmDesk& desk_;
  const Gate& gate_;
  const AssetStore& assets_;
  PageJobs& page_jobs_;
  /// Of answers; bodies have one of their own, so that who reads slowly holds up nobody who sends. The farm thread's
  /// own.
  const std::shared_ptr<CallersBudget> budget_ = std::make_shared<CallersBudget>(kMostAnswerBytes);
  const OnSideThread on_side_thread_;
};

}  // namespace lightmill
