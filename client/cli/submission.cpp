#include "client/cli/submission.h"

#include "common/base/number_text.h"
#include "common/wire/farm_messages.h"

namespace lightmill::cli {
namespace {

constexpr std::uint64_t kWorthShowing = std::uint64_t{1} << 20;  // bytes; smaller uploads end at once

Status upload_missing(CoordinatorClient& connection, const PreparedJob& job, const Console& console) {
  LM_ASSIGN_OR_RETURN(const std::vector<Sha256> missing, connection.find_missing_assets(*job.spec.settings.assets));
  std::uint64_t total = 0, before = 0;
  for (const Sha256& digest : missing) {
    const auto asset = job.scene.assets.find(digest);
    if (asset == job.scene.assets.end()) {
      return internal_error("the farm requested an asset that the scene does not have: {}", digest.hex());
    }
    total += asset->second.size();
  }
  for (const Sha256& digest : missing) {
    const std::string& bytes = job.scene.assets.at(digest);
    LM_RETURN_IF_ERROR(connection.upload_asset(digest, as_byte_view(bytes), [&](std::size_t sent) {
      if (console.terminal() && total > kWorthShowing) {
        console.redraw(fmt::format("sending the scene: {} of {}", human_bytes(before + sent), human_bytes(total)));
      }
    }));
    before += bytes.size();
  }
  if (total > kWorthShowing) {
    console.notice(fmt::format("sent {} of scene files ({})", human_bytes(total), counted(missing.size(), "file")));
  }
  return ok_status();
}

}  // namespace

Result<v1::Job> submit_job(CoordinatorClient& connection, const PreparedJob& job, const Console& console) {
  LM_RETURN_IF_ERROR(upload_missing(connection, job, console));
  v1::SubmitJobRequest request;
  to_wire(job.spec, &request);
  return connection.submit(request);
}

}  // namespace lightmill::cli
