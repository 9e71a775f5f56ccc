#include "common/scene_io/pbrt/pbrt.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "common/base/text.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/gzip.h"
#include "common/scene_io/pbrt/pbrt_world.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxNestedFiles = 50, kMaxFiles = 10'000, kMaxStates = 1000, kMaxAttributes = 1000;
constexpr std::size_t kMaxAttributeValues = 1000;             ///< each directive reads them again
constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 30;  ///< of the files that a scene names, each time it does
constexpr std::uint64_t kMaxUnpackedBytes = std::uint64_t{4} << 30;  ///< of those of them that are compressed

class PbrtReader {
 public:
  explicit PbrtReader(FileSource files) : world_(at_most(kMaxBytes, unpacked(kMaxUnpackedBytes, std::move(files)))) {}

  Result<LoadedScene> read(std::string text, const std::string& file_name) {
    LM_RETURN_IF_ERROR(read_file(std::move(text), file_name));
    const SourcePlace end{&names_.front(), 1};
    if (!in_world_) {
      return end.error("the scene has no WorldBegin");
    }
    return states_.empty() ? world_.finish(end)
                           : states_.back().place.error("{} without its end", states_.back().directive());
  }

 private:
  using Handler = Status (PbrtReader::*)(PbrtTokens&, const SourcePlace&);
  enum class Where { options, world, anywhere };
  struct Directive {
    Where where;
    Handler handler;
  };
  struct Saved {
    PbrtState state;
    bool object;
    SourcePlace place;
    std::string_view directive() const { return object ? "ObjectBegin" : "AttributeBegin"; }
  };

  static const std::map<std::string_view, Directive>& directives();

  Status read_file(std::string text, std::string name) {
    names_.push_back(utf8_text(name));
    PbrtTokens tokens(std::move(text), names_.back());
    ++nesting_;
    while (const std::optional<PbrtToken> token = tokens.next()) {
      const SourcePlace place = tokens.place_of(*token);
      const auto found = directives().find(token->quoted ? "" : token->text);
      if (found == directives().end()) {
        return place.error("unknown directive {}", token->text);
      }
      const auto& [where, handler] = found->second;
      if (where != Where::anywhere && (where == Where::world) != in_world_) {
        return place.error("{} must be {} WorldBegin", found->first, in_world_ ? "before" : "after");
      }
      LM_RETURN_IF_ERROR((this->*handler)(tokens, place));
    }
    --nesting_;
    return tokens.status();
  }

  Status include(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a file's name", PbrtTokens::kMaxFileNameBytes));
    if (nesting_ == kMaxNestedFiles || names_.size() == kMaxFiles) {
      return place.error("at most {} files can be included, {} deep", kMaxFiles, kMaxNestedFiles);
    }
    Result<SourceFile> file = world_.files()(name);
    return file.ok() ? read_file(std::move(file->bytes), file->name) : place.error("{}", message_of(file.status()));
  }

  Status import(PbrtTokens& tokens, const SourcePlace& place) {
    const PbrtState state = state_;
    LM_RETURN_IF_ERROR(include(tokens, place));
    state_ = state;
    return ok_status();
  }

  /// A quoted type, and the parameters that follow it. Later attributes override earlier ones.
  Result<PbrtEntity> entity(PbrtTokens& tokens, const SourcePlace& place, std::string_view directive,
                            const std::string& attributes = "") {
    LM_ASSIGN_OR_RETURN(std::string type, tokens.string(directive));
    LM_ASSIGN_OR_RETURN(PbrtParameterList list, read_pbrt_parameters(tokens));
    if (const auto found = state_.attributes.find(attributes); found != state_.attributes.end()) {
      list.insert(list.end(), found->second.rbegin(), found->second.rend());
    }
    std::string what = fmt::format("{} {}", directive, type);
    return PbrtEntity{std::move(type), PbrtParameters(std::move(list), place, std::move(what))};
  }

  // Transforms.

