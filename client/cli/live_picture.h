// A PNG file that follows a job. It is rewritten as tiles change.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/image/color.h"
#include "common/image/image.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill::cli {

/// Keeps a job's picture from its preview tiles, black where none has arrived. Writes it at most once a second.
class LivePicture {
 public:
  LivePicture(std::vector<std::string> png_paths, const ViewSettings& view, const Clock& clock)
      : paths_(std::move(png_paths)), view_(view), clock_(clock) {}

  bool wanted() const { return !paths_.empty(); }
  /// Takes the tiles of a message. DATA_LOSS for a tile outside the job's crop.
  Status update(const v1::WatchJobResponse& response);

 private:
  Status place(const v1::PreviewTile& tile);

  std::vector<std::string> paths_;
  ViewSettings view_;
  const Clock& clock_;
  ImageWindow window_;
  RgbImage image_;
  std::optional<Time> written_;
};

}  // namespace lightmill::cli
