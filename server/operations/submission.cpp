#include "server/operations/submission.h"

#include "common/base/text.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"
#include "server/operations/method_choice.h"

namespace lightmill {
namespace {

constexpr int kMostDigests = 10'000;

Status check_assets(const JobSpec& spec, const AssetStore& assets) {
  for (const Sha256& asset : spec.settings.assets) {
    if (!assets.keep(asset)) {
      return failed_precondition("asset {} is missing: upload it first", asset.hex());
    }
  }
  return ok_status();
}

}  // namespace

Status find_missing(const AssetStore& assets, const v1::FindMissingAssetsRequest& request,
                    v1::FindMissingAssetsResponse* reply) {
  if (request.digests_size() > kMostDigests) {
    return invalid_argument("digests: {} are more than the limit of {}", request.digests_size(), kMostDigests);
  }
  for (const std::string& bytes : request.digests()) {
    const Result<Sha256> digest = digest_from_bytes(bytes);
    if (!digest.ok()) {
      return with_context(digest.status(), "digests");
    }
    if (!assets.keep(*digest)) {
      reply->add_missing(bytes);
    }
  }
  return ok_status();
}

Status check_files(const InspectionRequest& request, const AssetStore& assets) {
  std::uint64_t bytes = 0;
  for (const InspectionRequest::File& file : request.files) {
    const Result<std::uint64_t> size = assets.keep(file.digest) ? assets.size(file.digest) : not_found("");
    if (!size.ok()) {
      return failed_precondition("{}: asset {} is missing: upload it first", printable(file.path), file.digest.hex());
    }
    bytes += *size;
  }
  return bytes <= kMostInspectedBytes
             ? ok_status()
             : resource_exhausted(
                   "the {} files have {} MiB, more than the {} that one inspection may read: `lightmill submit` "
                   "reads them where they are",
                   request.files.size(), bytes >> 20, kMostInspectedBytes >> 20);
}

Result<Submission> read_submission(const v1::SubmitJobRequest& request, const AssetStore& assets) {
  Submission submission;
  LM_ASSIGN_OR_RETURN(submission.spec, from_wire(request));
  LM_RETURN_IF_ERROR(check_assets(submission.spec, assets));
  LM_ASSIGN_OR_RETURN(submission.notes, settle_method(submission.spec, assets));
  want_bias_layer(submission.spec, submission.notes);
  return submission;
}

Status submit(FarmLoop::Turn& turn, const Call& call, Submission& submission, About& about) {
  JobSpec& spec = submission.spec;
  if (call.caller.is_known()) {
    spec.owner = call.caller.name;
  }
  about.was_there = turn.farm.knows_request(spec.request_id);
  LM_ASSIGN_OR_RETURN(const JobId job, turn.farm.submit(spec, turn.now, turn.unix_ms, turn.effects, submission.notes));
  if (call.caller.is_known() && turn.farm.owner(job).value_or("") != call.caller.name) {
    return already_exists("request_id '{}' is that of somebody else's job: choose another", spec.request_id);
  }
  about.job = job.value;
  return ok_status();
}

}  // namespace lightmill
