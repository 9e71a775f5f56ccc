#include "common/scene_io/pbrt/pbrt_shapes.h"

#include <algorithm>
#include <cmath>

#include "common/scene_io/loop_subdivision.h"
#include "common/scene_io/mesh_edits.h"
#include "common/scene_io/ply.h"
#include "common/scene_io/tessellate.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxTriangles = 200'000'000, kMaxKeptTriangles = 20'000'000;
constexpr double kLongest = 1e12;
constexpr std::array<std::array<float, 2>, 3> kTriangleCoordinates{
    {{0, 0}, {1, 0}, {1, 1}}};  ///< of meshes without any

/// Normals and texture coordinates of each vertex, if the parameters have as many. Normals without a length count as
/// none.
void read_vertices(const PbrtParameters& from, Mesh& out) {
  const std::vector<double> p = from.numbers("P", {"point3"}, 3), n = from.numbers("N", {"normal3"}, 3),
                            uv = from.numbers("uv", {"point2"}, 2);
  const std::size_t count = p.size() / 3;
  for (std::size_t i = 0; i < count; ++i) {
    out.positions.push_back({p[3 * i], p[3 * i + 1], p[3 * i + 2]});
  }
  if (count == 0) {
    from.fail("P", "positions are expected");
  }
  if ((!n.empty() && n.size() != 3 * count) || (!uv.empty() && uv.size() != 2 * count)) {
    from.fail(n.empty() || n.size() == 3 * count ? "uv" : "N", fmt::format("{} values are expected, as of P", count));
    return;
  }
  bool lengths = true;
  for (std::size_t i = 0; i + 2 < n.size(); i += 3) {
    const double length = std::hypot(n[i], n[i + 1], n[i + 2]);
    lengths = lengths && length > 1e-30 && length < 1e30;
    out.normals.push_back({static_cast<float>(n[i] / length), static_cast<float>(n[i + 1] / length),
                           static_cast<float>(n[i + 2] / length)});
  }
  if (!lengths) {
    out.normals.clear();
  }
  for (std::size_t i = 0; i + 1 < uv.size(); i += 2) {
    out.texture_coordinates.push_back({static_cast<float>(uv[i]), static_cast<float>(uv[i + 1])});
  }
}

/// Indices in groups, each below the number of vertices.
std::vector<std::uint32_t> read_corners(const PbrtParameters& from, std::size_t group, std::size_t vertices) {
  const std::vector<double> given = from.numbers("indices", {"integer"}, group);
  std::vector<std::uint32_t> out;
  if (given.empty() && !from.has("indices") && vertices == group) {
    for (std::uint32_t i = 0; i < group; ++i) {
      out.push_back(i);
    }
    return out;
  }
  for (const double index : given) {
    if (!(index >= 0 && index < static_cast<double>(vertices))) {
      from.fail("indices", fmt::format("there is no vertex {}, there are {}", index, vertices));
      return {};
    }
    out.push_back(static_cast<std::uint32_t>(index));
  }
  if (out.empty()) {
    from.fail("indices", "indices are expected");
  }
  return out;
}

}  // namespace

Result<PbrtShape> PbrtShapes::read(const std::string& type, const PbrtParameters& from, bool plain) {
  Result<PbrtShape> shape =
      type == "sphere"         ? sphere(from, plain)
      : type == "disk"         ? disk(from)
      : type == "cylinder"     ? cylinder(from)
      : type == "trianglemesh" ? triangles(from, plain)
      : type == "bilinearmesh" ? patches(from)
      : type == "loopsubdiv"   ? subdivided(from, plain)
      : type == "plymesh"      ? ply(from, plain)
                          : Result<PbrtShape>(from.place().error("shapes of the type \"{}\" cannot be rendered", type));
  LM_RETURN_IF_ERROR(shape.status());
  LM_RETURN_IF_ERROR(from.finish(faults_));
  if (shape->ball) {
    return shape;
  }
  if (!shape->mesh.normals.empty()) {
    follow_normals(shape->mesh);
  }
  if (const Status valid = validate(shape->mesh); !valid.ok()) {
    return from.place().error("{}: {}", from.what(), message_of(valid));
  }
  return shape;
}

