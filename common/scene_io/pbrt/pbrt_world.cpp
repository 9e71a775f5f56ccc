#include "common/scene_io/pbrt/pbrt_world.h"

#include <algorithm>
#include <numbers>
#include <queue>

#include "common/base/text.h"
#include "common/scene/validate/parts.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/mesh_edits.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxPoweredShapes = 10'000;

/// The area of a triangle after a map.
double mapped_area(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle, const Transform& map) {
  const Point3d a = map_point(map, mesh.positions[triangle[0]]), b = map_point(map, mesh.positions[triangle[1]]),
                c = map_point(map, mesh.positions[triangle[2]]);
  return length(cross(difference(b, a), difference(c, a))) / 2;
}

/// Some triangles of a mesh, each with its own vertices.
Mesh part_of(const Mesh& mesh, std::size_t first, std::size_t count) {
  Mesh out;
  for (std::size_t i = first; i < first + count; ++i) {
    const auto begin = static_cast<std::uint32_t>(out.positions.size());
    for (const std::uint32_t corner : mesh.triangles[i]) {
      out.positions.push_back(mesh.positions[corner]);
      if (!mesh.normals.empty()) {
        out.normals.push_back(mesh.normals[corner]);
      }
      if (!mesh.texture_coordinates.empty()) {
        out.texture_coordinates.push_back(mesh.texture_coordinates[corner]);
      }
    }
    out.triangles.push_back({begin, begin + 1, begin + 2});
  }
  return out;
}

RgbColor brighter(const RgbColor& color, double factor) {
  const auto times = [&](float x) { return static_cast<float>(x * factor); };
  return {times(color.r), times(color.g), times(color.b)};
}

}  // namespace

Status PbrtWorld::set_view(const PbrtOptions& options, const SourcePlace& end) {
  LM_ASSIGN_OR_RETURN(view_, read_pbrt_view(options, end, notices_, loaded_.faults));
  loaded_.scene.camera = view_.camera;
  loaded_.scene.film = view_.film;
  const Status valid = validate(view_.camera);
  return valid.ok() ? ok_status() : end.error("{}", message_of(valid));
}

Status PbrtWorld::begin_object(const std::string& name, const SourcePlace& place) {
  if (object_ != nullptr) {
    return place.error("ObjectBegin: an object cannot be defined within an object");
  }
  const auto [found, added] = objects_.try_emplace(name);
  if (!added) {
    return place.error("ObjectBegin: there are two objects \"{}\"", name);
  }
  object_ = &found->second;
  return ok_status();
}

Status PbrtWorld::end_object(const SourcePlace& place) {
  if (object_ == nullptr) {
    return place.error("ObjectEnd without ObjectBegin");
  }
  object_ = nullptr;
  return ok_status();
}

Status PbrtWorld::add_instance(const std::string& name, const PbrtState& state, const SourcePlace& place_of_instance) {
  const auto found = objects_.find(name);
  if (object_ != nullptr || found == objects_.end()) {
    return place_of_instance.error("ObjectInstance: {}", object_ != nullptr
                                                             ? "it cannot be within an object"
                                                             : fmt::format("there is no object \"{}\"", name));
  }
  // Shapes of the object were mapped to the scene already.
  const Transform to_scene = compose(state.to_scene, view_.world_to_scene);
  for (Piece& piece : found->second) {
    LM_RETURN_IF_ERROR(place(piece, to_scene, place_of_instance));
  }
  return ok_status();
}

bool PbrtWorld::is_plain(const PbrtState& state, const SourcePlace& place) const {
  if (state.named_material.empty()) {
    return materials_.is_plain(state.material);
  }
  const Result<std::size_t> number = materials_.named(state.named_material, place);
  return number.ok() && materials_.is_plain(*number);
}

