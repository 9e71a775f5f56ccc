#include "client/lab/experiment.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "common/base/text.h"

namespace lightmill::lab {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr std::uint64_t kMaxLabSamples = std::uint64_t{1} << 30;
constexpr std::uint64_t kDefaultMaxSamples = 65'536;
constexpr std::size_t kMaxItems = 1000;
constexpr int kMaxSide = 16'384;  // on a side

Status check_keys(const json& object, const std::string& place, const std::set<std::string>& known) {
  if (!object.is_object()) {
    return invalid_argument("{}: must be an object", place);
  }
  for (const auto& [key, value] : object.items()) {
    if (!known.contains(key)) {
      return invalid_argument("{}: unknown field \"{}\"", place, printable(key));
    }
  }
  return ok_status();
}

Result<std::uint64_t> whole(const json& value, const std::string& place, std::uint64_t least, std::uint64_t most) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() < least || value.get<std::uint64_t>() > most) {
    return invalid_argument("{}: must be a whole number from {} to {}, got {}", place, least, most,
                            printable(value.dump()));
  }
  return value.get<std::uint64_t>();
}

Result<double> positive(const json& value, const std::string& place) {
  if (!value.is_number() || !(value.get<double>() > 0) || !std::isfinite(value.get<double>())) {
    return invalid_argument("{}: must be a positive number, got {}", place, printable(value.dump()));
  }
  return value.get<double>();
}

Result<std::string> text_of(const json& value, const std::string& place) {
  if (!value.is_string() || value.get<std::string>().empty()) {
    return invalid_argument("{}: must be a string, got {}", place, printable(value.dump()));
  }
  return value.get<std::string>();
}

/// The items of a non-empty array, each read by `read(item, place)`.
template <class T, class Read>
Result<std::vector<T>> list_of(const json& value, const std::string& place, const Read& read) {
  if (!value.is_array() || value.empty() || value.size() > kMaxItems) {
    return invalid_argument("{}: must be a list of 1 to {} items", place, kMaxItems);
  }
  std::vector<T> items;
  for (const json& item : value) {
    LM_ASSIGN_OR_RETURN(T read_item, read(item, fmt::format("{}[{}]", place, items.size())));
    items.push_back(std::move(read_item));
  }
  return items;
}

Result<std::string> path_of(const json& value, const std::string& place, const fs::path& folder) {
  LM_ASSIGN_OR_RETURN(const std::string text, text_of(value, place));
  return (folder / text).lexically_normal().string();
}

Result<Reference> read_reference(const json& value, const std::string& place, const fs::path& folder) {
  Reference reference;
  if (value.is_string()) {
    LM_ASSIGN_OR_RETURN(reference.file, path_of(value, place, folder));
    return reference;
  }
  LM_RETURN_IF_ERROR(check_keys(value, place, {"method", "samples", "error", "seed"}));
  if (!value.contains("method") || value.contains("samples") == value.contains("error")) {
    return invalid_argument("{}: must be a file, or a method with samples or an error", place);
  }
  LM_ASSIGN_OR_RETURN(reference.method, text_of(value["method"], place + ".method"));
  if (value.contains("samples")) {
    LM_ASSIGN_OR_RETURN(reference.samples, whole(value["samples"], place + ".samples", 1, kMaxLabSamples));
  } else {
    LM_ASSIGN_OR_RETURN(reference.error, positive(value["error"], place + ".error"));
  }
  if (value.contains("seed")) {
    LM_ASSIGN_OR_RETURN(reference.seed, whole(value["seed"], place + ".seed", 0, ~std::uint64_t{0}));
  }
  return reference;
}

