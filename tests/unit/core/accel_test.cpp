// Embree's inputs at their limits: rays without finite numbers, and the geometry that produces them.
#include "common/scene/accel/accel.h"

#include <gtest/gtest.h>

#include "common/base/sanitizers.h"
#include "common/methods/method.h"
#include "tests/support/little_memory.h"

namespace lightmill {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Accel, RaysThatCannotBeTracedHitNothing) {
  for (const Accel::Kind kind : {Accel::Kind::fast, Accel::Kind::robust, Accel::Kind::brute_force}) {
    Accel accel(kind);
    accel.add_mesh(std::vector<std::array<float, 3>>{{-1, 0, -1}, {-1, 0, 9}, {9, 0, -1}},
                   std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}});
    accel.add_sphere(Vec3(0, -2, 0), 1);
    ASSERT_TRUE(accel.commit().ok());
    // Straight down from above. Only lanes 0 and 7 are valid rays.
    const std::array<float, 8> x{0, kNan, 0, kInfinity, 0, 1e30f, 0, 1};
    const std::array<float, 8> y{-1, -1, kNan, -1, -kInfinity, -1, -1, -1};
    const std::array<float, 8> far{9, 9, 9, 9, 9, 9, kNan, 9};
    const Ray8 rays{
        {F8::load(x.data()), F8(1.0f), F8(0.0f)}, {F8(0.0f), F8::load(y.data()), F8(0.0f)}, F8::load(far.data())};
    EXPECT_EQ(Accel::traceable(rays).bits(), 0b10000001);
    EXPECT_EQ(accel.intersect(M8(true), rays, false).hit.bits(), 0b10000001);
    EXPECT_EQ(accel.intersect(M8(true), rays, true).hit.bits(), 0b10000001);
    EXPECT_EQ(accel.occluded(M8(true), rays).bits(), 0b10000001);
  }
}

/// A soup of triangles, two instances of a mesh (one mirrored), two spheres and a plane.
std::unique_ptr<Accel> soup(Accel::Kind kind) {
  auto accel = std::make_unique<Accel>(kind);
  std::uint32_t state = 1;
  const auto random = [&] { return static_cast<float>((state = mix(state + 1)) >> 8) * 0x1p-23f - 1; };
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const Vec3 center(random(), random(), random());
    for (int corner = 0; corner < 3; ++corner) {
      positions.push_back({center.x + 0.3f * random(), center.y + 0.3f * random(), center.z + 0.3f * random()});
    }
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  accel->add_mesh(positions, triangles);
  const std::uint32_t prototype = accel->add_prototype(positions, triangles);
  accel->add_instance(prototype, {{{0.5f, 0, 0, 1.5f}, {0, 0, 1, 0}, {0, -2, 0, 0.25f}}});
  accel->add_sphere(Vec3(0.4f, 0.3f, -0.2f), 0.3f);
  accel->add_instance(prototype, {{{-1, 0.25f, 0, -1.5f}, {0, 1, 0, 0}, {0, 0, 0.5f, 0}}});
  accel->add_sphere(Vec3(0, 0, 0), 4);
  accel->add_plane(Vec3(0, -0.5f, 0), Vec3(0, 1, 0));
  EXPECT_TRUE(accel->commit().ok());
  return accel;
}

/// A grid of `side` squares a side, as a mesh and as a prototype with an instance.
Status build_grid(std::uint32_t side) {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      positions.push_back({static_cast<float>(x), static_cast<float>(y), 0});
    }
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t first = y * (side + 1) + x;
      triangles.push_back({first, first + 1, first + side + 1});
      triangles.push_back({first + 1, first + side + 1, first + side + 2});
    }
  }
  Accel accel(Accel::Kind::fast);
  accel.add_mesh(positions, triangles);
  accel.add_instance(accel.add_prototype(positions, triangles), {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 9}}});
  accel.add_sphere(Vec3(0, 0, 5), 1);
  return accel.commit();
}

TEST(Accel, AnOutOfMemoryBuildThrows) {
  if (kSanitized) {
    GTEST_SKIP() << "address space cannot be limited under a sanitizer";
  }
  ASSERT_TRUE(build_grid(1).ok());  // creates the device
  enum { kBuilt, kOutOfMemory, kOther };
  const auto build = [] {
    try {
      return build_grid(200).ok() ? kBuilt : kOther;
    } catch (const std::bad_alloc&) {
    }
    return build_grid(1).ok() ? kOutOfMemory : kOther;  // a small build still works
  };
  int ended = 0, result = kOutOfMemory;
  for (std::uint64_t kib = 256; result == kOutOfMemory && kib < 256 << 10; kib += 1024) {
    result = test::run_in_little_memory(kib << 10, build);
    ended += result == kOutOfMemory ? 1 : 0;
    EXPECT_TRUE(result == kOutOfMemory || result == kBuilt) << result << " with " << kib << " KiB";
  }
  EXPECT_EQ(result, kBuilt) << "with enough memory";
  EXPECT_GT(ended, 2);
}

