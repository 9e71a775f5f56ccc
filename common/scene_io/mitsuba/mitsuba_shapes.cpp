#include "common/scene_io/mitsuba/mitsuba_shapes.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/scene_io/mesh_edits.h"
#include "common/scene_io/obj.h"
#include "common/scene_io/ply.h"
#include "common/scene_io/smoothing.h"
#include "common/scene_io/tessellate.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr double kLongestSide = 1e12;

/// The square from (-1, -1) to (1, 1) in the plane z = 0, facing +z. v of Mitsuba grows along y, and ours against it.
Mesh rectangle_mesh() {
  Mesh out;
  out.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  out.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  out.triangles = {{0, 1, 2}, {0, 2, 3}};
  return out;
}

/// The cube from -1 to 1. Each side shows a whole image.
Mesh cube_mesh() {
  struct Side {
    std::array<double, 3> corner, u, v;  ///< of the lower left texel, and the edges of the image
  };
  constexpr std::array<Side, 6> kSides{{{{1, -1, -1}, {0, 0, 2}, {-2, 0, 0}},
                                        {{1, 1, -1}, {-2, 0, 0}, {0, 0, 2}},
                                        {{1, -1, -1}, {0, 2, 0}, {0, 0, 2}},
                                        {{1, -1, 1}, {0, 2, 0}, {-2, 0, 0}},
                                        {{-1, -1, 1}, {0, 2, 0}, {0, 0, -2}},
                                        {{1, 1, -1}, {0, -2, 0}, {-2, 0, 0}}}};
  Mesh out;
  for (const Side& side : kSides) {
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      std::array<double, 3> p = side.corner;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] += u * side.u[k] + v * side.v[k];
      }
      out.positions.push_back(p);
      out.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
    out.triangles.push_back({first, first + 1, first + 2});
    out.triangles.push_back({first, first + 2, first + 3});
  }
  return out;
}

/// u of Mitsuba grows with the radius, v with the angle.
Mesh whole_disk_mesh() {
  Mesh out = disk_mesh(0, 360);
  for (auto& [u, v] : out.texture_coordinates) {
    std::tie(u, v) = std::pair(1 - v, 1 - u);
  }
  return out;
}

bool reads_file(std::string_view type) {
  return type == "obj" || type == "ply" || type == "serialized";
}

void turn_v(Mesh& mesh) {
  for (auto& coordinates : mesh.texture_coordinates) {
    coordinates[1] = 1 - coordinates[1];
  }
}

}  // namespace

Mesh MitsubaShapes::cylinder(const MitsubaObject& from, Transform& to_object) {
  const Point3d begin = from.point("p0", {0, 0, 0}), end = from.point("p1", {0, 0, 1});
  const double radius = from.number("radius", 1, 1e-12, kLongestSide);
  const Point3d axis = difference(end, begin);
  const Point3d aside = std::abs(axis[0]) < 0.9 * length(axis) ? Point3d{1, 0, 0} : Point3d{0, 1, 0};
  const std::optional<Transform> frame = looking_at(begin, end, aside);
  if (!frame) {
    from.fail("p1", "must differ from p0");
  } else if (axis[0] == 0 && axis[1] == 0 && axis[2] > 0) {
    to_object = compose(translation(begin), scaling({radius, radius, length(axis)}));
  } else {
    to_object = compose(*frame, scaling({radius, radius, length(axis)}));
  }
  Mesh out = cylinder_mesh(360);
  turn_v(out);
  return out;
}

Result<Mesh> MitsubaShapes::obj(const MitsubaObject& from, const SourceFile& file) {
  Result<ObjFile> read = read_obj(file.bytes, file.name, loaded_.faults);
  if (!read.ok()) {
    return from.place.error("{}", message_of(read.status()));
  }
  if (read->normals.empty() && !from.boolean("face_normals", false)) {
    std::vector<SmoothRun> runs;
    for (std::size_t i = 0; i < read->parts.size(); ++i) {
      runs.push_back({i, 0, read->parts[i].triangles.size(), 1});
    }
    smooth_normals(*read, runs);
  }
  std::vector<const ObjPart*> parts;
  for (const ObjPart& part : read->parts) {
    parts.push_back(&part);
  }
  Mesh out = make_mesh(*read, parts);
  out.colors.clear();
  if (!from.boolean("flip_tex_coords", true)) {
    turn_v(out);
  }
  return out;
}

Status MitsubaShapes::open(const std::string& name) {
  if (name.empty() || name != open_name_) {
    LM_ASSIGN_OR_RETURN(file_, files_(name));
    open_name_ = name;
  }
  return ok_status();
}