  Status set_transform(const Transform& transform, const SourcePlace& place) {
    const auto small = [](const auto& row) {
      return std::ranges::all_of(row, [](double value) { return std::abs(value) <= 1e30; });
    };
    if (!std::ranges::all_of(transform, small)) {
      return place.error("the transform has numbers beyond 1e30");
    }
    if (at_end_time_) {
      world_.notices().left_out("motion blur: everything has its position at the time when the shutter opens");
    } else {
      state_.to_scene = transform;
    }
    return ok_status();
  }
  Status append(const Transform& transform, const SourcePlace& place) {
    return set_transform(compose(state_.to_scene, transform), place);
  }
  Result<Transform> matrix(PbrtTokens& tokens, const SourcePlace& place) {
    std::array<double, 16> m{};
    LM_RETURN_IF_ERROR(tokens.numbers(m));
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
      return place.error("the matrix must map points without perspective: its last row must be 0, 0, 0, 1");
    }
    Transform out;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 4; ++column) {
        out[row][column] = m[4 * column + row];
      }
    }
    return out;
  }
  Status identity(PbrtTokens&, const SourcePlace& place) { return set_transform(world_.world_to_scene(), place); }
  Status transform(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const Transform given, matrix(tokens, place));
    return set_transform(compose(world_.world_to_scene(), given), place);
  }
  Status concat_transform(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const Transform given, matrix(tokens, place));
    return append(given, place);
  }
  Status translate(PbrtTokens& tokens, const SourcePlace& place) {
    Point3d by;
    LM_RETURN_IF_ERROR(tokens.numbers(by));
    return append(translation(by), place);
  }
  Status scale(PbrtTokens& tokens, const SourcePlace& place) {
    Point3d by;
    LM_RETURN_IF_ERROR(tokens.numbers(by));
    return append(scaling(by), place);
  }
  Status rotate(PbrtTokens& tokens, const SourcePlace& place) {
    std::array<double, 4> v{};
    LM_RETURN_IF_ERROR(tokens.numbers(v));
    if (!(std::hypot(v[1], v[2], v[3]) > 1e-30)) {
      return place.error("the axis of Rotate must not be zero");
    }
    return append(rotation(v[0], {v[1], v[2], v[3]}), place);
  }
  Status look_at(PbrtTokens& tokens, const SourcePlace& place) {
    std::array<double, 9> v{};
    LM_RETURN_IF_ERROR(tokens.numbers(v));
    const std::optional<Transform> from_camera = looking_at({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]});
    return from_camera ? append(inverse(*from_camera).value(), place)
                       : place.error("LookAt: the points must differ, and up must not be along the view");
  }
  Status coordinate_system(PbrtTokens& tokens, const SourcePlace&) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a name"));
    systems_[name] = state_.to_scene;
    return ok_status();
  }
  Status coord_sys_transform(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a name"));
    const auto found = systems_.find(name);
    return found != systems_.end() ? set_transform(found->second, place)
                                   : place.error("there is no coordinate system \"{}\"", name);
  }
  Status active_transform(PbrtTokens& tokens, const SourcePlace& place) {
    const std::optional<PbrtToken> which = tokens.next();
    if (!which || (which->text != "All" && which->text != "StartTime" && which->text != "EndTime")) {
      return place.error("ActiveTransform: All, StartTime or EndTime is expected");
    }
    at_end_time_ = which->text == "EndTime";
    return ok_status();
  }
  Status transform_times(PbrtTokens& tokens, const SourcePlace&) {
    std::array<double, 2> times{};
    return tokens.numbers(times);
  }
  Status reverse_orientation(PbrtTokens&, const SourcePlace&) {
    state_.reversed = !state_.reversed;
    return ok_status();
  }

  // Options.

  Status camera(PbrtTokens& tokens, const SourcePlace& place) {
    if (!state_.outside.empty()) {
      return place.error("a camera within a medium cannot be rendered");
    }
    LM_ASSIGN_OR_RETURN(options_.camera, entity(tokens, place, "Camera"));
    options_.camera_from_world = state_.to_scene;
    systems_["camera"] = inverse(state_.to_scene).value_or(kIdentityTransform);
    return ok_status();
  }
  Status film(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(options_.film, entity(tokens, place, "Film"));
    return ok_status();
  }
  Status pixel_filter(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(options_.filter, entity(tokens, place, "PixelFilter"));
    return ok_status();
  }
  Status job_setting(PbrtTokens& tokens, const SourcePlace& place) {
    world_.notices().left_out("Sampler, Integrator and Accelerator (the job's samples and method are used)");
    return entity(tokens, place, "a type").status();
  }
  Status option(PbrtTokens& tokens, const SourcePlace&) {
    LM_RETURN_IF_ERROR(tokens.string("a name").status());
    tokens.next();
    world_.notices().left_out("Option directives");
    return tokens.status();
  }
  Status color_space(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a name"));
    return name == "srgb" ? ok_status() : place.error("only the ColorSpace \"srgb\" can be rendered, got \"{}\"", name);
  }
  Status world_begin(PbrtTokens&, const SourcePlace& place) {
    LM_RETURN_IF_ERROR(world_.set_view(options_, place));
    in_world_ = true;
    for (auto& [name, system] : systems_) {
      system = compose(world_.world_to_scene(), system);
    }
    state_.to_scene = world_.world_to_scene();
    at_end_time_ = false;
    systems_["world"] = state_.to_scene;
    return ok_status();
  }

  // The world.

  Status push(bool object, const SourcePlace& place) {
    if (states_.size() == kMaxStates) {
      return place.error("AttributeBegin is nested more than {} deep", kMaxStates);
    }
    states_.push_back({state_, object, place});
    return ok_status();
  }
  Status pop(bool object, const SourcePlace& place) {
    const std::string_view ended = object ? "Object" : "Attribute";
    if (states_.empty()) {
      return place.error("{0}End without {0}Begin", ended);
    }
    if (const Saved& open = states_.back(); open.object != object) {
      return place.error("{}End, but the {} at {} is open", ended, open.directive(), open.place.text());
    }
    state_ = std::move(states_.back().state);
    states_.pop_back();
    at_end_time_ = false;
    return ok_status();
  }
  Status attribute_begin(PbrtTokens&, const SourcePlace& place) { return push(false, place); }
  Status attribute_end(PbrtTokens&, const SourcePlace& place) { return pop(false, place); }
  Status attribute(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string target, tokens.string("a kind of directive"));
    LM_ASSIGN_OR_RETURN(const PbrtParameterList list, read_pbrt_parameters(tokens));
    constexpr std::array<std::string_view, 5> kTargets{"shape", "light", "material", "medium", "texture"};
    if (std::ranges::find(kTargets, target) == kTargets.end()) {
      return place.error("Attribute: shape, light, material, medium or texture is expected, got \"{}\"", target);
    }
    PbrtParameterList& attributes = state_.attributes[target];
    for (const auto& parameter : list) {
      if (std::max(parameter->numbers.size(), parameter->strings.size()) > kMaxAttributeValues) {
        return place.error("Attribute: {} has more than {} values", parameter->name, kMaxAttributeValues);
      }
      auto copy = std::make_shared<PbrtParameter>(*parameter);
      copy->may_be_unused = true;
      attributes.push_back(std::move(copy));
    }
    return attributes.size() <= kMaxAttributes ? ok_status()
                                               : place.error("Attribute: there are more than {}", kMaxAttributes);
  }
  Status object_begin(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a name"));
    LM_RETURN_IF_ERROR(push(true, place));
    return world_.begin_object(name, place);
  }
  Status object_end(PbrtTokens&, const SourcePlace& place) {
    LM_RETURN_IF_ERROR(pop(true, place));
    return world_.end_object(place);
  }
  Status object_instance(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a name"));
    return world_.add_instance(name, state_, place);
  }
  Status shape(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const PbrtEntity from, entity(tokens, place, "Shape", "shape"));
    return world_.add_shape(from.type, from.parameters, state_);
  }
  Status light_source(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const PbrtEntity from, entity(tokens, place, "LightSource", "light"));
    return world_.add_light(from.type, from.parameters, state_);
  }
  Status area_light_source(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const PbrtEntity from, entity(tokens, place, "AreaLightSource", "light"));
    LM_ASSIGN_OR_RETURN(state_.light, world_.area_light(from.type, from.parameters));
    return ok_status();
  }
  Status material(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(PbrtEntity from, entity(tokens, place, "Material", "material"));
    state_.material = world_.materials().define(std::move(from.type), std::move(from.parameters));
    state_.named_material.clear();
    return ok_status();
  }
  Status make_named_material(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(PbrtEntity from, entity(tokens, place, "MakeNamedMaterial", "material"));
    return world_.materials().define_named(from.type, std::move(from.parameters));
  }
  Status named_material(PbrtTokens& tokens, const SourcePlace&) {
    LM_ASSIGN_OR_RETURN(state_.named_material, tokens.string("a material's name"));
    return ok_status();
  }
  Status texture(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const std::string name, tokens.string("a texture's name"));
    LM_ASSIGN_OR_RETURN(const std::string kind, tokens.string("float or spectrum"));
    LM_ASSIGN_OR_RETURN(const PbrtEntity from, entity(tokens, place, "Texture", "texture"));
    return world_.textures().define(name, kind, from.type, from.parameters);
  }
  Status make_named_medium(PbrtTokens& tokens, const SourcePlace& place) {
    LM_ASSIGN_OR_RETURN(const PbrtEntity from, entity(tokens, place, "MakeNamedMedium", "medium"));
    return world_.media().define(from.type, from.parameters);
  }
  Status medium_interface(PbrtTokens& tokens, const SourcePlace&) {
    LM_ASSIGN_OR_RETURN(state_.inside, tokens.string("a medium's name"));
    state_.outside = state_.inside;
    if (tokens.peek() && tokens.peek()->quoted) {
      LM_ASSIGN_OR_RETURN(state_.outside, tokens.string("a medium's name"));
    }
    return tokens.status();
  }

  PbrtWorld world_;
  PbrtOptions options_;
  PbrtState state_;
  std::vector<Saved> states_;
  std::map<std::string, Transform> systems_;
  bool in_world_ = false, at_end_time_ = false;
  std::deque<std::string> names_;  ///< of files, for places
  std::size_t nesting_ = 0;
};

