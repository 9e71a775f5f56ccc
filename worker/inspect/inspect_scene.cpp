#include "worker/inspect/inspect_scene.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"
#include "common/scene_io/load.h"
#include "common/scene_io/picture_notices.h"
#include "common/scene_io/scene_report.h"
#include "common/wire/limits.h"
#include "common/wire/scene_proto.h"

namespace lightmill {
namespace {

/// Limits of a report: rows of each kind, and bytes of each text. A malicious scene could produce more.
constexpr std::size_t kMaxRows = 500;
constexpr std::size_t kMaxTextBytes = 1000;
constexpr std::uint64_t kFilesShare = 8;

/// Errors of the scene are errors of its sender, even if a file is damaged or missing.
Status as_senders(const Status& status) {
  return status.code() == StatusCode::kNotFound || status.code() == StatusCode::kFailedPrecondition ||
                 status.code() == StatusCode::kOutOfRange
             ? invalid_argument("{}", message_of(status))
             : status;
}

/// Names and lines of the files may contain any bytes, but a message must be valid UTF-8.
std::string cut(std::string_view raw) {
  return cut_text(printable(raw, true), kMaxTextBytes);
}

std::vector<std::string> cut_all(std::vector<std::string> texts) {
  const std::size_t all = texts.size();
  texts.resize(std::min(all, kMaxRows));
  std::ranges::transform(texts, texts.begin(), [](const std::string& text) { return cut(text); });
  if (all > kMaxRows) {
    texts.push_back(fmt::format("… and {} more", all - kMaxRows));
  }
  return texts;
}

/// Reads only the headers of images. Workers that render decode them.
Status check_images(LoadedScene& loaded, const SceneLimits& limits, DecoderProcess& images) {
  std::set<std::tuple<Sha256, std::string, bool>> checked;
  for (const ImageAsset& image : loaded.images) {
    if (!checked.emplace(image.asset, image.name, image.environment).second) {
      continue;
    }
    LM_ASSIGN_OR_RETURN(
        const ImageSize size,
        with_context(images.size(as_byte_view(loaded.assets.at(image.asset)), image.name), image.place));
    if (size.pixels() > static_cast<std::uint64_t>(limits.image_pixels)) {
      return resource_exhausted("{}: {}: {} pixels are more than the worker's limit of {} (--image-megapixels)",
                                image.place, image.name, size.pixels(), limits.image_pixels);
    }
    LM_RETURN_IF_ERROR(check_image_header(image, size, loaded.notices));
  }
  return ok_status();
}

void add_facts(const ReportRows& rows, Inspection& out) {
  for (const std::vector<std::string>& row : rows) {
    if (out.facts.size() < kMaxRows) {
      out.facts.push_back({cut(row.at(0)), cut(row.at(1))});
    }
  }
}

/// Decodes compressed meshes. All of them together have a limit, because a small file can hold a large mesh.
class InspectedMeshes {
 public:
  InspectedMeshes(DecoderProcess& decoder, const SceneLimits& limits)
      : decoder_(decoder), most_bytes_(limits.bytes / kFilesShare) {}

  Result<DecodedMesh> decode(ByteView bytes, const MeshRequest& request) {
    Result<DecodedMesh> mesh = try_decode(bytes, request);
    if (mesh.status().code() == StatusCode::kFailedPrecondition) {
      no_decoder_ = true;
    }
    return mesh;
  }
  /// Whether this worker cannot decode meshes, which is no fault of the sender.
  bool no_decoder() const { return no_decoder_; }

 private:
  Result<DecodedMesh> try_decode(ByteView bytes, const MeshRequest& request) {
    LM_RETURN_IF_ERROR(check_request(request));
    bytes_ += size_bytes(request);
    if (bytes_ > most_bytes_) {
      return resource_exhausted(
          "the scene's compressed meshes have more than {}, which is 1/{} of the worker's --scene-gib: `lightmill "
          "submit` reads them on your machine",
          human_bytes(most_bytes_), kFilesShare);
    }
    return decoder_.decode_mesh(bytes, request);
  }