Status PbrtShapes::cut(const std::string& type, const std::string& form, const SourcePlace& place, PbrtShape& shape) {
  notices_.once(fmt::format("shapes of the type \"{}\" are rendered as triangles", type));
  const std::size_t triangles = shape.mesh.triangles.size();
  shape.triangles_per_shape = static_cast<std::uint32_t>(triangles);
  return count(triangles, forms_.insert(type + " " + form).second, place);
}

Status PbrtShapes::count(std::size_t triangles, bool kept, const SourcePlace& place) {
  triangles_ += triangles;
  kept_triangles_ += kept ? triangles : 0;
  return triangles_ <= kMaxTriangles && kept_triangles_ <= kMaxKeptTriangles
             ? ok_status()
             : place.error("curved shapes make more than {} triangles, or {} different ones", kMaxTriangles,
                           kMaxKeptTriangles);
}

Result<PbrtShape> PbrtShapes::sphere_of_triangles(double radius, const SourcePlace& place) {
  PbrtShape out;
  out.mesh = sphere_mesh(-1, 1, 360);
  out.to_object = scaling({radius, radius, radius});
  LM_RETURN_IF_ERROR(cut("sphere", "", place, out));
  return out;
}

Result<PbrtShape> PbrtShapes::sphere(const PbrtParameters& from, bool plain) {
  const double radius = from.number("radius", 1, 1e-12, kLongest);
  const double low = std::clamp(from.number("zmin", -radius) / radius, -1.0, 1.0);
  const double high = std::clamp(from.number("zmax", radius) / radius, -1.0, 1.0);
  const double degrees = from.number("phimax", 360, 1e-3, 360);
  if (!(high - low > 1e-6)) {
    return from.place().error("sphere: zmax must be above zmin");
  }
  if (low == -1 && high == 1 && degrees == 360) {
    if (!plain) {
      return sphere_of_triangles(radius, from.place());
    }
    PbrtShape ball;
    ball.ball = radius;
    return ball;
  }
  PbrtShape out;
  out.mesh = sphere_mesh(low, high, degrees);
  out.to_object = scaling({radius, radius, radius});
  LM_RETURN_IF_ERROR(cut("sphere", fmt::format("{} {} {}", low, high, degrees), from.place(), out));
  return out;
}

Result<PbrtShape> PbrtShapes::disk(const PbrtParameters& from) {
  const double radius = from.number("radius", 1, 1e-12, kLongest),
               height = from.number("height", 0, -kLongest, kLongest);
  const double inner = from.number("innerradius", 0, 0, radius * (1 - 1e-6)) / radius;
  PbrtShape out;
  const double degrees = from.number("phimax", 360, 1e-3, 360);
  out.mesh = disk_mesh(inner, degrees);
  out.to_object = compose(translation({0, 0, height}), scaling({radius, radius, radius}));
  LM_RETURN_IF_ERROR(cut("disk", fmt::format("{} {}", inner, degrees), from.place(), out));
  return out;
}

Result<PbrtShape> PbrtShapes::cylinder(const PbrtParameters& from) {
  const double radius = from.number("radius", 1, 1e-12, kLongest);
  const double low = from.number("zmin", -1, -kLongest, kLongest), high = from.number("zmax", 1, -kLongest, kLongest);
  if (!(high > low)) {
    return from.place().error("cylinder: zmax must be above zmin");
  }
  PbrtShape out;
  const double degrees = from.number("phimax", 360, 1e-3, 360);
  out.mesh = cylinder_mesh(degrees);
  out.to_object = compose(translation({0, 0, low}), scaling({radius, radius, high - low}));
  LM_RETURN_IF_ERROR(cut("cylinder", fmt::format("{}", degrees), from.place(), out));
  return out;
}