Status PbrtWorld::add_shape(const std::string& type, const PbrtParameters& from, const PbrtState& state) {
  Piece piece;
  piece.use = {state.material, state.named_material, {},          false, textures_.number(from, "alpha", 1),
               state.inside,   state.outside,        from.place()};
  piece.use.opacity.color.r = std::clamp(piece.use.opacity.color.r, 0.0f, 1.0f);
  const bool plain = is_plain(state, from.place()) && !piece.use.opacity.varies();
  LM_ASSIGN_OR_RETURN(piece.shape, shapes_.read(type, from, plain));
  if (state.light != nullptr && !piece.use.opacity.varies() && piece.use.opacity.color.r == 0) {
    return from.place().error("a light with an alpha of 0, which pbrt renders as an invisible one, cannot be rendered");
  }
  piece.light = state.light;
  piece.reversed = state.reversed;
  if (state.reversed && !piece.shape.ball) {
    reverse_orientation(piece.shape.mesh);
  }
  if (object_ == nullptr) {
    return place(piece, state.to_scene, from.place());
  }
  if (piece.light != nullptr) {
    notices_.left_out("the light of shapes in objects, as in pbrt");
    piece.light = nullptr;
  }
  if (++placed_ > kMaxSceneEntries) {
    return from.place().error("there are more than {} shapes and instances", kMaxSceneEntries);
  }
  piece.shape.to_object = compose(state.to_scene, piece.shape.to_object);
  object_->push_back(std::move(piece));
  return ok_status();
}

Status PbrtWorld::place(Piece& piece, const Transform& to_scene, const SourcePlace& at) {
  if (++placed_ > kMaxSceneEntries) {
    return at.error("there are more than {} shapes and instances", kMaxSceneEntries);
  }
  const Transform all = compose(to_scene, piece.shape.to_object);
  if (!spans_space(all)) {
    notices_.left_out("shapes with a scale of 0");
    return ok_status();
  }
  if (piece.light != nullptr && piece.light->power > 0 && !piece.shape.ball) {
    return place_powered(piece, all, at);
  }
  Use use = piece.use;
  if (piece.light != nullptr) {
    use.emission = piece.light->radiance;
    use.two_sided = piece.light->two_sided;
  }
  if (piece.shape.ball) {
    const std::optional<double> scale = similarity_scale(all);
    const double radius = *piece.shape.ball * scale.value_or(1);
    if (piece.light != nullptr && piece.light->power > 0) {
      if (!scale) {
        return at.error("the power of a distorted sphere cannot be rendered: give its radiance L");
      }
      const double area = 4 * std::numbers::pi * radius * radius;
      use.emission = brighter(use.emission, piece.light->power / (std::numbers::pi * area * (use.two_sided ? 2 : 1)));
    }
    if (scale) {
      return add_object(use, SphereShape{map_point(all, {0, 0, 0}), radius, piece.reversed}, kIdentityTransform, at);
    }
    LM_ASSIGN_OR_RETURN(PbrtShape triangles, shapes_.sphere_of_triangles(*piece.shape.ball, at));
    if (piece.reversed) {
      reverse_orientation(triangles.mesh);
    }
    const Sha256 asset = add_bytes(encode_mesh(triangles.mesh), loaded_);
    return add_object(use, MeshShape{at.text(), asset}, compose(all, triangles.to_object), at);
  }
  if (!piece.asset) {
    piece.asset = add_bytes(encode_mesh(piece.shape.mesh), loaded_);
    piece.shape.mesh = {};
  }
  return add_object(use, MeshShape{piece.use.place.text(), *piece.asset}, all, at);
}

/// pbrt gives the power to each triangle or patch of a mesh, so that small ones are brighter.
Status PbrtWorld::place_powered(const Piece& piece, const Transform& to_scene, const SourcePlace& at) {
  const Mesh& mesh = piece.shape.mesh;
  const std::uint32_t group = piece.shape.triangles_per_shape;
  if (group == 0 || mesh.triangles.size() / group > kMaxPoweredShapes) {
    return at.error("the power of a light on a {} cannot be rendered: give its radiance L",
                    group == 0 ? "plymesh" : "mesh of so many triangles");
  }
  std::vector<double> areas;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (i % group == 0) {
      areas.push_back(0);
    }
    areas.back() += mapped_area(mesh, mesh.triangles[i], to_scene);
  }
  const auto [smallest, largest] = std::ranges::minmax(areas);
  const bool equal = largest - smallest <= 1e-6 * largest;
  for (std::size_t i = 0; i < (equal ? 1 : areas.size()); ++i) {
    if (!(areas[i] > 1e-30)) {
      continue;
    }
    Use use = piece.use;
    use.two_sided = piece.light->two_sided;
    use.emission =
        brighter(piece.light->radiance, piece.light->power / (std::numbers::pi * areas[i] * (use.two_sided ? 2 : 1)));
    const Mesh part = equal ? mesh : part_of(mesh, i * group, group);
    LM_RETURN_IF_ERROR(add_object(use, MeshShape{at.text(), add_bytes(encode_mesh(part), loaded_)}, to_scene, at));
  }
  return ok_status();
}