  DecoderProcess& decoder_;
  const std::uint64_t most_bytes_;
  std::uint64_t bytes_ = 0;
  bool no_decoder_ = false;
};

Result<LoadedScene> load(const InspectionRequest& request, const SceneLimits& limits, DecoderProcess& decoder,
                         const InspectionHooks& hooks) {
  std::uint64_t bytes = 0;
  UploadedFiles files([&](const Sha256& digest) -> Result<std::string> {
    LM_ASSIGN_OR_RETURN(std::string file, hooks.fetch(digest));
    bytes += file.size();
    // A reader needs several times the size of its text, next to scenes that are being rendered.
    if (bytes > limits.bytes / kFilesShare) {
      return resource_exhausted(
          "the scene's files have more than {}, which is 1/{} of the worker's --scene-gib: `lightmill submit` reads "
          "them on your machine",
          human_bytes(limits.bytes / kFilesShare), kFilesShare);
    }
    return file;
  });
  for (const InspectionRequest::File& file : request.files) {
    LM_RETURN_IF_ERROR(files.add(file.path, file.digest));
  }
  LoadOptions options;
  options.camera = request.camera;
  options.files = &files;
  InspectedMeshes meshes(decoder, limits);
  options.decode_mesh = [&meshes](ByteView mesh, const MeshRequest& wanted) { return meshes.decode(mesh, wanted); };
  const std::vector<std::filesystem::path> paths(request.scene.begin(), request.scene.end());
  Result<LoadedScene> loaded = load_scene(paths, options);
  return loaded.ok() || meshes.no_decoder() ? std::move(loaded) : Result<LoadedScene>(as_senders(loaded.status()));
}

Result<Inspection> inspect(const InspectionRequest& request, const SceneLimits& limits, DecoderProcess& images,
                           const InspectionHooks& hooks) {
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, load(request, limits, images, hooks));
  LM_RETURN_IF_ERROR(check_images(loaded, limits, images));
  const Result<SceneReport> report = report_on(loaded);
  if (!report.ok()) {
    return as_senders(report.status());
  }
  const auto assets = [&](const Sha256& digest) -> Result<std::string> { return loaded.assets.at(digest); };
  LM_RETURN_IF_ERROR(check_memory(loaded.scene, assets, images, limits.bytes));
  Inspection out;
  out.scene = pack_scene(loaded.scene);
  if (out.scene.size() > kMaxSceneBytes || loaded.assets.size() > kMaxAssets) {
    return resource_exhausted("the scene's document has {} and {} assets, more than the {} and {} that a job may have",
                              human_bytes(out.scene.size()), loaded.assets.size(), human_bytes(kMaxSceneBytes),
                              kMaxAssets);
  }
  if (const std::size_t entries = count_entries(out.scene); entries > kMaxInspectedEntries) {
    return resource_exhausted(
        "the scene has {} objects, materials, textures and lights, more than the {} that the page shows: submit it with "
        "`lightmill submit`",
        entries, kMaxInspectedEntries);
  }
  for (const auto& [digest, bytes] : loaded.assets) {
    out.assets.push_back(digest);  // a map: sorted, without duplicates
  }
  LM_RETURN_IF_ERROR(hooks.upload(loaded.assets));
  out.notices = cut_all(loaded.notices);
  add_facts(scene_rows(loaded, *report), out);
  add_facts(fact_rows(report->facts), out);
  for (const Verdict& verdict : admit_all(report->facts)) {
    out.methods.push_back({verdict.method, verdict.admitted, cut(verdict.reason)});
  }
  const MethodPlan plan = plan_method(report->facts, kAutoMethod);
  out.chosen = plan.candidates;
  for (const NamedCamera& camera : loaded.cameras) {
    out.cameras.push_back(camera.name);
  }
  out.cameras = cut_all(std::move(out.cameras));
  return out;
}

}  // namespace

Result<Inspection> inspect_scene(const InspectionRequest& request, const SceneLimits& limits, DecoderProcess& images,
                                 const InspectionHooks& hooks) {
  Result<Inspection> found = inspect(request, limits, images, hooks);
  return found.ok() ? std::move(found)
                    : Result<Inspection>(make_error(found.status().code(), "{}", cut(message_of(found.status()))));
}

}  // namespace lightmill
