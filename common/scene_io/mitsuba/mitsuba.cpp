#include "common/scene_io/mitsuba/mitsuba.h"

#include <algorithm>
#include <set>

#include "common/base/text.h"
#include "common/scene/validate/parts.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/missing_parts.h"
#include "common/scene_io/mitsuba/mitsuba_lights.h"
#include "common/scene_io/mitsuba/mitsuba_materials.h"
#include "common/scene_io/mitsuba/mitsuba_shapes.h"
#include "common/scene_io/mitsuba/mitsuba_view.h"
#include "common/scene_io/mitsuba/mitsuba_xml.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

bool uses_texture(const Material& material) {
  const auto textured = [](const TexturedColor* color) { return color->texture != kNoTexture; };
  return std::ranges::any_of(colors_of(material), textured) || has_maps(material) ||
         material.opacity.map.texture != kNoTexture || has_mapped_normals(material) || is_anisotropic(material);
}

/// Converter of a scene's objects.
class MitsubaWorld {
 public:
  explicit MitsubaWorld(FileSource& files)
      : files_(files),
        notices_(loaded_.notices),
        textures_(files_, loaded_),
        materials_(textures_, notices_, loaded_.faults),
        shapes_(files_, loaded_, notices_) {}

  Result<LoadedScene> convert(const MitsubaObject& scene);

 private:
  /// A shape with its material.
  struct Piece {
    const MitsubaObject* object = nullptr;
    MitsubaShape shape;
    std::uint32_t material = 0;
  };

  Status set_views(const MitsubaObject& scene);
  Status say_integrator(const MitsubaObject& scene);
  void say_options(const MitsubaObject& integrator);
  Status add_lights(const std::vector<const MitsubaObject*>& emitters);
  Status add_shape(const MitsubaObject& from);
  Status add_instance(const MitsubaObject& from);
  /// The shapes of a group, each read once.
  Result<const std::vector<Piece>*> group(const MitsubaObject& from);
  /// Nothing if the shape cannot be seen.
  Result<std::optional<Piece>> piece_of(const MitsubaObject& from, bool in_group);
  Result<Material> material_of(const MitsubaObject& from, bool in_group, bool& visible, bool& one_sided);
  Status count_piece(const MitsubaObject& at);
  Result<std::uint32_t> material_index(Material material, const MitsubaObject& from);
  Status place(const Piece& piece, const Transform& to_scene, const MitsubaObject& at);

  FileSource& files_;
  LoadedScene loaded_;
  Notices notices_;
  MitsubaTextures textures_;
  MitsubaMaterials materials_;
  MitsubaShapes shapes_;
  std::map<const MitsubaObject*, std::vector<Piece>> groups_;
  std::map<const MitsubaObject*, TexturedColor> emissions_;  ///< of emitters on shapes
  std::size_t placed_ = 0;                                   ///< pieces of groups, shapes and instances
  std::map<std::string, std::uint32_t> material_indices_;    ///< by all of a material
  std::set<std::string> names_;                              ///< of materials
  std::map<std::string, int> copies_;                        ///< materials of one name in the file
};

Result<LoadedScene> MitsubaWorld::convert(const MitsubaObject& scene) {
  LM_RETURN_IF_ERROR(set_views(scene));
  LM_RETURN_IF_ERROR(say_integrator(scene));
  LM_RETURN_IF_ERROR(add_lights(scene.nested("emitter")));
  for (const MitsubaObject* shape : scene.nested("shape")) {
    LM_RETURN_IF_ERROR(add_shape(*shape));
  }
  // Definitions, which other objects name.
  for (const char* tag : {"bsdf", "texture", "medium", "phase", "film", "sampler", "rfilter"}) {
    scene.nested(tag);
  }
  LM_RETURN_IF_ERROR(scene.finish(loaded_.faults));
  if (loaded_.scene.objects.empty()) {
    return scene.place.error("the scene has no shapes that can be seen");
  }
  if (loaded_.cameras.empty()) {
    add_missing_camera(loaded_);
  }
  return std::move(loaded_);
}