const std::map<std::string_view, PbrtReader::Directive>& PbrtReader::directives() {
  using enum Where;
  static const std::map<std::string_view, Directive> table{
      {"Accelerator", {options, &PbrtReader::job_setting}},
      {"ActiveTransform", {anywhere, &PbrtReader::active_transform}},
      {"AreaLightSource", {world, &PbrtReader::area_light_source}},
      {"Attribute", {anywhere, &PbrtReader::attribute}},
      {"AttributeBegin", {world, &PbrtReader::attribute_begin}},
      {"AttributeEnd", {world, &PbrtReader::attribute_end}},
      {"Camera", {options, &PbrtReader::camera}},
      {"ColorSpace", {anywhere, &PbrtReader::color_space}},
      {"ConcatTransform", {anywhere, &PbrtReader::concat_transform}},
      {"CoordSysTransform", {anywhere, &PbrtReader::coord_sys_transform}},
      {"CoordinateSystem", {anywhere, &PbrtReader::coordinate_system}},
      {"Film", {options, &PbrtReader::film}},
      {"Identity", {anywhere, &PbrtReader::identity}},
      {"Import", {world, &PbrtReader::import}},
      {"Include", {anywhere, &PbrtReader::include}},
      {"Integrator", {options, &PbrtReader::job_setting}},
      {"LightSource", {world, &PbrtReader::light_source}},
      {"LookAt", {anywhere, &PbrtReader::look_at}},
      {"MakeNamedMaterial", {world, &PbrtReader::make_named_material}},
      {"MakeNamedMedium", {anywhere, &PbrtReader::make_named_medium}},
      {"Material", {world, &PbrtReader::material}},
      {"MediumInterface", {anywhere, &PbrtReader::medium_interface}},
      {"NamedMaterial", {world, &PbrtReader::named_material}},
      {"ObjectBegin", {world, &PbrtReader::object_begin}},
      {"ObjectEnd", {world, &PbrtReader::object_end}},
      {"ObjectInstance", {world, &PbrtReader::object_instance}},
      {"Option", {anywhere, &PbrtReader::option}},
      {"PixelFilter", {options, &PbrtReader::pixel_filter}},
      {"ReverseOrientation", {world, &PbrtReader::reverse_orientation}},
      {"Rotate", {anywhere, &PbrtReader::rotate}},
      {"Sampler", {options, &PbrtReader::job_setting}},
      {"Scale", {anywhere, &PbrtReader::scale}},
      {"Shape", {world, &PbrtReader::shape}},
      {"Texture", {world, &PbrtReader::texture}},
      {"Transform", {anywhere, &PbrtReader::transform}},
      {"TransformBegin", {world, &PbrtReader::attribute_begin}},
      {"TransformEnd", {world, &PbrtReader::attribute_end}},
      {"TransformTimes", {anywhere, &PbrtReader::transform_times}},
      {"Translate", {anywhere, &PbrtReader::translate}},
      {"WorldBegin", {options, &PbrtReader::world_begin}}};
  return table;
}

}  // namespace

Result<LoadedScene> read_pbrt(std::string text, const std::string& file_name, FileSource files) {
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, PbrtReader(std::move(files)).read(std::move(text), file_name));
  LM_RETURN_IF_ERROR(with_context(validate(loaded.scene), file_name));
  return loaded;
}

}  // namespace lightmill
