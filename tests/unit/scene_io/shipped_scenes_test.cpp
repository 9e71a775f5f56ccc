// Facts about the shipped scenes on which comparisons rely.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <regex>
#include <set>

#include "common/scene/mesh.h"
#include "common/scene_io/load.h"
#include "common/wire/scene_proto.h"
#include "tests/support/paths.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

const fs::path kScenes = test::source_file("scenes");

LoadedScene load(const std::vector<fs::path>& names) {
  std::vector<fs::path> paths;
  for (const fs::path& name : names) {
    paths.push_back(kScenes / name);
  }
  Result<LoadedScene> loaded = load_scene(paths);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return *std::move(loaded);
}

/// All triangles of one material, with their corners.
struct Triangle {
  Point3d a, b, c;
  Point3d normal_times_area() const {
    const Point3d u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const Point3d v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    return {(u[1] * v[2] - u[2] * v[1]) / 2, (u[2] * v[0] - u[0] * v[2]) / 2, (u[0] * v[1] - u[1] * v[0]) / 2};
  }
  Point3d center() const { return {(a[0] + b[0] + c[0]) / 3, (a[1] + b[1] + c[1]) / 3, (a[2] + b[2] + c[2]) / 3}; }
};

double dot(const Point3d& a, const Point3d& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double length(const Point3d& a) {
  return std::sqrt(dot(a, a));
}

std::vector<Triangle> triangles_of(const LoadedScene& loaded, const std::string& object) {
  for (const Object& candidate : loaded.scene.objects) {
    if (candidate.name != object) {
      continue;
    }
    const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(std::get<MeshShape>(candidate.shape).asset)));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    std::vector<Triangle> triangles;
    for (const auto& t : mesh->triangles) {
      triangles.push_back({mesh->positions[t[0]], mesh->positions[t[1]], mesh->positions[t[2]]});
    }
    return triangles;
  }
  ADD_FAILURE() << "no object " << object;
  return {};
}

Point3d total(const std::vector<Triangle>& triangles) {
  Point3d sum{0, 0, 0};
  for (const Triangle& triangle : triangles) {
    const Point3d n = triangle.normal_times_area();
    sum = {sum[0] + n[0], sum[1] + n[1], sum[2] + n[2]};
  }
  return sum;
}

double area(const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& triangle : triangles) {
    sum += length(triangle.normal_times_area());
  }
  return sum;
}

const Material& material(const Scene& scene, const std::string& name) {
  for (const Material& candidate : scene.materials) {
    if (candidate.name == name) {
      return candidate;
    }
  }
  ADD_FAILURE() << "no material " << name;
  return scene.materials.front();
}

TEST(ShippedScenes, AllLoadWithoutNotices) {
  for (const char* name :
       {"cornell-bench-blocks", "cornell-bench-balls", "cornell-course-blocks", "cornell-course-balls"}) {
    const LoadedScene loaded = load({name});
    EXPECT_TRUE(loaded.notices.empty()) << name;
    EXPECT_EQ(loaded.scene.name, name);
    EXPECT_EQ(loaded.scene.film.width, 512);
    EXPECT_EQ(loaded.scene.film.height, 512);
    EXPECT_EQ(load({std::string(name) + ".json"}).assets, loaded.assets);
    const Result<Scene> unpacked = unpack_scene(pack_scene(loaded.scene));
    ASSERT_TRUE(unpacked.ok()) << unpacked.status();
    std::set<Sha256> named;
    for (const Object& object : unpacked->objects) {
      if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
        named.insert(mesh->asset);
      }
    }
    EXPECT_EQ(named.size(), loaded.assets.size());
  }
}

TEST(ShippedScenes, EveryDocumentLoadsWithoutNotices) {
  // Some scenes need files that scenes/get-models fetches. Where these are missing, nothing else may be wrong.
  int loaded_count = 0;
  for (const auto& entry : fs::directory_iterator(kScenes)) {
    if (entry.path().extension() != ".json") {
      continue;
    }
    const fs::path path = entry.path();
    const Result<LoadedScene> loaded = load_scene(std::span(&path, 1));
    if (loaded.ok()) {
      EXPECT_TRUE(loaded->notices.empty()) << path << ": " << loaded->notices.front();
      const Result<Scene> unpacked = unpack_scene(pack_scene(loaded->scene));
      EXPECT_TRUE(unpacked.ok()) << path << ": " << unpacked.status();
      ++loaded_count;
    } else {
      EXPECT_TRUE(std::regex_search(message_of(loaded.status()),
                                    std::regex("cannot open .*/scenes/models/[a-z]+\\.(obj|exr): No such file")))
          << loaded.status();
    }
  }
  EXPECT_GE(loaded_count, 8);  // the Cornell boxes and course-default need nothing
}

