#include "common/wire/bytes.h"

#include <algorithm>
#include <array>

#include "common/wire/farm_messages.h"
#include "common/wire/limits.h"
#include "common/wire/scene_proto.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/worker_service.pb.h"

namespace lightmill {
namespace {

template <class Repeated>
Status check_texts(std::string_view field, const Repeated& texts) {
  std::size_t bytes = 0;
  for (const std::string& text : texts) {
    bytes += text.size();
  }
  return static_cast<std::size_t>(texts.size()) <= kMaxInspectionRows && bytes <= kMaxPathsBytes
             ? ok_status()
             : invalid_argument("{}: {} texts of {} bytes are more than the limits of {} and {}", field, texts.size(),
                                bytes, kMaxInspectionRows, kMaxPathsBytes);
}

template <class Repeated>
std::vector<std::string> as_strings(const Repeated& texts) {
  return {texts.begin(), texts.end()};
}

}  // namespace

void to_wire(const InspectionRequest& request, v1::InspectSceneRequest* out) {
  for (const InspectionRequest::File& file : request.files) {
    v1::InspectSceneRequest::File* wire = out->add_files();
    wire->set_path(file.path);
    wire->set_digest(digest_bytes(file.digest));
  }
  out->mutable_scene()->Assign(request.scene.begin(), request.scene.end());
  out->set_camera(request.camera);
}

Result<InspectionRequest> from_wire(const v1::InspectSceneRequest& request) {
  if (static_cast<std::size_t>(request.files_size()) > kMaxSceneFiles) {
    return invalid_argument("files: {} are more than the limit of {}", request.files_size(), kMaxSceneFiles);
  }
  InspectionRequest out;
  std::size_t path_bytes = 0;
  for (int i = 0; i < request.files_size(); ++i) {
    const v1::InspectSceneRequest::File& file = request.files(i);
    const Result<Sha256> digest = digest_from_bytes(file.digest());
    if (!digest.ok()) {
      return with_context(digest.status(), fmt::format("files[{}].digest", i));
    }
    path_bytes += file.path().size();
    if (file.path().empty() || file.path().size() > kMaxPathBytes || path_bytes > kMaxPathsBytes) {
      return invalid_argument("files[{}].path: 1 to {} bytes are expected, of all paths at most {}, got {}", i,
                              kMaxPathBytes, kMaxPathsBytes, file.path().size());
    }
    out.files.push_back({file.path(), *digest});
  }
  LM_RETURN_IF_ERROR(check_texts("scene", request.scene()));
  out.scene = as_strings(request.scene());
  if (out.scene.empty()) {
    return invalid_argument("scene: the path of at least one scene file is expected");
  }
  if (request.camera().size() > kMaxPathBytes) {
    return invalid_argument("camera: {} bytes are more than the limit of {}", request.camera().size(), kMaxPathBytes);
  }
  out.camera = request.camera();
  return out;
}

void to_wire(const Inspection& inspection, v1::InspectSceneResponse* out) {
  out->set_packed(inspection.scene);
  for (const Sha256& asset : inspection.assets) {
    out->add_assets(digest_bytes(asset));
  }
  out->mutable_notices()->Assign(inspection.notices.begin(), inspection.notices.end());
  for (const Inspection::Fact& fact : inspection.facts) {
    v1::InspectSceneResponse::Fact* wire = out->add_facts();
    wire->set_what(fact.what);
    wire->set_value(fact.value);
  }
  for (const Inspection::Verdict& verdict : inspection.methods) {
    v1::InspectSceneResponse::Verdict* wire = out->add_methods();
    wire->set_method(verdict.method);
    wire->set_admitted(verdict.admitted);
    wire->set_reason(verdict.reason);
  }
  out->mutable_chosen()->Assign(inspection.chosen.begin(), inspection.chosen.end());
  out->mutable_cameras()->Assign(inspection.cameras.begin(), inspection.cameras.end());
}

Status fill_scene(v1::InspectSceneResponse* out) {
  return out->mutable_scene()->ParseFromString(out->packed())
             ? ok_status()
             : internal_error("the worker's packed scene cannot be read");
}

Result<Inspection> from_wire(const v1::InspectSceneResponse& response) {
  if (response.packed().size() > kMaxSceneBytes || static_cast<std::size_t>(response.assets_size()) > kMaxAssets) {
    return invalid_argument("found: a scene of {} bytes with {} assets is beyond the limits of {} and {}",
                            response.packed().size(), response.assets_size(), kMaxSceneBytes, kMaxAssets);
  }
  if (const std::size_t entries = count_entries(response.packed()); entries > kMaxInspectedEntries) {
    return invalid_argument("found: a scene of {} entries is beyond the limit of {}", entries, kMaxInspectedEntries);
  }
  Inspection out;
  out.scene = response.packed();
  for (const std::string& bytes : response.assets()) {
    LM_ASSIGN_OR_RETURN(out.assets.emplace_back(), digest_from_bytes(bytes));
  }
  LM_RETURN_IF_ERROR(check_texts("notices", response.notices()));
  LM_RETURN_IF_ERROR(check_texts("chosen", response.chosen()));
  LM_RETURN_IF_ERROR(check_texts("cameras", response.cameras()));
  if (static_cast<std::size_t>(std::max(response.facts_size(), response.methods_size())) > kMaxInspectionRows) {
    return invalid_argument("found: more than {} facts or methods", kMaxInspectionRows);
  }
  out.notices = as_strings(response.notices());
  for (const v1::InspectSceneResponse::Fact& fact : response.facts()) {
    out.facts.push_back({fact.what(), fact.value()});
  }
  for (const v1::InspectSceneResponse::Verdict& verdict : response.methods()) {
    out.methods.push_back({verdict.method(), verdict.admitted(), verdict.reason()});
  }
  out.chosen = as_strings(response.chosen());
  out.cameras = as_strings(response.cameras());
  return out;
}

void to_wire(const InspectReport& report, v1::InspectReport* out) {
  out->set_inspection(report.inspection.value);
  if (report.found.ok()) {
    to_wire(**report.found, out->mutable_found());
  } else {
    out->set_code(static_cast<int>(report.found.status().code()));
    out->set_problem(sentence(message_of(report.found.status())));
  }
}

Result<InspectReport> from_wire(const v1::InspectReport& report) {
  const InspectionId id{report.inspection()};
  if (report.code() != 0) {
    if (report.problem().size() > kMaxReasonBytes) {
      return invalid_argument("inspection.problem: {} bytes are more than the limit of {}", report.problem().size(),
                              kMaxReasonBytes);
    }
    // A reader's own reasons. The user must not take the worker's answer for one of the coordinator about their rights.
    constexpr std::array kPassedOn{StatusCode::kInvalidArgument, StatusCode::kResourceExhausted,
                                   StatusCode::kFailedPrecondition, StatusCode::kDeadlineExceeded,
                                   StatusCode::kUnavailable};
    const auto code = static_cast<StatusCode>(report.code());
    const bool known = std::ranges::find(kPassedOn, code) != kPassedOn.end();
    return InspectReport{id, make_error(known ? code : StatusCode::kUnknown, "{}", printable(report.problem(), true))};
  }
  LM_ASSIGN_OR_RETURN(Inspection found, from_wire(report.found()));
  return InspectReport{id, std::make_shared<const Inspection>(std::move(found))};
}

void to_wire(const InspectGrant& grant, v1::InspectGrant* out) {
  out->set_inspection(grant.inspection.value);
  to_wire(*grant.request, out->mutable_request());
}

Result<InspectGrant> from_wire(const v1::InspectGrant& grant) {
  LM_ASSIGN_OR_RETURN(InspectionRequest files, from_wire(grant.request()));
  return InspectGrant{InspectionId{grant.inspection()}, std::make_shared<const InspectionRequest>(std::move(files))};
}

}  // namespace lightmill