Result<Mesh> MitsubaShapes::mesh_file(const MitsubaObject& from) {
  if (const Status opened = open(from.text("filename", "")); !opened.ok()) {
    return from.place.error("{}: {}", from.what(), message_of(opened));
  }
  bool flat = from.boolean("face_normals", false);
  if (from.type == "obj") {
    LM_ASSIGN_OR_RETURN(Mesh out, obj(from, file_));
    if (flat) {
      out.normals.clear();
    }
    return out;
  }
  Result<Mesh> out = Mesh();
  if (from.type == "ply") {
    out = read_ply(file_.bytes, file_.name);
  } else {
    const auto index = static_cast<std::size_t>(from.whole("shape_index", 0, 0, 1'000'000));
    Result<SerializedMesh> read = read_serialized(file_.bytes, file_.name, index, budget_);
    flat = flat || (read.ok() && read->face_normals);
    out = read.ok() ? Result<Mesh>(std::move(read->mesh)) : read.status();
  }
  if (!out.ok()) {
    return from.place.error("{}: {}", from.what(), message_of(out.status()));
  }
  if (flat) {
    out->normals.clear();
  } else if (out->normals.empty()) {
    add_normals(*out);
  }
  if (from.type == "serialized" || !from.boolean("flip_tex_coords", false)) {
    turn_v(*out);
  }
  return out;
}

Result<Mesh> MitsubaShapes::mesh_of(const MitsubaObject& from, Transform& to_object) {
  const std::string& type = from.type;
  if (type == "rectangle") {
    return rectangle_mesh();
  }
  if (type == "cube") {
    return cube_mesh();
  }
  if (reads_file(type)) {
    return mesh_file(from);
  }
  if (type == "disk" || type == "cylinder" || type == "sphere") {
    notices_.once(fmt::format("shapes of the type \"{}\" are rendered as triangles", type));
    return type == "disk"       ? whole_disk_mesh()
           : type == "cylinder" ? cylinder(from, to_object)
                                : sphere_mesh(-1, 1, 360);
  }
  return from.place.error("shapes of the type \"{}\" cannot be rendered", type);
}

Result<MitsubaShape> MitsubaShapes::read(const MitsubaObject& from, const MitsubaMeshNeeds& needs) {
  MitsubaShape out;
  out.to_world = from.transform("to_world");
  from.ignore({"silhouette_sampling_weight", "face_normals"});
  const bool flip = from.boolean("flip_normals", false);
  out.closed = (from.type == "sphere" || from.type == "cube") && !flip;
  if (from.type == "sphere") {
    const Point3d center = from.point("center", {0, 0, 0});
    const double radius = from.number("radius", 1, 1e-12, kLongestSide);
    out.to_world = compose(out.to_world, compose(translation(center), scaling({radius, radius, radius})));
    if (!similarity_scale(out.to_world)) {
      return from.place.error("{}: a sphere can be moved, turned and scaled, but not distorted", from.what());
    }
    if (!needs.coordinates && !needs.tangents) {
      out.ball = true;
      out.inward = flip;
      return out;
    }
  }
  std::string key = fmt::format("{} {} {} {}", from.type, flip, needs.coordinates, needs.tangents);
  const std::string_view own = from.type == "serialized" ? "shape_index" : "flip_tex_coords";
  for (const std::string_view name : {std::string_view("filename"), std::string_view("face_normals"), own}) {
    if (const MitsubaParameter* parameter = reads_file(from.type) ? from.find(name) : nullptr) {
      key += fmt::format(" {} {} {}", name, fmt::join(parameter->numbers, " "), parameter->text);
    }
  }
  Transform to_object = kIdentityTransform;
  if (const auto found = known_.find(key); found != known_.end()) {
    if (from.type == "cylinder") {
      cylinder(from, to_object);
    }
    out.mesh = found->second;
  } else {
    LM_ASSIGN_OR_RETURN(Mesh mesh, mesh_of(from, to_object));
    if (mesh.texture_coordinates.empty() && (needs.coordinates || needs.tangents)) {
      set_triangle_coordinates(mesh, {{{0, 1}, {1, 1}, {0, 0}}});
    }
    if (!mesh.normals.empty()) {
      follow_normals(mesh);
    }
    if (flip) {
      reverse_orientation(mesh);
    }
    if (needs.tangents) {
      add_tangents(mesh);
    }
    const Result<Sha256> asset = add_mesh(mesh, loaded_);
    if (!asset.ok()) {
      return from.place.error("{}: {}", from.what(), message_of(asset.status()));
    }
    out.mesh = known_.emplace(std::move(key), *asset).first->second;
  }
  out.to_world = compose(out.to_world, to_object);
  return out;
}

}  // namespace lightmill