TEST(ShippedScenes, TheLampHasItsMeasuredSizeAndRadiance) {
  const LoadedScene loaded = load({"cornell-bench-blocks"});
  const std::vector<Triangle> lamp = triangles_of(loaded, "box/lamp");
  EXPECT_DOUBLE_EQ(area(lamp), 13650);
  const Point3d down = total(lamp);
  EXPECT_NEAR(down[1], -13650, 1e-9);
  EXPECT_NEAR(down[0], 0, 1e-9);
  EXPECT_NEAR(down[2], 0, 1e-9);
  for (const Triangle& triangle : lamp) {
    for (const Point3d& corner : {triangle.a, triangle.b, triangle.c}) {
      EXPECT_EQ(corner[1], 548.7);  // a hair below the ceiling at 548.8
      EXPECT_TRUE(corner[0] == 213 || corner[0] == 343);
      EXPECT_TRUE(corner[2] == 227 || corner[2] == 332);
    }
  }
  const Material& emitter = material(loaded.scene, "lamp");
  EXPECT_EQ(emitter.emission, (RgbColor{17, 12, 4}));
  EXPECT_FALSE(emitter.two_sided_emission);
  EXPECT_EQ(std::get<DiffuseMaterial>(emitter.kind).reflectance, RgbColor{});
}

TEST(ShippedScenes, TheWallsFaceTheRoom) {
  const LoadedScene loaded = load({"cornell-bench-blocks"});
  const Point3d middle{278, 274.4, 279.6};
  for (const char* name : {"box/white", "box/red", "box/green", "box/lamp"}) {
    for (const Triangle& triangle : triangles_of(loaded, name)) {
      const Point3d at = triangle.center();
      EXPECT_GT(dot(triangle.normal_times_area(), {middle[0] - at[0], middle[1] - at[1], middle[2] - at[2]}), 0)
          << name;
    }
  }
}

TEST(ShippedScenes, TheWallsHaveTheirMeasuredSizes) {
  const LoadedScene loaded = load({"cornell-bench-blocks"});
  // Trapezia and rectangles: floor, ceiling and back wall.
  const double floor = (552.8 + 549.6) / 2 * 559.2;
  const double ceiling = 556 * 559.2;
  const double back = (549.6 + 556) / 2 * 548.8;
  EXPECT_NEAR(area(triangles_of(loaded, "box/white")), floor + ceiling + back, 1e-6);
  EXPECT_NEAR(area(triangles_of(loaded, "box/green")), 559.2 * 548.8, 1e-6);
  // The red wall is a little skew: its shadow on the plane x = 0 has the green one's size.
  EXPECT_NEAR(total(triangles_of(loaded, "box/red"))[0], -559.2 * 548.8, 1e-6);
}

TEST(ShippedScenes, RedIsOnTheLeftAndGreenOnTheRight) {
  const LoadedScene loaded = load({"cornell-bench-blocks"});
  const Camera& camera = loaded.scene.camera;
  const Point3d forward{camera.look_at[0] - camera.eye[0], camera.look_at[1] - camera.eye[1],
                        camera.look_at[2] - camera.eye[2]};
  const Point3d& up = camera.up;
  // cross(forward, up) points to the right of the picture.
  const Point3d right{forward[1] * up[2] - forward[2] * up[1], forward[2] * up[0] - forward[0] * up[2],
                      forward[0] * up[1] - forward[1] * up[0]};
  for (const auto& [name, sign] : {std::pair{"box/red", -1.0}, {"box/green", 1.0}}) {
    for (const Triangle& triangle : triangles_of(loaded, name)) {
      const Point3d at = triangle.center();
      EXPECT_GT(sign * dot({at[0] - camera.eye[0], at[1] - camera.eye[1], at[2] - camera.eye[2]}, right), 0) << name;
    }
  }
}

TEST(ShippedScenes, TheBlocksAreOpenOnlyBelow) {
  const LoadedScene loaded = load({"cornell-bench-blocks"});
  std::map<std::pair<Point3d, Point3d>, int> edges;
  const std::vector<Triangle> triangles = triangles_of(loaded, "blocks/white");
  EXPECT_EQ(triangles.size(), 20u);
  for (const Triangle& t : triangles) {
    for (const auto& [from, to] : {std::pair{t.a, t.b}, {t.b, t.c}, {t.c, t.a}}) {
      EXPECT_EQ((++edges[{from, to}]), 1);
    }
  }
  int open = 0;
  for (const auto& [edge, count] : edges) {
    if (edges.count({edge.second, edge.first}) == 0) {
      EXPECT_EQ(edge.first[1], 0);
      EXPECT_EQ(edge.second[1], 0);
      ++open;
    }
  }
  EXPECT_EQ(open, 8);
  // Normals point outwards, and only the undersides are missing. So the sum points up with their area (by the shoelace
  // formula).
  const Point3d up = total(triangles);
  const auto shoelace = [](const std::vector<std::array<double, 2>>& corners) {
    double sum = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto& [x0, z0] = corners[i];
      const auto& [x1, z1] = corners[(i + 1) % corners.size()];
      sum += x0 * z1 - x1 * z0;
    }
    return std::abs(sum) / 2;
  };
  const double undersides = shoelace({{130, 65}, {82, 225}, {240, 272}, {290, 114}}) +
                            shoelace({{423, 247}, {265, 296}, {314, 456}, {472, 406}});
  EXPECT_NEAR(up[0], 0, 1e-6);
  EXPECT_NEAR(up[1], undersides, 1e-6);
  EXPECT_NEAR(up[2], 0, 1e-6);
  double lowest = 1e9, highest = -1e9;
  for (const Triangle& t : triangles) {
    lowest = std::min({lowest, t.a[1], t.b[1], t.c[1]});
    highest = std::max({highest, t.a[1], t.b[1], t.c[1]});
  }
  EXPECT_EQ(lowest, 0);
  EXPECT_EQ(highest, 330);
}