Status PbrtWorld::add_object(const Use& use, std::variant<MeshShape, SphereShape, PlaneShape, TriangleShape> shape,
                             const Transform& transform, const SourcePlace& at) {
  constexpr double kLargestRadiance = 1e20;
  if (!(std::max({use.emission.r, use.emission.g, use.emission.b}) <= kLargestRadiance)) {
    return at.error("the light's radiance must be at most {}", kLargestRadiance);
  }
  Object object{fmt::format("line {}", use.place.line), use_index(use), std::move(shape), transform};
  if (const Status valid = check_object("shape", object, uses_.size()); !valid.ok()) {
    return at.error("{}", message_of(valid));
  }
  const Status added = lightmill::add_object(std::move(object), loaded_);
  return added.ok() ? ok_status() : at.error("{}", message_of(added));
}

std::uint32_t PbrtWorld::use_index(const Use& use) {
  const auto name = [](const std::string& text) { return fmt::format("{} {}", text.size(), text); };
  const RgbColor& e = use.emission;
  const std::string key =
      fmt::format("{} {} {} {} {} {} {} {} {} {}", use.material, name(use.named_material), e.r, e.g, e.b, use.two_sided,
                  use.opacity.color.r, use.opacity.texture, name(use.inside), name(use.outside));
  const auto [found, added] = use_indices_.try_emplace(key, static_cast<std::uint32_t>(uses_.size()));
  if (added) {
    uses_.push_back(use);
  }
  return found->second;
}

Status PbrtWorld::add_light(const std::string& type, const PbrtParameters& from, const PbrtState& state) {
  if (loaded_.scene.lights.size() == kMaxSceneEntries) {
    return from.place().error("there are more than {} lights", kMaxSceneEntries);
  }
  LM_ASSIGN_OR_RETURN(Light light,
                      read_pbrt_light(type, from, state.to_scene, spectra_, view_.exposure, files_, loaded_));
  loaded_.scene.lights.push_back(std::move(light));
  return ok_status();
}

Result<std::shared_ptr<const PbrtAreaLight>> PbrtWorld::area_light(const std::string& type,
                                                                   const PbrtParameters& from) {
  LM_ASSIGN_OR_RETURN(const std::optional<PbrtAreaLight> light,
                      read_pbrt_area_light(type, from, spectra_, view_.exposure, loaded_.faults));
  return light ? std::make_shared<const PbrtAreaLight>(*light) : nullptr;
}

Result<std::size_t> PbrtWorld::number_of(const Use& use) const {
  return use.named_material.empty() ? Result<std::size_t>(use.material)
                                    : materials_.named(use.named_material, use.place);
}

Result<Material> PbrtWorld::material_of(const Use& use) {
  LM_ASSIGN_OR_RETURN(const std::size_t number, number_of(use));
  LM_ASSIGN_OR_RETURN(Material out, materials_.convert(number));
  out.emission = use.emission;
  out.two_sided_emission = use.two_sided;
  const bool visible = use.opacity.varies() || use.opacity.color.r < 1;
  if (is_boundary(out)) {
    if (visible) {
      return use.place.error("alpha of glass, interfaces and subsurface materials cannot be rendered");
    }
    if (!is_black(use.emission) && materials_.is_interface(number)) {
      return use.place.error("a light on an interface cannot be rendered");
    }
    LM_ASSIGN_OR_RETURN(const Medium inside, media_.find(use.inside, use.place));
    if (out.interior == Medium{}) {  // a subsurface material has its own
      out.interior = inside;
    }
  } else if (visible) {
    if (out.opacity.mode != Opacity::Mode::opaque) {
      return use.place.error("alpha of a transparent material cannot be rendered");
    }
    out.opacity = {Opacity::Mode::blend, use.opacity.color.r, {use.opacity.texture}};
  }
  return out;
}

