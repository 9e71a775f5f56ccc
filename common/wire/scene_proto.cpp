#include "common/wire/scene_proto.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <cmath>
#include <map>
#include <numbers>

#include "common/base/check.h"
#include "common/scene/validate/validate.h"
#include "common/wire/bytes.h"
#include "common/wire/limits.h"
#include "common/wire/scene_parts.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {
namespace {

// ---- values → messages ----

v1::PixelFilter::Kind to_wire_filter(FilterKind kind) {
  switch (kind) {
    case FilterKind::box:
      return v1::PixelFilter::BOX;
    case FilterKind::tent:
      return v1::PixelFilter::TENT;
    case FilterKind::gaussian:
      return v1::PixelFilter::GAUSSIAN;
    case FilterKind::blackman_harris:
      return v1::PixelFilter::BLACKMAN_HARRIS;
  }
  return v1::PixelFilter::KIND_UNSPECIFIED;
}

// ---- messages → values ----

Result<PixelFilter> filter_from_wire(const v1::PixelFilter& filter) {
  PixelFilter out;
  switch (filter.kind()) {
    case v1::PixelFilter::BOX:
      out = {FilterKind::box, 0.5};
      break;
    case v1::PixelFilter::TENT:
      out = {FilterKind::tent, 1};
      break;
    case v1::PixelFilter::GAUSSIAN:
      out = {FilterKind::gaussian, 1.5};
      break;
    case v1::PixelFilter::KIND_UNSPECIFIED:
    case v1::PixelFilter::BLACKMAN_HARRIS:
      out = {FilterKind::blackman_harris, 1.5};
      break;
    default:
      return invalid_argument("film.filter.kind: unknown value {}", static_cast<int>(filter.kind()));
  }
  if (filter.has_radius_pixels()) {
    out.radius_pixels = filter.radius_pixels();
  }
  return out;
}

Result<FilmSettings> film_from_wire(const v1::FilmSettings& film) {
  FilmSettings out;
  if (film.has_width()) {
    out.width = film.width();
  }
  if (film.has_height()) {
    out.height = film.height();
  }
  LM_ASSIGN_OR_RETURN(out.filter, filter_from_wire(film.filter()));
  return out;
}

/// The parts of a mixture, or 1.
std::size_t count_parts(const v1::Material& material) {
  return material.has_mixture() ? count_parts(material.mixture().first()) + count_parts(material.mixture().second())
                                : 1;
}

Status check_counts(const v1::Scene& scene) {
  std::size_t materials = 0;
  for (const v1::Material& material : scene.materials()) {
    materials += count_parts(material);
  }
  const auto size = [](int count) { return static_cast<std::size_t>(count); };
  for (const auto& [field, count] : {std::pair{"materials", materials},
                                     {"textures", size(scene.textures_size())},
                                     {"objects", size(scene.objects_size())},
                                     {"lights", size(scene.lights_size())}}) {
    if (count > kMaxSceneEntries) {
      return invalid_argument("{}: at most {} are possible, got {}", field, kMaxSceneEntries, count);
    }
  }
  return ok_status();
}

Result<std::uint32_t> material_index(const std::string& path, const std::string& name,
                                     const std::vector<Material>& materials,
                                     const std::map<std::string_view, std::uint32_t>& index) {
  if (name.empty()) {
    return invalid_argument("{}.material: must be given", path);
  }
  const auto found = index.find(name);
  if (found == index.end()) {
    return invalid_argument("{}.material: {}", path, describe_unknown_material(name, materials));
  }
  return found->second;
}

Status draft_objects(const v1::Scene& scene, SceneDraft& draft) {
  std::map<std::string_view, std::uint32_t> index;
  for (std::size_t i = 0; i < draft.scene.materials.size(); ++i) {
    index.emplace(draft.scene.materials[i].name, static_cast<std::uint32_t>(i));
  }
  for (int i = 0; i < scene.objects_size(); ++i) {
    const v1::Object& object = scene.objects(i);
    const std::string path = fmt::format("objects[{}]", i);
    LM_ASSIGN_OR_RETURN(Object out, object_from_wire(path, object));
    const bool by_face = object.has_mesh() && object.material().empty();
    if (!by_face) {
      LM_ASSIGN_OR_RETURN(out.material, material_index(path, object.material(), draft.scene.materials, index));
    } else if (index.empty()) {
      return invalid_argument("{}: the faces need materials, but the document has none", path);
    }
    draft.scene.objects.push_back(std::move(out));
    draft.material_by_face.push_back(by_face);
  }
  return ok_status();
}

/// Reads the assets that a packed document names.
Status assets_from_wire(const v1::Scene& scene, Scene& out) {
  for (int i = 0; i < scene.textures_size(); ++i) {
    LM_ASSIGN_OR_RETURN(out.textures[static_cast<std::size_t>(i)].asset,
                        asset_from_wire(fmt::format("textures[{}].asset", i), scene.textures(i).asset()));
  }
  for (int i = 0; i < scene.objects_size(); ++i) {
    if (auto* mesh = std::get_if<MeshShape>(&out.objects[static_cast<std::size_t>(i)].shape)) {
      LM_ASSIGN_OR_RETURN(mesh->asset,
                          asset_from_wire(fmt::format("objects[{}].mesh.asset", i), scene.objects(i).mesh().asset()));
    }
  }
  return ok_status();
}

}  // namespace

