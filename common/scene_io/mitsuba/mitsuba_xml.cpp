#include "common/scene_io/mitsuba/mitsuba_xml.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <pugixml.hpp>
#include <set>

#include "common/base/text.h"
#include "common/scene_io/mitsuba/mitsuba_values.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxNestedElements = 50, kMaxIncludesDeep = 15, kMaxIncludes = 10'000, kMaxFolders = 20;
constexpr std::size_t kMaxXmlBytes = std::size_t{64} << 20, kMaxTextBytes = std::size_t{256} << 20;
constexpr std::size_t kMaxTags = 4'000'000, kMaxParts = 100;

const std::set<std::string_view> kObjects{"bsdf",    "emitter", "film",   "integrator", "medium",  "phase",
                                          "rfilter", "sampler", "sensor", "shape",      "texture", "volume"};
const std::set<std::string_view> kParameters{"boolean", "float",  "integer", "point",
                                             "rgb",     "string", "vector",  "spectrum"};

/// "toWorld" as "to_world", and "intIOR" as "int_ior".
std::string with_underscores(std::string_view name) {
  const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (i > 0 && is_capital(name[i]) && !is_capital(name[i - 1])) {
      out += '_';
    }
    out += is_capital(name[i]) ? static_cast<char>(name[i] - 'A' + 'a') : name[i];
  }
  return out;
}

class XmlReader {
 public:
  explicit XmlReader(FileSource& files) : files_(files) {}

  Result<MitsubaDocument> read(std::string text, const std::string& name) {
    LM_RETURN_IF_ERROR(read_file(std::move(text), name, nullptr, {}));
    for (MitsubaObject& object : out_.objects) {
      for (MitsubaChild& child : object.children) {
        if (child.object == nullptr) {
          const auto found = ids_.find(child.id);
          if (found == ids_.end()) {
            return child.place.error("there is no object with the id \"{}\"", child.id);
          }
          child.object = found->second;
        }
      }
    }
    return std::move(out_);
  }

 private:
  struct File {
    const std::string* name;
    std::string folder;
    std::vector<std::uint32_t> lines;  ///< offsets of line feeds
    bool old = false;                  ///< before version 2