Status MitsubaWorld::set_views(const MitsubaObject& scene) {
  constexpr std::size_t kMaxSensors = 1000;
  for (const MitsubaObject* sensor : scene.nested("sensor")) {
    if (loaded_.cameras.size() == kMaxSensors) {
      return sensor->place.error("there are more than {} sensors", kMaxSensors);
    }
    LM_ASSIGN_OR_RETURN(MitsubaView view, read_mitsuba_view(*sensor, notices_, loaded_.faults));
    if (const Status valid = validate(view.camera.camera); !valid.ok()) {
      return sensor->place.error("{}", message_of(valid));
    }
    if (loaded_.cameras.empty()) {
      loaded_.scene.camera = view.camera.camera;
      loaded_.scene.film = view.film;
    }
    loaded_.cameras.push_back(std::move(view.camera));
  }
  return ok_status();
}

Status MitsubaWorld::say_integrator(const MitsubaObject& scene) {
  const std::vector<const MitsubaObject*> all = scene.nested("integrator");
  if (all.size() > 1) {
    return all[1]->place.error("at most one integrator is possible, got {}", all.size());
  }
  for (const MitsubaObject* integrator : all) {
    notices_.left_out(
        fmt::format("the integrator \"{}\" (the job's method is used)", cut_text(printable(integrator->type), 80)));
    say_options(*integrator);
    for (const MitsubaObject* inner : integrator->nested("integrator")) {  // of a moment or aov integrator
      say_options(*inner);
    }
  }
  return ok_status();
}