Result<PbrtShape> PbrtShapes::triangles(const PbrtParameters& from, bool plain) {
  PbrtShape out;
  read_vertices(from, out.mesh);
  const std::vector<std::uint32_t> corners = read_corners(from, 3, out.mesh.positions.size());
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    out.mesh.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  }
  for (const char* unused : {"S", "faceIndices"}) {
    from.find(unused);
  }
  if (!plain && out.mesh.texture_coordinates.empty()) {
    set_triangle_coordinates(out.mesh, kTriangleCoordinates);
  }
  return out;
}

/// Each patch goes from corner 0 along u to 1, and along v to 2; corner 3 is opposite to 0.
Result<PbrtShape> PbrtShapes::patches(const PbrtParameters& from) {
  PbrtShape out;
  Mesh given;
  read_vertices(from, given);
  const std::vector<std::uint32_t> corners = read_corners(from, 4, given.positions.size());
  out.triangles_per_shape = 2;
  for (std::size_t i = 0; i + 3 < corners.size(); i += 4) {
    const std::array<std::uint32_t, 4> c{corners[i], corners[i + 1], corners[i + 2], corners[i + 3]};
    const auto edge_to = [&](std::size_t k) { return difference(given.positions[c[k]], given.positions[c[0]]); };
    const Point3d u = edge_to(1), v = edge_to(2), w = edge_to(3);
    if (std::abs(dot(u, cross(v, w))) > 1e-6 * (length(u) * length(v) * length(w))) {
      notices_.once("bilinear patches that are not flat are rendered as two triangles");
    }
    const auto first = static_cast<std::uint32_t>(out.mesh.positions.size());
    constexpr std::array<std::array<float, 2>, 4> kCorners{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
    for (std::size_t k = 0; k < 4; ++k) {
      out.mesh.positions.push_back(given.positions[c[k]]);
      if (!given.normals.empty()) {
        out.mesh.normals.push_back(given.normals[c[k]]);
      }
      out.mesh.texture_coordinates.push_back(given.texture_coordinates.empty() ? kCorners[k]
                                                                               : given.texture_coordinates[c[k]]);
    }
    out.mesh.triangles.push_back({first, first + 1, first + 3});
    out.mesh.triangles.push_back({first, first + 3, first + 2});
  }
  if (from.has("emissionfilename")) {
    from.fail("emissionfilename", "images of area lights cannot be rendered");
  }
  from.find("faceIndices");
  return out;
}

Result<PbrtShape> PbrtShapes::subdivided(const PbrtParameters& from, bool plain) {
  Mesh base;
  read_vertices(from, base);
  const std::vector<std::uint32_t> corners = read_corners(from, 3, base.positions.size());
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    base.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  }
  const auto levels = static_cast<int>(from.whole("levels", 3, 0, 12));
  LM_RETURN_IF_ERROR(count(base.triangles.size() << (2 * levels), true, from.place()));
  Result<Mesh> mesh = loop_subdivision(base, levels);
  if (!mesh.ok()) {
    return from.place().error("loopsubdiv: {}", message_of(mesh.status()));
  }
  from.find("scheme");
  PbrtShape out;
  out.mesh = *std::move(mesh);
  if (!plain) {
    set_triangle_coordinates(out.mesh, kTriangleCoordinates);
  }
  return out;
}

Result<PbrtShape> PbrtShapes::ply(const PbrtParameters& from, bool plain) {
  const std::string name = from.text("filename", "");
  const Result<SourceFile> file = files_(name);
  if (!file.ok()) {
    return from.place().error("plymesh: {}", message_of(file.status()));
  }
  PbrtShape out;
  Result<Mesh> mesh = read_ply(file->bytes, file->name);
  if (!mesh.ok()) {
    return from.place().error("plymesh: {}", message_of(mesh.status()));
  }
  out.mesh = *std::move(mesh);
  out.triangles_per_shape = 0;
  if (const PbrtParameter* displacement = from.find("displacement"); displacement != nullptr) {
    notices_.left_out("displacement of plymeshes");
  }
  from.find("edgelength");
  if (!plain && out.mesh.texture_coordinates.empty()) {
    set_triangle_coordinates(out.mesh, kTriangleCoordinates);
  }
  return out;
}

}  // namespace lightmill