void to_wire(const Scene& scene, v1::Scene* out) {
  out->set_name(scene.name);
  to_wire_point(scene.camera.eye, out->mutable_camera()->mutable_eye());
  to_wire_point(scene.camera.look_at, out->mutable_camera()->mutable_look_at());
  to_wire_point(scene.camera.up, out->mutable_camera()->mutable_up());
  out->mutable_camera()->set_vertical_fov_degrees(scene.camera.vertical_fov_degrees);
  out->mutable_camera()->set_lens_radius(scene.camera.lens_radius);
  out->mutable_camera()->set_focus_distance(scene.camera.focus_distance);
  out->mutable_camera()->set_shift_x(scene.camera.shift_x);
  out->mutable_camera()->set_shift_y(scene.camera.shift_y);
  out->mutable_film()->set_width(scene.film.width);
  out->mutable_film()->set_height(scene.film.height);
  out->mutable_film()->mutable_filter()->set_kind(to_wire_filter(scene.film.filter.kind));
  out->mutable_film()->mutable_filter()->set_radius_pixels(scene.film.filter.radius_pixels);
  for (const TextureImage& texture : scene.textures) {
    to_wire_texture(texture, scene.textures, out->add_textures());
  }
  for (const Material& material : scene.materials) {
    to_wire_material(material, scene.textures, out->add_materials());
  }
  for (const Object& object : scene.objects) {
    to_wire_object(object, scene.materials, out->add_objects());
  }
  for (const Light& light : scene.lights) {
    to_wire_light(light, out->add_lights());
  }
  for (const Meter& meter : scene.meters) {
    to_wire_meter(meter, out->add_meters());
  }
}

Result<Camera> from_wire(const v1::Camera& camera) {
  Camera out;
  LM_ASSIGN_OR_RETURN(out.eye, point_from_wire("camera.eye", camera.has_eye(), camera.eye()));
  LM_ASSIGN_OR_RETURN(out.look_at, point_from_wire("camera.look_at", camera.has_look_at(), camera.look_at()));
  if (camera.has_up()) {
    out.up = {camera.up().x(), camera.up().y(), camera.up().z()};
  }
  out.lens_radius = camera.lens_radius();
  out.focus_distance = camera.focus_distance();
  out.shift_x = camera.shift_x();
  out.shift_y = camera.shift_y();
  switch (camera.view_case()) {
    case v1::Camera::kVerticalFovDegrees:
      out.vertical_fov_degrees = camera.vertical_fov_degrees();
      break;
    case v1::Camera::kCameraConstant:
      LM_RETURN_IF_ERROR(check_range("camera.camera_constant", camera.camera_constant(), 1e-3, 1e6));
      out.vertical_fov_degrees = 2 * std::atan(0.5 / camera.camera_constant()) * 180 / std::numbers::pi;
      break;
    case v1::Camera::VIEW_NOT_SET:
      return invalid_argument("camera: vertical_fov_degrees or camera_constant must be given");
  }
  LM_RETURN_IF_ERROR(validate(out));
  return out;
}