void MitsubaWorld::say_options(const MitsubaObject& integrator) {
  if (integrator.boolean("hide_emitters", false)) {
    notices_.left_out("hide_emitters: the camera sees all lights");
  }
  if (const std::int64_t depth = integrator.whole("max_depth", -1, -1, 1'000'000'000); depth >= 0) {
    notices_.left_out(fmt::format("max_depth {} of the integrator (bounces are not limited by it)", depth));
  }
}

Status MitsubaWorld::add_lights(const std::vector<const MitsubaObject*>& emitters) {
  bool environment = false;
  for (const MitsubaObject* emitter : emitters) {
    if (emitter->type == "area" && !emitter->id.empty()) {
      continue;  // for shapes that name it
    }
    if (loaded_.scene.lights.size() == kMaxSceneEntries) {
      return emitter->place.error("there are more than {} lights", kMaxSceneEntries);
    }
    LM_ASSIGN_OR_RETURN(Light light, read_mitsuba_light(*emitter, textures_, files_, loaded_, notices_));
    const bool surrounds = std::holds_alternative<EnvironmentLight>(light.kind);
    if (surrounds && environment) {
      return emitter->place.error("a scene can have only one constant or envmap emitter");
    }
    environment = environment || surrounds;
    if (const Status valid = check_lights({light}); !valid.ok()) {
      return emitter->place.error("{}", message_of(valid));
    }
    loaded_.scene.lights.push_back(std::move(light));
  }
  return ok_status();
}

Status MitsubaWorld::add_shape(const MitsubaObject& from) {
  if (from.type == "shapegroup") {
    return group(from).status();
  }
  if (from.type == "instance") {
    return add_instance(from);
  }
  LM_ASSIGN_OR_RETURN(const std::optional<Piece> piece, piece_of(from, false));
  return piece ? place(*piece, kIdentityTransform, from) : ok_status();
}

Result<const std::vector<MitsubaWorld::Piece>*> MitsubaWorld::group(const MitsubaObject& from) {
  const auto [found, added] = groups_.try_emplace(&from);
  if (!added) {
    return &found->second;
  }
  std::vector<Piece> pieces;
  for (const MitsubaObject* shape : from.nested("shape")) {
    LM_ASSIGN_OR_RETURN(std::optional<Piece> piece, piece_of(*shape, true));
    LM_RETURN_IF_ERROR(count_piece(*shape));
    if (piece) {
      pieces.push_back(*std::move(piece));
    }
  }
  LM_RETURN_IF_ERROR(from.finish(loaded_.faults));
  found->second = std::move(pieces);
  return &found->second;
}

Status MitsubaWorld::add_instance(const MitsubaObject& from) {
  const std::vector<const MitsubaObject*> groups = from.nested("shape");
  if (groups.size() != 1 || groups[0]->type != "shapegroup") {
    return from.place.error("{}: one shapegroup is expected", from.what());
  }
  const Transform to_scene = from.transform("to_world");
  LM_RETURN_IF_ERROR(from.finish(loaded_.faults));
  LM_ASSIGN_OR_RETURN(const std::vector<Piece>* pieces, group(*groups[0]));
  for (const Piece& piece : *pieces) {
    LM_RETURN_IF_ERROR(place(piece, to_scene, from));
  }
  return ok_status();
}

Result<Material> MitsubaWorld::material_of(const MitsubaObject& from, bool in_group, bool& visible, bool& one_sided) {
  const std::vector<const MitsubaObject*> bsdfs = from.nested("bsdf"), emitters = from.nested("emitter");
  if (bsdfs.size() > 1 || emitters.size() > 1) {
    return from.place.error("{}: at most one bsdf and one emitter are possible, got {} and {}", from.what(),
                            bsdfs.size(), emitters.size());
  }
  MitsubaSurface surface;
  if (!bsdfs.empty()) {
    LM_ASSIGN_OR_RETURN(surface, materials_.convert(*bsdfs[0]));
  } else {
    surface.one_sided = emitters.empty();
    surface.material.name = emitters.empty() ? "default" : from.label();
    surface.material.kind = emitters.empty() ? DiffuseMaterial{} : DiffuseMaterial{{0, 0, 0}};
  }
  Material& out = surface.material;
  for (const MitsubaObject* emitter : emitters) {
    if (emitter->type != "area") {
      return emitter->place.error("emitters of the type \"{}\" cannot be rendered on a shape", emitter->type);
    }
    const auto [known, added] = emissions_.try_emplace(emitter);
    if (added) {
      known->second = textures_.light(*emitter, "radiance");
      LM_RETURN_IF_ERROR(emitter->finish(loaded_.faults));
    }
    out.emission = known->second;
    if (in_group) {
      return emitter->place.error("a shapegroup cannot have emitters");
    }
  }
  visible = !surface.null;
  if (const MitsubaObject* inside = from.child("interior")) {
    if (!is_boundary(out)) {
      return inside->place.error("only glass and null can bound a medium");
    }
    if (inside->tag != "medium") {
      return inside->place.error("a medium is expected, got {}", inside->what());
    }
    LM_ASSIGN_OR_RETURN(out.interior, materials_.medium(*inside));
    visible = true;
  }
  if (surface.null && !is_black(out.emission)) {
    return from.place.error("{}: a light on null cannot be rendered", from.what());
  }
  one_sided = surface.one_sided && !is_boundary(out);
  return std::move(out);
}

Result<std::optional<MitsubaWorld::Piece>> MitsubaWorld::piece_of(const MitsubaObject& from, bool in_group) {
  bool visible = true, one_sided = false;
  LM_ASSIGN_OR_RETURN(Material material, material_of(from, in_group, visible, one_sided));
  Piece out{&from, {}, 0};
  const bool tangents = material.normal_map.texture != kNoTexture || is_anisotropic(material);
  LM_ASSIGN_OR_RETURN(out.shape, shapes_.read(from, {uses_texture(material), tangents}));
  LM_RETURN_IF_ERROR(from.finish(loaded_.faults));
  if (!visible) {
    return std::optional<Piece>();
  }
  if (one_sided && !out.shape.closed) {
    notices_.once("materials without twosided are the same on both sides. In Mitsuba they are black from behind");
  }
  LM_ASSIGN_OR_RETURN(out.material, material_index(std::move(material), from));
  return std::optional(std::move(out));
}

Result<std::uint32_t> MitsubaWorld::material_index(Material material, const MitsubaObject& from) {
  const std::vector<const MitsubaObject*> bsdfs = from.nested("bsdf");
  const Medium& inside = material.interior;
  const auto text = [](const RgbColor& c) { return fmt::format("{} {} {}", c.r, c.g, c.b); };
  std::string key = fmt::format("{} {} {} {} {} {}", bsdfs.empty() ? "" : fmt::to_string(fmt::ptr(bsdfs[0])),
                                text(material.emission.rgb), material.emission.texture, text(inside.absorption),
                                text(inside.scattering), inside.anisotropy);
  if (bsdfs.empty()) {
    key += std::holds_alternative<DiffuseMaterial>(material.kind) &&
                   is_black(std::get<DiffuseMaterial>(material.kind).reflectance)
               ? " black"
               : " default";
  }
  const auto [found, added] =
      material_indices_.try_emplace(std::move(key), static_cast<std::uint32_t>(loaded_.scene.materials.size()));
  if (!added) {
    return found->second;
  }
  const std::string name = scene_name(material.name);
  material.name = name;
  for (int& copy = copies_.try_emplace(name, 1).first->second; !names_.insert(material.name).second;) {
    material.name = fmt::format("{} ({})", name, ++copy);
  }
  if (const Status valid = check_material("material", material); !valid.ok()) {
    return from.place.error("{}", message_of(valid));
  }
  loaded_.scene.materials.push_back(std::move(material));
  return found->second;
}

Status MitsubaWorld::count_piece(const MitsubaObject& at) {
  return ++placed_ <= kMaxSceneEntries
             ? ok_status()
             : at.place.error("there are more than {} shapes and instances", kMaxSceneEntries);
}

Status MitsubaWorld::place(const Piece& piece, const Transform& to_scene, const MitsubaObject& at) {
  LM_RETURN_IF_ERROR(count_piece(at));
  const Transform all = compose(to_scene, piece.shape.to_world);
  if (!spans_space(all)) {
    notices_.left_out("shapes with a scale of 0");
    return ok_status();
  }
  Object object{scene_name(piece.object->label()), piece.material, MeshShape{}, kIdentityTransform};
  if (piece.shape.ball) {
    const std::optional<double> radius = similarity_scale(all);
    if (!radius) {
      return at.place.error("{}: a sphere can be moved, turned and scaled, but not distorted", at.what());
    }
    object.shape = SphereShape{map_point(all, {0, 0, 0}), *radius, piece.shape.inward};
  } else {
    object.shape = MeshShape{piece.object->place.text(), piece.shape.mesh};
    object.transform = all;
  }
  if (const Status valid = check_object("shape", object, loaded_.scene.materials.size()); !valid.ok()) {
    return at.place.error("{}", message_of(valid));
  }
  const Status added = add_object(std::move(object), loaded_);
  return added.ok() ? ok_status() : at.place.error("{}", message_of(added));
}

}  // namespace

Result<LoadedScene> read_mitsuba(std::string text, const std::string& file_name, FileSource files) {
  constexpr std::uint64_t kMaxReadBytes = std::uint64_t{16} << 30;  // of files, each time that the scene names one
  FileSource limited = at_most(kMaxReadBytes, std::move(files));
  LM_ASSIGN_OR_RETURN(const MitsubaDocument document, read_mitsuba_xml(std::move(text), file_name, limited));
  FileSource found = [&](const std::string& name) { return find_mitsuba_file(limited, document.folders, name); };
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, MitsubaWorld(found).convert(document.objects.front()));
  LM_RETURN_IF_ERROR(with_context(validate(loaded.scene), file_name));
  return loaded;
}

}  // namespace lightmill