Status PbrtWorld::set_priorities() {
  const auto boundary = [&](std::size_t i) { return is_boundary(loaded_.scene.materials[i]); };
  std::map<std::string, std::vector<std::size_t>> within;  ///< surfaces with a medium inside, by the medium around them
  for (std::size_t i = 0; i < uses_.size(); ++i) {
    if (boundary(i) && !uses_[i].inside.empty()) {
      within[uses_[i].outside].push_back(i);
    }
  }
  // The number of media around each, by the names of the media. The surfaces are gone through in the order of the file,
  // again and again. The first one that bounds a medium, and whose outside is known, decides.
  std::map<std::string, std::int32_t> depths{{"", 0}};
  using Turn = std::pair<std::size_t, std::size_t>;  // a round, and a surface
  std::priority_queue<Turn, std::vector<Turn>, std::greater<>> turns;
  const auto add_turns = [&](const std::string& around, Turn now) {
    for (const std::size_t i : within[around]) {
      turns.push({now.first + (i < now.second ? 1 : 0), i});
    }
  };
  for (add_turns("", {0, 0}); !turns.empty();) {
    const Turn turn = turns.top();
    turns.pop();
    const Use& use = uses_[turn.second];
    if (depths.try_emplace(use.inside, depths.at(use.outside) + 1).second) {
      add_turns(use.inside, turn);
    }
  }
  for (std::size_t i = 0; i < uses_.size(); ++i) {
    if (!boundary(i)) {
      continue;
    }
    const auto around = depths.find(uses_[i].outside);
    if (around == depths.end()) {
      return uses_[i].place.error("no surface bounds the medium \"{}\" outside of this one", uses_[i].outside);
    }
    loaded_.scene.materials[i].priority = around->second;
  }
  return ok_status();
}

/// A scene can have only one environment. Those of one colour add up.
Status PbrtWorld::merge_skies(const SourcePlace& place_of_scene) {
  std::vector<Light> lights;
  EnvironmentLight* sky = nullptr;
  lights.reserve(loaded_.scene.lights.size());
  for (Light& light : loaded_.scene.lights) {
    const auto* next = std::get_if<EnvironmentLight>(&light.kind);
    if (next != nullptr && sky != nullptr) {
      if (next->has_image || sky->has_image) {
        return place_of_scene.error(
            "the light \"{}\": a scene whose infinite light has an image can have no other infinite light", light.name);
      }
      sky->radiance = {sky->radiance.r + next->radiance.r, sky->radiance.g + next->radiance.g,
                       sky->radiance.b + next->radiance.b};
      continue;
    }
    lights.push_back(std::move(light));
    sky = next == nullptr ? sky : std::get_if<EnvironmentLight>(&lights.back().kind);
  }
  loaded_.scene.lights = std::move(lights);
  return ok_status();
}

Result<LoadedScene> PbrtWorld::finish(const SourcePlace& place_of_scene) {
  std::set<std::string> names;
  std::map<std::string, int> copies;  ///< materials of one name in the file
  for (const Use& use : uses_) {
    LM_ASSIGN_OR_RETURN(Material material, material_of(use));
    const std::string name = scene_name(material.name);
    material.name = name;
    for (int& copy = copies.try_emplace(name, 1).first->second; !names.insert(material.name).second;) {
      material.name = fmt::format("{} ({})", name, ++copy);
    }
    if (const Status valid = check_material("material", material); !valid.ok()) {
      return use.place.error("{}", message_of(valid));
    }
    loaded_.scene.materials.push_back(std::move(material));
  }
  LM_RETURN_IF_ERROR(set_priorities());
  std::erase_if(loaded_.scene.objects, [&](const Object& object) {
    const Material& material = loaded_.scene.materials[object.material];
    const auto* glass = std::get_if<DielectricMaterial>(&material.kind);
    // An interface with the same medium on both sides.
    return glass != nullptr && glass->ior == 1 && material.interior == Medium{} && material.priority == 0;
  });
  if (loaded_.scene.objects.empty()) {
    return place_of_scene.error("the scene has no shapes");
  }
  LM_RETURN_IF_ERROR(merge_skies(place_of_scene));
  return std::move(loaded_);
}

}  // namespace lightmill