Result<SceneDraft> draft_from_wire(const v1::Scene& scene) {
  LM_RETURN_IF_ERROR(check_counts(scene));
  SceneDraft draft;
  draft.scene.name = scene.name();
  if (!scene.has_camera()) {
    return invalid_argument("camera: must be given");
  }
  LM_ASSIGN_OR_RETURN(draft.scene.camera, from_wire(scene.camera()));
  LM_ASSIGN_OR_RETURN(draft.scene.film, film_from_wire(scene.film()));
  TextureNames textures;
  for (int i = 0; i < scene.textures_size(); ++i) {
    LM_ASSIGN_OR_RETURN(TextureImage texture,
                        texture_from_wire(fmt::format("textures[{}]", i), scene.textures(i), textures));
    textures.emplace(texture.name, static_cast<std::uint32_t>(i));
    draft.scene.textures.push_back(std::move(texture));
  }
  for (int i = 0; i < scene.materials_size(); ++i) {
    LM_ASSIGN_OR_RETURN(Material material,
                        material_from_wire(fmt::format("materials[{}]", i), scene.materials(i), textures));
    draft.scene.materials.push_back(std::move(material));
  }
  LM_RETURN_IF_ERROR(draft_objects(scene, draft));
  for (int i = 0; i < scene.lights_size(); ++i) {
    LM_ASSIGN_OR_RETURN(Light light, light_from_wire(fmt::format("lights[{}]", i), scene.lights(i)));
    draft.scene.lights.push_back(std::move(light));
  }
  for (int i = 0; i < scene.meters_size(); ++i) {
    LM_ASSIGN_OR_RETURN(Meter meter, meter_from_wire(fmt::format("meters[{}]", i), scene.meters(i)));
    draft.scene.meters.push_back(std::move(meter));
  }
  LM_RETURN_IF_ERROR(validate(draft.scene));
  return draft;
}

Result<Scene> from_wire(const v1::Scene& scene) {
  LM_ASSIGN_OR_RETURN(SceneDraft draft, draft_from_wire(scene));
  for (std::size_t i = 0; i < draft.material_by_face.size(); ++i) {
    if (draft.material_by_face[i]) {
      return invalid_argument("objects[{}].material: must be given in a packed scene", i);
    }
  }
  LM_RETURN_IF_ERROR(assets_from_wire(scene, draft.scene));
  for (int i = 0; i < scene.lights_size(); ++i) {
    LM_RETURN_IF_ERROR(light_asset_from_wire(fmt::format("lights[{}]", i), scene.lights(i), draft.scene.lights[i]));
  }
  return std::move(draft.scene);
}

std::string pack_scene(const Scene& scene) {
  LM_CHECK(validate(scene).ok(), "{}", message_of(validate(scene)));
  v1::Scene message;
  to_wire(scene, &message);
  return deterministic_bytes(message);
}

std::size_t count_entries(std::string_view packed) {
  using google::protobuf::internal::WireFormatLite;
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(packed.data()),
                                            static_cast<int>(packed.size()));
  std::size_t entries = 0;
  for (std::uint32_t tag = in.ReadTag(); tag != 0 && WireFormatLite::SkipField(&in, tag); tag = in.ReadTag()) {
    ++entries;
  }
  return entries;
}

Result<Scene> unpack_scene(std::string_view bytes) {
  if (bytes.size() > kMaxSceneBytes) {
    return invalid_argument("a packed scene of {} bytes is more than the limit of {}", bytes.size(), kMaxSceneBytes);
  }
  // An empty entry has two bytes, and takes hundreds when it is parsed.
  if (const std::size_t entries = count_entries(bytes); entries > 2 * kMaxSceneEntries) {
    return invalid_argument("a packed scene of {} entries is more than the limit of {}", entries, 2 * kMaxSceneEntries);
  }
  v1::Scene message;
  if (!parse_bytes(bytes, &message)) {
    return invalid_argument("a packed scene of {} bytes is damaged", bytes.size());
  }
  return from_wire(message);
}

}  // namespace lightmill