    SourcePlace place(std::ptrdiff_t offset) const {
      const auto before =
          std::ranges::lower_bound(lines, static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(offset, 0)));
      return {name, static_cast<int>(before - lines.begin()) + 1};
    }
    SourcePlace place(const pugi::xml_node& node) const { return place(node.offset_debug()); }
  };

  Status read_file(std::string text, const std::string& name, MitsubaObject* parent, const std::string& child_name) {
    out_.names.push_back(utf8_text(name));
    File file;
    file.name = &out_.names.back();
    const std::size_t slash = name.rfind('/');
    file.folder = slash == std::string::npos || parent == nullptr ? "" : name.substr(0, slash + 1);
    const SourcePlace top{file.name, 1};
    bytes_ += text.size();
    if (text.size() > kMaxXmlBytes || bytes_ > kMaxTextBytes) {
      return top.error("at most {} MiB a file and {} MiB in all can be read", kMaxXmlBytes >> 20, kMaxTextBytes >> 20);
    }
    for (std::size_t at = 0; at < text.size(); ++at) {
      if (text[at] == '\n') {
        file.lines.push_back(static_cast<std::uint32_t>(at));
      }
      tags_ += text[at] == '<' ? 1 : 0;
    }
    if (tags_ > kMaxTags) {
      return top.error("at most {} tags in all can be read", kMaxTags);
    }
    pugi::xml_document document;
    const pugi::xml_parse_result parsed =
        document.load_buffer_inplace(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!parsed) {
      return file.place(parsed.offset).error("the XML cannot be read: {}", parsed.description());
    }
    pugi::xml_node root = document.document_element();
    const std::string version = root.attribute("version").value();
    if (version.empty()) {
      return file.place(root).error("<{}> has no version", root.name());
    }
    file.old = version[0] == '0' || version.starts_with("1.");
    if (std::string_view(root.name()) == "scene") {
      if (parent == nullptr) {
        parent = &out_.objects.emplace_back();
        parent->tag = "scene";
        parent->place = file.place(root);
      }
      return read_children(root, file, *parent);
    }
    if (parent == nullptr) {
      return file.place(root).error("<scene> is expected, got <{}>", root.name());
    }
    root.remove_attribute("version");
    if (!child_name.empty() && !root.attribute("name")) {
      root.append_attribute("name") = child_name.c_str();
    }
    return read_element(root, file, *parent);
  }

  Status read_children(const pugi::xml_node& node, const File& file, MitsubaObject& object) {
    if (++nesting_ > kMaxNestedElements) {
      return file.place(node).error("elements are nested more than {} deep", kMaxNestedElements);
    }
    for (const pugi::xml_node& child : node.children()) {
      if (child.type() == pugi::node_element) {
        LM_RETURN_IF_ERROR(read_element(child, file, object));
      } else if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) {
        return file.place(node).error("<{}> has text between its tags", node.name());
      }
    }
    --nesting_;
    return ok_status();
  }

  /// An attribute whose name begins with ! must be there.
  Result<MitsubaAttributes> attributes(const pugi::xml_node& node, const SourcePlace& place,
                                       std::initializer_list<std::string_view> known) {
    MitsubaAttributes out;
    for (const pugi::xml_attribute& attribute : node.attributes()) {
      const std::string_view name = attribute.name();
      const auto found = std::ranges::find_if(
          known, [&](std::string_view one) { return one == name || (one.starts_with('!') && one.substr(1) == name); });
      if (found == known.end()) {
        return place.error("<{}>: unknown attribute \"{}\"", node.name(), name);
      }
      LM_ASSIGN_OR_RETURN(std::string value, defaults_.substitute(attribute.value(), place));
      const std::string_view key = found->starts_with('!') ? found->substr(1) : *found;
      if (!out.emplace(key, std::move(value)).second) {
        return place.error("<{}>: the attribute \"{}\" is given twice", node.name(), name);
      }
    }
    for (const std::string_view one : known) {
      if (one.starts_with('!') && !out.contains(one.substr(1))) {
        return place.error("<{}>: the attribute \"{}\" is missing", node.name(), one.substr(1));
      }
    }
    return out;
  }

  Status read_element(const pugi::xml_node& node, const File& file, MitsubaObject& parent) {
    const std::string_view tag = node.name();
    const SourcePlace place = file.place(node);
    if (kObjects.contains(tag) || (tag == "spectrum" && node.attribute("type"))) {
      return read_object(node, file, parent);
    }
    if (tag == "transform") {
      return read_transform(node, file, parent);
    }
    if (node.first_child()) {
      return file.place(node).error("<{}> cannot have content", tag);
    }
    if (kParameters.contains(tag)) {
      return read_parameter(node, file, parent);
    }
    if (tag == "ref") {
      LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, place, {"!id", "name"}));
      return add({later_name(value_of(given, "name"), file), place, value_of(given, "id")}, parent);
    }
    if (tag == "default") {
      LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, place, {"!name", "!value"}));
      return defaults_.add(value_of(given, "name"), value_of(given, "value"), place);
    }
    if (tag == "alias") {
      LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, place, {"!id", "!as"}));
      const auto found = ids_.find(value_of(given, "id"));
      return found == ids_.end()
                 ? place.error("there is no object with the id \"{}\" before this line", value_of(given, "id"))
                 : add_id(value_of(given, "as"), *found->second, place);
    }
    if (tag == "include") {
      return include(node, file, parent);
    }
    if (tag == "path" && parent.tag == "scene") {
      LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, place, {"!value"}));
      const std::string value = value_of(given, "value");
      if (out_.folders.size() == kMaxFolders || value.size() > UploadedFiles::kMaxPathBytes) {
        return place.error("at most {} paths can be read, of {} bytes each", kMaxFolders, UploadedFiles::kMaxPathBytes);
      }
      out_.folders.insert(out_.folders.begin(), (value.starts_with('/') ? "" : file.folder) + value + "/");
      return ok_status();
    }
    return place.error("<{}> cannot be read here", tag);
  }

  std::string later_name(const std::string& name, const File& file) const {
    return file.old ? with_underscores(name) : name;
  }

  Status add_id(const std::string& id, const MitsubaObject& object, const SourcePlace& place) {
    return ids_.emplace(id, &object).second ? ok_status() : place.error("there are two objects with the id \"{}\"", id);
  }

  Status read_object(const pugi::xml_node& node, const File& file, MitsubaObject& parent) {
    const SourcePlace place = file.place(node);
    LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, place, {"!type", "id", "name"}));
    MitsubaObject& object = out_.objects.emplace_back();
    object.tag = std::string_view(node.name()) == "spectrum" ? "texture" : node.name();
    object.type = value_of(given, "type");
    object.id = value_of(given, "id");
    object.place = place;
    if (!object.id.empty()) {
      LM_RETURN_IF_ERROR(add_id(object.id, object, place));
    }
    LM_RETURN_IF_ERROR(add({later_name(value_of(given, "name"), file), place, object.id, &object}, parent));
    return read_children(node, file, object);
  }

  Status add(MitsubaChild child, MitsubaObject& parent) {
    const bool may_have_many = parent.tag == "scene" || parent.type == "shapegroup";
    if (parent.children.size() == kMaxParts && !may_have_many) {
      return child.place.error("{}: at most {} nested objects are expected", parent.what(), kMaxParts);
    }
    parent.children.push_back(std::move(child));
    return ok_status();
  }

  Status add(MitsubaParameter parameter, const File& file, MitsubaObject& parent) {
    if (file.old) {
      parameter.name = with_underscores(parameter.name);
      if (parent.type == "diffuse" && parameter.name == "diffuse_reflectance") {
        parameter.name = "reflectance";
      }
    }
    if (parent.parameters.size() == kMaxParts) {
      return parameter.place.error("{}: at most {} parameters are expected", parent.what(), kMaxParts);
    }
    if (parent.has(parameter.name)) {
      return parameter.place.error("{}: the parameter \"{}\" is given twice", parent.what(), parameter.name);
    }
    parent.parameters.push_back(std::move(parameter));
    return ok_status();
  }

  Status read_parameter(const pugi::xml_node& node, const File& file, MitsubaObject& parent) {
    MitsubaParameter out{node.name(), {}, file.place(node)};
    const bool three = out.type == "point" || out.type == "vector";
    LM_ASSIGN_OR_RETURN(const MitsubaAttributes given,
                        three                    ? attributes(node, out.place, {"!name", "value", "x", "y", "z"})
                        : out.type == "spectrum" ? attributes(node, out.place, {"!name", "value", "filename"})
                                                 : attributes(node, out.place, {"!name", "!value"}));
    out.name = value_of(given, "name");
    LM_RETURN_IF_ERROR(read_mitsuba_value(given, out));
    return add(std::move(out), file, parent);
  }

  Status read_transform(const pugi::xml_node& node, const File& file, MitsubaObject& parent) {
    MitsubaParameter out{"transform", {}, file.place(node)};
    LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, out.place, {"!name"}));
    out.name = value_of(given, "name");
    for (const pugi::xml_node& child : node.children()) {
      const SourcePlace place = file.place(child.type() == pugi::node_element ? child : node);
      if (child.type() != pugi::node_element || child.first_child()) {
        return place.error("<{}> cannot have content", node.name());
      }
      LM_ASSIGN_OR_RETURN(const MitsubaAttributes step,
                          attributes(child, place, {"value", "x", "y", "z", "angle", "origin", "target", "up"}));
      LM_ASSIGN_OR_RETURN(const Transform next, read_mitsuba_transform(child.name(), step, place));
      out.transform = compose(next, out.transform);
    }
    const auto small = [](const auto& row) {
      return std::ranges::all_of(row, [](double value) { return std::abs(value) <= 1e30; });
    };
    if (!std::ranges::all_of(out.transform, small)) {
      return out.place.error("the transform has numbers beyond 1e30");
    }
    return add(std::move(out), file, parent);
  }

  Status include(const pugi::xml_node& node, const File& file, MitsubaObject& parent) {
    const SourcePlace place = file.place(node);
    LM_ASSIGN_OR_RETURN(const MitsubaAttributes given, attributes(node, place, {"!filename", "name"}));
    const std::string name = value_of(given, "filename");
    if (open_files_ == kMaxIncludesDeep || out_.names.size() == kMaxIncludes) {
      return place.error("at most {} files can be included, {} deep", kMaxIncludes, kMaxIncludesDeep);
    }
    MitsubaFolders folders = out_.folders;
    folders.insert(folders.begin(), file.folder);
    Result<SourceFile> found = find_mitsuba_file(files_, folders, name);
    if (!found.ok()) {
      return place.error("{}", message_of(found.status()));
    }
    ++open_files_;
    LM_RETURN_IF_ERROR(read_file(std::move(found->bytes), found->name, &parent, value_of(given, "name")));
    --open_files_;
    return ok_status();
  }

  FileSource& files_;
  MitsubaDocument out_;
  MitsubaDefaults defaults_;
  std::map<std::string, const MitsubaObject*> ids_;
  std::size_t nesting_ = 0, open_files_ = 0, tags_ = 0, bytes_ = 0;
};

}  // namespace

Result<SourceFile> find_mitsuba_file(FileSource& files, const MitsubaFolders& folders, const std::string& name) {
  if (name.size() > UploadedFiles::kMaxPathBytes) {
    return invalid_argument("the name of a file has more than {} bytes", UploadedFiles::kMaxPathBytes);
  }
  for (const std::string& folder : folders) {
    Result<SourceFile> found = files(name.starts_with('/') ? name : folder + name);
    if (found.ok() || found.status().code() != StatusCode::kNotFound) {
      return found;
    }
  }
  return files(name);
}

Result<MitsubaDocument> read_mitsuba_xml(std::string text, const std::string& file_name, FileSource& files) {
  return XmlReader(files).read(std::move(text), file_name);
}

}  // namespace lightmill
