#include "worker/inspect/inspector.h"

#include <exception>

#include "common/base/log.h"
#include "worker/render/scene_limits.h"

namespace lightmill {
namespace {

constexpr Duration kMaxTime = std::chrono::seconds(60);

}  // namespace

Inspector::Inspector(AssetCache& assets, const SceneLimits& limits, const ReaderOptions& reader, AssetUploads uploads,
                     Done done, const Clock& clock)
    : assets_(assets),
      limits_(limits),
      reader_(reader),
      uploads_(std::move(uploads)),
      done_(std::move(done)),
      clock_(clock),
      thread_([this] { work(); }) {}

Inspector::~Inspector() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    stop_.request_stop();
    changed_.notify_one();
  }
  thread_.join();
}

void Inspector::add(std::shared_ptr<const InspectGrant> grant) {
  const MutexLock lock(mutex_);
  stop_.request_stop();
  stop_ = std::stop_source();
  waiting_ = std::move(grant);
  changed_.notify_one();
}

void Inspector::drop() {
  const MutexLock lock(mutex_);
  stop_.request_stop();
  waiting_ = nullptr;
}

void Inspector::work() {
  for (;;) {
    std::shared_ptr<const InspectGrant> grant;
    std::stop_token stop;
    {
      const MutexLock lock(mutex_);
      while (waiting_ == nullptr && !stopping_) {
        changed_.wait(mutex_);
      }
      if (stopping_) {
        return;
      }
      grant = std::exchange(waiting_, nullptr);
      stop = stop_.get_token();
    }
    InspectReport report{grant->inspection, internal_error("not read")};
    try {
      Result<Inspection> found = within_limits("the scene was read", [&] { return inspect(*grant, stop); });
      report.found =
          found.ok() ? Result<std::shared_ptr<const Inspection>>(std::make_shared<const Inspection>(*std::move(found)))
                     : found.status();
    } catch (const std::exception& error) {
      report.found = internal_error("the scene cannot be read: {}", error.what());
    }
    if (!stop.stop_requested()) {
      done_(std::move(report));
    }
  }
}

Result<Inspection> Inspector::inspect(const InspectGrant& grant, const std::stop_token& stop) {
  const Time start = clock_.now();
  const auto may_continue = [&]() -> Status {
    if (stop.stop_requested()) {
      return cancelled("the worker leaves");
    }
    return clock_.now() < start + kMaxTime
               ? ok_status()
               : make_error(StatusCode::kDeadlineExceeded,
                            "reading the scene takes more than {:.0f} s: `lightmill submit` reads it on your machine",
                            to_seconds(kMaxTime));
  };
  Result<Inspection> found =
      inspect_in_reader(*grant.request, limits_, reader_,
                        {[this](const Sha256& digest) { return assets_.get(digest); }, uploads_, may_continue});
  spdlog::info("inspection {} of {} files: {} after {:.0f} ms", grant.inspection.value, grant.request->files.size(),
               found.ok() ? "done" : "failed", 1000 * to_seconds(clock_.now() - start));
  return found;
}

}  // namespace lightmill
