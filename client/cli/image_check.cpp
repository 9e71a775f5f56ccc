#include "client/cli/image_check.h"

#include <dlfcn.h>

#include <set>

#include "client/cli/child_process.h"
#include "client/images/inspect_image.h"
#include "common/base/file.h"
#include "common/scene/image_limits.h"

namespace lightmill::cli {
namespace {

/// Stays loaded: OpenImageIO has threads of its own.
Result<InspectImage*> load_inspector(const std::filesystem::path& library) {
  void* handle = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  void* symbol = handle == nullptr ? nullptr : ::dlsym(handle, kInspectImageSymbol);
  if (symbol == nullptr) {
    const char* reason = ::dlerror();
    return failed_precondition("images cannot be checked, {} cannot be loaded: {}; it belongs beside the program",
                               library.string(), reason == nullptr ? "unknown" : reason);
  }
  return reinterpret_cast<InspectImage*>(symbol);
}

Status check_image(InspectImage* inspect, const ImageAsset& image, LoadedScene& loaded) {
  ImageFacts facts;
  std::string problem;
  if (!inspect(as_byte_view(loaded.assets.at(image.asset)), image.name, facts, problem)) {
    return invalid_argument("{}: {}", image.place, problem);
  }
  const Status size = image.environment ? check_environment_size(facts.width, facts.height) : ok_status();
  if (!size.ok()) {
    return with_context(size, fmt::format("{}: {}", image.place, image.name));
  }
  if (facts.negative_pixels > 0) {
    loaded.notices.push_back(fmt::format("{}: {}: {} of {} pixels have negative values, which count as 0", image.place,
                                         image.name, facts.negative_pixels, std::int64_t{facts.width} * facts.height));
  }
  return ok_status();
}

}  // namespace

std::filesystem::path image_library() {
  return own_folder() / kImageLibrary;
}

Status check_images(const std::filesystem::path& library, LoadedScene& loaded, const Signals& signals) {
  if (loaded.images.empty()) {
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(InspectImage* const inspect, load_inspector(library));
  std::set<std::tuple<Sha256, std::string, bool>> checked;
  for (const ImageAsset& image : loaded.images) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    if (checked.emplace(image.asset, image.name, image.environment).second) {
      LM_RETURN_IF_ERROR(check_image(inspect, image, loaded));
    }
  }
  return ok_status();
}

}  // namespace lightmill::cli
