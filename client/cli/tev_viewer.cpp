#include "client/cli/tev_viewer.h"

#include <algorithm>

#include "common/wire/bytes.h"

namespace lightmill::cli {
namespace {

std::vector<TevTile> tiles_of(const v1::WatchJobResponse& response) {
  const v1::PixelRect& crop = response.job().crop();
  std::vector<TevTile> tiles;
  for (const v1::PreviewTile& tile : response.tiles()) {
    const v1::PixelRect& rect = tile.rect();
    if (Result<std::vector<float>> planes = floats_from_bytes(tile.rgb()); planes.ok()) {
      tiles.push_back({std::int64_t{rect.x()} - crop.x(), std::int64_t{rect.y()} - crop.y(), rect.width(),
                       rect.height(), *std::move(planes)});
    }
  }
  return tiles;
}

std::string title(std::uint64_t id, const v1::Job& job) {
  return fmt::format("job {}{}{}", id, job.name().empty() ? "" : " ", job.name());
}

}  // namespace

TevViewer::TevViewer(HostPort address, std::uint64_t job, const Console& console, const TevPauses& pauses,
                     const Clock& clock)
    : job_(job),
      console_(console),
      pauses_(pauses),
      clock_(clock),
      connection_(std::move(address), pauses.timeout, clock),
      thread_([this] { run(); }) {}

TevViewer::~TevViewer() {
  stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void TevViewer::update(const v1::WatchJobResponse& response) {
  if (response.tiles().empty()) {
    return;
  }
  std::vector<TevTile> tiles = tiles_of(response);
  {
    const MutexLock lock(mutex_);
    if (!picture_) {
      const v1::PixelRect& crop = response.job().crop();
      picture_.emplace(title(job_, response.job()), crop.width(), crop.height());
    }
    for (TevTile& tile : tiles) {
      picture_->put(std::move(tile));
    }
  }
  connection_.wake();
}

bool TevViewer::finish() {
  advance_to(Phase::finishing);
  thread_.join();
  return sent_all_;
}

void TevViewer::stop() {
  advance_to(Phase::stopped);
}

void TevViewer::advance_to(Phase phase) {
  {
    const MutexLock lock(mutex_);
    phase_ = std::max(phase_, phase);
  }
  connection_.wake();
}

TevViewer::Phase TevViewer::phase() {
  const MutexLock lock(mutex_);
  return phase_;
}

std::string TevViewer::next_packet() {
  const MutexLock lock(mutex_);
  return picture_ ? picture_->next_packet() : "";
}

void TevViewer::run() {
  for (;;) {
    Status status = connection_.open([this] { return phase() == Phase::stopped; });
    if (status.ok()) {
      status = serve();
    }
    connection_.close();
    if (status.ok() || phase() == Phase::stopped) {
      sent_all_ = status.ok() && phase() == Phase::finishing;
      return;
    }
    if (phase() == Phase::showing) {
      report_missing(status);
    }
    const Time again = clock_.now() + pauses_.retry;
    while (phase() == Phase::showing && clock_.now() < again) {
      (void)connection_.wait(again);
    }
    if (phase() != Phase::showing) {
      if (phase() == Phase::finishing) {
        report_incomplete(status);
      }
      return;
    }
  }
}

Status TevViewer::serve() {
  {
    const MutexLock lock(mutex_);
    if (picture_) {
      picture_->start_over();
    }
  }
  const Time lasts = clock_.now() + pauses_.lasting;
  for (;;) {
    const Phase phase = this->phase();  // before the packet: finish() comes after all updates
    if (connection_.all_taken()) {
      connection_.give(next_packet());
    }
    if (phase == Phase::stopped || (phase == Phase::finishing && connection_.all_taken())) {
      return ok_status();
    }
    LM_RETURN_IF_ERROR(connection_.wait(reported_missing_ ? lasts : Time::max()));
    if (clock_.now() >= lasts) {
      report_found();
    }
  }
}

void TevViewer::report_found() {
  if (std::exchange(reported_missing_, false)) {
    const HostPort& address = connection_.address();
    console_.notice(fmt::format("showing the picture in the viewer at {}:{}", address.host, address.port));
  }
}

void TevViewer::report_missing(const Status& why) {
  if (!std::exchange(reported_missing_, true)) {
    const HostPort& address = connection_.address();
    console_.notice(fmt::format("no viewer at {}:{} ({}): start tev or HDRView there. Retrying", address.host,
                                address.port, message_of(why)));
  }
}

void TevViewer::report_incomplete(const Status& why) {
  const HostPort& address = connection_.address();
  console_.notice(fmt::format("the picture at {}:{} is incomplete ({})", address.host, address.port, message_of(why)));
}

}  // namespace lightmill::cli