Result<LabScene> read_scene(const json& value, const std::string& place, const fs::path& folder,
                            const std::optional<Reference>& common) {
  LabScene scene;
  std::optional<Reference> reference = common;
  if (value.is_string()) {
    LM_ASSIGN_OR_RETURN(std::string file, path_of(value, place, folder));
    scene.files.push_back(std::move(file));
  } else {
    LM_RETURN_IF_ERROR(check_keys(value, place, {"name", "file", "files", "camera", "reference"}));
    if (value.contains("file") == value.contains("files")) {
      return invalid_argument("{}: must have a \"file\" or \"files\"", place);
    }
    if (value.contains("file")) {
      LM_ASSIGN_OR_RETURN(std::string file, path_of(value["file"], place + ".file", folder));
      scene.files.push_back(std::move(file));
    } else {
      LM_ASSIGN_OR_RETURN(scene.files, list_of<std::string>(value["files"], place + ".files",
                                                            [&](const json& item, const std::string& where) {
                                                              return path_of(item, where, folder);
                                                            }));
    }
    if (value.contains("name")) {
      LM_ASSIGN_OR_RETURN(scene.name, text_of(value["name"], place + ".name"));
      LM_RETURN_IF_ERROR(check_name(place + ".name", scene.name));
    }
    if (value.contains("camera")) {
      LM_ASSIGN_OR_RETURN(scene.camera, text_of(value["camera"], place + ".camera"));
      // A camera file is relative to the experiment, as the scene is. Otherwise this is a name in the scene.
      std::error_code error;
      if (fs::exists(folder / scene.camera, error)) {
        scene.camera = (folder / scene.camera).lexically_normal().string();
      }
    }
    if (value.contains("reference")) {
      LM_ASSIGN_OR_RETURN(reference, read_reference(value["reference"], place + ".reference", folder));
    }
  }
  if (scene.name.empty()) {
    scene.name = as_name(fs::path(scene.files.front()).stem().string());
  }
  if (!reference) {
    return invalid_argument("{}: has no reference: give it one, or give the experiment one", place);
  }
  scene.reference = *reference;
  return scene;
}

Result<std::vector<std::uint64_t>> read_seeds(const json& value) {
  if (!value.is_array()) {
    LM_ASSIGN_OR_RETURN(const std::uint64_t count, whole(value, "seeds", 1, kMaxItems));
    std::vector<std::uint64_t> seeds(count);
    std::iota(seeds.begin(), seeds.end(), std::uint64_t{1});
    return seeds;
  }
  return list_of<std::uint64_t>(value, "seeds", [](const json& item, const std::string& place) {
    return whole(item, place, 0, ~std::uint64_t{0});
  });
}

/// INVALID_ARGUMENT that names the first two neighbours that `is_wrong` finds.
template <class T, class Wrong>
Status check_order(const std::vector<T>& levels, std::string_view name, std::string_view wanted,
                   const Wrong& is_wrong) {
  const auto at = std::ranges::adjacent_find(levels, is_wrong);
  return at == levels.end() ? ok_status()
                            : invalid_argument("{0}[{1}]: {2} must be {3} {0}[{4}], which is {5}", name,
                                               at - levels.begin() + 1, at[1], wanted, at - levels.begin(), at[0]);
}

Status read_levels(const json& document, Experiment& experiment) {
  if (document.contains("samples") == document.contains("errors")) {
    return invalid_argument(
        "an experiment needs either \"samples\" or \"errors\": the levels at which pictures are compared");
  }
  if (document.contains("samples")) {
    LM_ASSIGN_OR_RETURN(experiment.samples, list_of<std::uint64_t>(document["samples"], "samples",
                                                                   [](const json& item, const std::string& place) {
                                                                     return whole(item, place, 1, kMaxLabSamples);
                                                                   }));
    LM_RETURN_IF_ERROR(check_order(experiment.samples, "samples", "above", std::greater_equal<>()));
    if (document.contains("max_samples")) {
      return invalid_argument("max_samples: applies only to errors, and this experiment has samples");
    }
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(experiment.errors, list_of<double>(document["errors"], "errors", positive));
  LM_RETURN_IF_ERROR(check_order(experiment.errors, "errors", "below", std::less_equal<>()));
  experiment.max_samples = kDefaultMaxSamples;
  if (document.contains("max_samples")) {
    LM_ASSIGN_OR_RETURN(experiment.max_samples, whole(document["max_samples"], "max_samples", 1, kMaxLabSamples));
  }
  return ok_status();
}

template <class T, class Of>
Status check_each_once(const std::vector<T>& items, const char* what, const Of& of) {
  for (auto at = items.begin(); at != items.end(); ++at) {
    if (std::any_of(items.begin(), at, [&](const T& before) { return of(before) == of(*at); })) {
      return invalid_argument("{}: {} is given twice", what, of(*at));
    }
  }
  return ok_status();
}

/// A reference must not share samples with the pictures that it measures, because this would hide their error. Other
/// methods with the same seed share the camera's samples.
Status check_references(const Experiment& experiment) {
  for (const LabScene& scene : experiment.scenes) {
    const Reference& reference = scene.reference;
    if (reference.file.empty() && !experiment.methods.empty() &&
        std::ranges::find(experiment.seeds, reference.seed) != experiment.seeds.end()) {
      return invalid_argument("reference: seed {} is also a seed of the experiment: give the reference another",
                              reference.seed);
    }
  }
  return ok_status();
}

}  // namespace