TEST(Accel, BruteForceFindsTheSameHitsAsTheHierarchy) {
  const auto fast = soup(Accel::Kind::robust), brute = soup(Accel::Kind::brute_force);
  int hits = 0, other = 0, blocked = 0;
  std::array<int, 6> seen{};
  constexpr int kPackets = 2000;
  for (std::uint32_t i = 0; i < kPackets; ++i) {
    const Pair8 a = hashed_pair(U8(i), U8::lane_index()), b = hashed_pair(U8(i), U8::lane_index() + U8(100u));
    const V8 direction = square_to_sphere(b);
    const Ray8 rays{square_to_sphere(a) * F8(1.5f), direction, F8(std::numeric_limits<float>::infinity())};
    const Hit8 x = fast->intersect(M8(true), rays, false), y = brute->intersect(M8(true), rays, false);
    const M8 near = abs(x.distance - y.distance) <= F8(2e-5f) * (F8(1.0f) + x.distance);
    const M8 same = x.hit & y.hit & (x.geometry == y.geometry) & (x.primitive == y.primitive) & near &
                    (length_squared(normalize(x.normal) - normalize(y.normal)) < F8(1e-6f));
    hits += same.count();
    other += and_not(x.hit | y.hit, same).count();
    for (std::uint32_t geometry = 0; geometry < 6; ++geometry) {
      seen[geometry] += (same & (y.geometry == U8(geometry))).count();
    }
    const Ray8 segments{rays.origin, direction, F8(0.7f)};
    blocked += (fast->occluded(M8(true), segments) & brute->occluded(M8(true), segments)).count();
    EXPECT_EQ(fast->occluded(M8(true), segments).bits(), brute->occluded(M8(true), segments).bits()) << i;
  }
  EXPECT_EQ(hits + other, 8 * kPackets) << "the large sphere closes the scene";
  EXPECT_LE(other, 2) << "edges, where rounding decides";
  EXPECT_GT(blocked, kPackets);
  for (const int count : seen) {
    EXPECT_GT(count, 50);
  }
}

TEST(Accel, HitsLieBeyondTheMinimumDistance) {
  const auto robust = soup(Accel::Kind::robust), fast = soup(Accel::Kind::fast), brute = soup(Accel::Kind::brute_force);
  int hits = 0, other = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const Pair8 a = hashed_pair(U8(i), U8::lane_index()), b = hashed_pair(U8(i), U8::lane_index() + U8(100u));
    const Ray8 rays{square_to_sphere(a) * F8(1.5f), square_to_sphere(b), F8(std::numeric_limits<float>::infinity())};
    F8 beyond(0.0f);
    for (M8 lanes(true); lanes.any();) {
      const Hit8 x = robust->intersect(lanes, rays, false, beyond), y = brute->intersect(lanes, rays, false, beyond),
                 z = fast->intersect(lanes, rays, true, beyond);
      const auto agree = [&](const Hit8& p, const Hit8& q) {
        const M8 near = abs(p.distance - q.distance) <= F8(2e-5f) * (F8(1.0f) + p.distance);
        return (p.hit & q.hit & (p.geometry == q.geometry) & (p.primitive == q.primitive) & near) | ~(p.hit | q.hit);
      };
      EXPECT_EQ((x.hit & (x.distance > beyond)).bits(), x.hit.bits());
      hits += x.hit.count();
      other += and_not(lanes, agree(x, y) & agree(x, z)).count();
      lanes = x.hit;
      beyond = select(lanes, x.distance * F8(1.0001f), beyond);
    }
  }
  EXPECT_GT(hits, 8 * 500 * 3 / 2) << "rays continue behind the first hits";
  EXPECT_LE(other, hits / 500) << "edges, where rounding decides";
}

// In single precision the squared area of such a triangle is zero, so it has no normal. Glass then refracts to nowhere.
// Samples that meet it count as not finite. The others do not change.
TEST(Accel, TrianglesWithoutANormalOnlyCostSamples) {
  Scene scene;
  std::map<Sha256, std::string> assets;
  const auto add = [&](std::uint32_t material, double size, double z) {
    Mesh mesh;
    mesh.positions = {{-size, -size, z}, {size, -size, z}, {size, size, z}, {-size, size, z}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    std::string bytes = encode_mesh(mesh);
    const Sha256 digest = sha256(bytes);
    assets.emplace(digest, std::move(bytes));
    scene.objects.push_back({"quad", material, MeshShape{"", digest}});
  };
  scene.materials = {{"lamp", DiffuseMaterial{{0, 0, 0}}, {1, 1, 1}, true},
                     {"glass", DielectricMaterial{1.5}, {}, false}};
  add(0, 1, 0);
  add(1, 1e-13, 1e-13);  // fills the middle of the picture
  scene.camera = {{0, 0, 5e-13}, {0, 0, 0}, {0, 1, 0}, 60};
  scene.film = {32, 32, {FilterKind::box, 0.5}};
  const auto compiled =
      CompiledScene::compile(scene, [&](const Sha256& digest) -> Result<std::string> { return assets.at(digest); });
  ASSERT_TRUE(compiled.ok());
  for (const char* name : {"path", "preview"}) {
    const auto method = make_method(*compiled, {name, 1, 0});
    const Node node = (*method)->render({0, 0, 32, 32}, {1, 0}, *(*method)->make_workspace());
    EXPECT_EQ(node.values[0], 1.0f) << name;  // a corner: the emitter
    EXPECT_EQ(node.non_finite > 0, std::string_view(name) == "path") << node.non_finite;
    EXPECT_TRUE(std::ranges::all_of(node.values, [](float v) { return std::isfinite(v); })) << name;
  }
}

}  // namespace
}  // namespace lightmill