TEST(ShippedScenes, TheBenchCameraAndFilterAreThoseOfTheComparison) {
  for (const char* name : {"cornell-bench-blocks", "cornell-bench-balls"}) {
    const Scene scene = load({name}).scene;
    EXPECT_EQ(scene.camera.eye, (Point3d{278, 273, -800}));
    EXPECT_EQ(scene.camera.look_at, (Point3d{278, 273, 0}));
    EXPECT_EQ(scene.camera.vertical_fov_degrees, 39.3077);
    EXPECT_EQ(scene.film.filter.kind, FilterKind::box);
    EXPECT_EQ(scene.film.filter.radius_pixels, 0.5);
    EXPECT_EQ(std::get<DiffuseMaterial>(material(scene, "white").kind).reflectance, (RgbColor{.73f, .73f, .73f}));
    EXPECT_EQ(std::get<DiffuseMaterial>(material(scene, "red").kind).reflectance, (RgbColor{.63f, .065f, .05f}));
    EXPECT_EQ(std::get<DiffuseMaterial>(material(scene, "green").kind).reflectance, (RgbColor{.14f, .45f, .091f}));
  }
}

TEST(ShippedScenes, TheBallsStandOnTheFloor) {
  const auto expect_balls = [](const char* name, const Point3d& mirror, const Point3d& glass) {
    const Scene scene = load({name}).scene;
    ASSERT_EQ(scene.objects.size(), 6u) << name;
    const auto& first = std::get<SphereShape>(scene.objects[4].shape);
    const auto& second = std::get<SphereShape>(scene.objects[5].shape);
    EXPECT_EQ(first.center, mirror);
    EXPECT_EQ(second.center, glass);
    EXPECT_EQ(first.radius, 90);
    EXPECT_EQ(second.radius, 90);
    EXPECT_TRUE(std::holds_alternative<MirrorMaterial>(scene.materials[scene.objects[4].material].kind));
    EXPECT_EQ(std::get<DielectricMaterial>(scene.materials[scene.objects[5].material].kind).ior, 1.5);
  };
  expect_balls("cornell-bench-balls", {410, 90, 350}, {150, 90, 200});
  expect_balls("cornell-course-balls", {420, 90, 370}, {130, 90, 250});
}

TEST(ShippedScenes, TheCourseBoxIsTheSameFromItsObjFiles) {
  const LoadedScene document = load({"cornell-course-blocks"});
  const LoadedScene direct = load({"assets/CornellBox.obj", "assets/CornellBlocks.obj"});
  EXPECT_EQ(direct.assets, document.assets);
  EXPECT_EQ(direct.notices,
            std::vector<std::string>{"Ka was read as emission, because only some materials have it: lamp"});
  EXPECT_EQ(direct.scene.camera.eye, document.scene.camera.eye);
  EXPECT_EQ(direct.scene.camera.look_at, document.scene.camera.look_at);
  EXPECT_DOUBLE_EQ(direct.scene.camera.vertical_fov_degrees, document.scene.camera.vertical_fov_degrees);
  ASSERT_EQ(direct.scene.objects.size(), document.scene.objects.size());
  for (std::size_t i = 0; i < direct.scene.objects.size(); ++i) {
    const Material& a = direct.scene.materials[direct.scene.objects[i].material];
    const Material& b = document.scene.materials[document.scene.objects[i].material];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.emission, b.emission);
    EXPECT_EQ(a.two_sided_emission, b.two_sided_emission);
    EXPECT_EQ(std::get<DiffuseMaterial>(a.kind).reflectance, std::get<DiffuseMaterial>(b.kind).reflectance);
    EXPECT_EQ(std::get<MeshShape>(direct.scene.objects[i].shape).asset,
              std::get<MeshShape>(document.scene.objects[i].shape).asset);
  }
}

}  // namespace
}  // namespace lightmill