Result<Experiment> parse_experiment(std::string_view text, const fs::path& folder) {
  json document;
  try {
    document = json::parse(text);
  } catch (const json::parse_error& error) {
    const JsonFault fault = json_fault(error.what());
    return invalid_argument("not JSON at {}: {}", fault.place, fault.what);
  }
  LM_RETURN_IF_ERROR(check_keys(document, "experiment",
                                {"title", "scenes", "methods", "seeds", "width", "height", "samples", "errors",
                                 "max_samples", "reference", "others"}));
  Experiment experiment;
  if (document.contains("others")) {
    LM_ASSIGN_OR_RETURN(experiment.others, path_of(document["others"], "others", folder));
  }
  for (const char* needed : {"scenes", "methods"}) {
    if (!document.contains(needed) && (std::string_view(needed) == "scenes" || experiment.others.empty())) {
      return invalid_argument("experiment: \"{}\" is missing", needed);
    }
  }
  if (document.contains("title")) {
    LM_ASSIGN_OR_RETURN(experiment.title, text_of(document["title"], "title"));
  }
  std::optional<Reference> reference;
  if (document.contains("reference")) {
    LM_ASSIGN_OR_RETURN(reference, read_reference(document["reference"], "reference", folder));
  }
  LM_ASSIGN_OR_RETURN(experiment.scenes,
                      list_of<LabScene>(document["scenes"], "scenes", [&](const json& item, const std::string& place) {
                        return read_scene(item, place, folder, reference);
                      }));
  if (document.contains("methods")) {
    LM_ASSIGN_OR_RETURN(experiment.methods, list_of<std::string>(document["methods"], "methods", text_of));
    LM_RETURN_IF_ERROR(read_levels(document, experiment));
  }
  LM_ASSIGN_OR_RETURN(experiment.seeds, read_seeds(document.value("seeds", json(std::uint64_t{1}))));
  if (document.contains("width") != document.contains("height")) {
    return invalid_argument("width and height: give both or none");
  }
  if (document.contains("width")) {
    LM_ASSIGN_OR_RETURN(const std::uint64_t width, whole(document["width"], "width", 1, kMaxSide));
    LM_ASSIGN_OR_RETURN(const std::uint64_t height, whole(document["height"], "height", 1, kMaxSide));
    experiment.width = static_cast<int>(width);
    experiment.height = static_cast<int>(height);
  }
  LM_RETURN_IF_ERROR(check_each_once(experiment.scenes, "scenes", [](const LabScene& scene) { return scene.name; }));
  LM_RETURN_IF_ERROR(check_each_once(experiment.methods, "methods", [](const std::string& name) { return name; }));
  LM_RETURN_IF_ERROR(check_each_once(experiment.seeds, "seeds", [](std::uint64_t seed) { return seed; }));
  LM_RETURN_IF_ERROR(check_references(experiment));
  return experiment;
}

Result<std::vector<OtherPicture>> parse_others(std::string_view text, const fs::path& folder) {
  std::vector<OtherPicture> others;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::string place = fmt::format("line {}", number);
    const json object = json::parse(line, nullptr, false);
    LM_RETURN_IF_ERROR(check_keys(object, place, {"scene", "method", "seed", "samples", "seconds", "wall", "picture"}));
    for (const char* needed : {"scene", "method", "seed", "samples", "seconds", "picture"}) {
      if (!object.contains(needed)) {
        return invalid_argument("{}: \"{}\" is missing", place, needed);
      }
    }
    OtherPicture other;
    LM_ASSIGN_OR_RETURN(other.scene, text_of(object["scene"], place + ".scene"));
    LM_ASSIGN_OR_RETURN(other.method, text_of(object["method"], place + ".method"));
    LM_ASSIGN_OR_RETURN(other.seed, whole(object["seed"], place + ".seed", 0, ~std::uint64_t{0}));
    LM_ASSIGN_OR_RETURN(other.samples, whole(object["samples"], place + ".samples", 1, kMaxLabSamples));
    LM_ASSIGN_OR_RETURN(other.seconds, positive(object["seconds"], place + ".seconds"));
    if (object.contains("wall")) {
      LM_ASSIGN_OR_RETURN(other.wall, positive(object["wall"], place + ".wall"));
    }
    LM_ASSIGN_OR_RETURN(other.file, path_of(object["picture"], place + ".picture", folder));
    others.push_back(std::move(other));
  }
  if (others.empty()) {
    return invalid_argument("it has no picture");
  }
  return others;
}

}  // namespace lightmill::lab
