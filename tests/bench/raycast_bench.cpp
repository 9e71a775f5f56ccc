// The method `raycast` on one thread, relative to Embree alone. Compares the rate of its camera and shadow rays, with
// shading, with the rate of plain Embree calls for the same rays.
//
// The rays of one sample per pixel are prepared first, in the method's packets of eight. rtcIntersect8 and rtcOccluded8
// trace them in a hierarchy built the same way. Runs alternate, and the median ratio is reported, because the machine
// may be busy. Scenes must have meshes and lights that are no surfaces.
#include <embree3/rtcore.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "common/base/check.h"
#include "common/methods/camera_rays.h"
#include "common/scene/compiled/mesh_sources.h"
#include "tests/bench/measure.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

struct Packet {
  M8 lanes;
  Ray8 rays;
};
using Packets = std::vector<Packet>;

std::uint64_t count(const Packets& packets) {
  std::uint64_t rays = 0;
  for (const Packet& packet : packets) {
    rays += static_cast<std::uint64_t>(packet.lanes.count());
  }
  return rays;
}

/// The rays of sample 0 of every pixel, as the method traces them.
struct SampleRays {
  Packets camera, shadow;
};

void add_shadow_rays(const CompiledScene& scene, const Surface8& s, M8 lanes, Packets& out) {
  const V8 facing = select(s.front, s.geometric_normal, -s.geometric_normal);
  const V8 normal = select(s.front, s.shading_normal, -s.shading_normal);
  const V8 origin = s.point + facing * s.offset;
  const LightTable& lights = scene.lights();
  for (std::uint32_t i = lights.first(LightKind::point); i < lights.first(LightKind::environment); ++i) {
    const LightSample8 light = lights.sample_point(i, origin, lanes);
    const M8 lit = lanes & light.valid & (dot(light.wi, facing) > F8(0.0f)) & (dot(light.wi, normal) > F8(0.0f));
    if (lit.any()) {
      out.push_back({lit, {origin, light.point - origin, F8(1.0f)}});
    }
  }
}

SampleRays rays_of(const CompiledScene& scene) {
  SampleRays out;
  const TileGrid grid({0, 0, scene.film_width(), scene.film_height()});
  std::vector<std::uint32_t> seeds;
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    const PixelRect tile = grid.tile_rect({i});
    fill_pixel_seeds(tile, 1, 0, seeds);
    for (int pixel = 0; pixel < tile.pixel_count(); pixel += 8) {
      const M8 lanes = first_lanes(static_cast<int>(tile.pixel_count() - pixel));
      const U8 pixels = U8(static_cast<std::uint32_t>(pixel)) + U8::lane_index();
      const Ray8 rays = sample_camera_rays(scene, tile, pixels, U8::load(&seeds[pixel]), 0);
      out.camera.push_back({lanes, rays});
      const Hit8 hits = scene.accel().intersect(lanes, rays, true);
      if (hits.hit.any()) {
        add_shadow_rays(scene, scene.surface(rays, hits), hits.hit, out.shadow);
      }
    }
  }
  return out;
}

/// The scene's meshes in Embree, without the renderer.
class BareEmbree {
 public:
  BareEmbree(const Scene& scene, const CompiledScene& compiled, const CompiledScene::AssetSource& assets, bool robust)
      : device_(rtcNewDevice("isa=avx2,threads=1,user_threads=1")), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
    const auto meshes = load_meshes(scene, assets);
    LM_CHECK(meshes.ok(), "{}", message_of(meshes.status()));
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      LM_CHECK(meshes->of_object[i] != nullptr, "objects[{}] is not a mesh; this bench needs scenes of meshes", i);
      add(transformed(*meshes->of_object[i], Affine(scene.objects[i].transform)), compiled.frame());
    }
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  /// Number of rays that hit something.
  std::uint64_t trace(const SampleRays& rays) const {
    std::uint64_t hits = 0;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (const Packet& packet : rays.camera) {
      RTCRayHit8 query;
      fill(packet, query.ray);
      U8(RTC_INVALID_GEOMETRY_ID).store(query.hit.geomID);
      U8(RTC_INVALID_GEOMETRY_ID).store(query.hit.instID[0]);
      rtcIntersect8(valid(packet), scene_, &context, &query);
      const M8 hit = and_not(packet.lanes, U8::load(query.hit.geomID) == U8(RTC_INVALID_GEOMETRY_ID));
      hits += static_cast<std::uint64_t>(hit.count());
    }
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    for (const Packet& packet : rays.shadow) {
      RTCRay8 query;
      fill(packet, query);
      rtcOccluded8(valid(packet), scene_, &context, &query);
      hits += static_cast<std::uint64_t>((packet.lanes & (F8::load(query.tfar) < F8(0.0f))).count());
    }
    return hits;
  }

 private:
  void add(const Mesh& mesh, const WorldFrame& frame) {
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
    auto* const vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3 p(frame.to_frame({mesh.positions[i][0], mesh.positions[i][1], mesh.positions[i][2]}));
      std::copy_n(&p.x, 3, vertices + 3 * i);
    }
    void* const indices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size());
    std::memcpy(indices, mesh.triangles.data(), 12 * mesh.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

  static const int* valid(const Packet& packet) { return reinterpret_cast<const int*>(&packet.lanes); }
  template <class Query>
  static void fill(const Packet& packet, Query& query) {
    packet.rays.origin.x.store(query.org_x);
    packet.rays.origin.y.store(query.org_y);
    packet.rays.origin.z.store(query.org_z);
    packet.rays.direction.x.store(query.dir_x);
    packet.rays.direction.y.store(query.dir_y);
    packet.rays.direction.z.store(query.dir_z);
    F8(0.0f).store(query.tnear);
    F8(0.0f).store(query.time);
    packet.rays.max_distance.store(query.tfar);
    U8(0xffffffffu).store(query.mask);
    U8(0u).store(query.flags);
  }

  RTCDevice device_;
  RTCScene scene_;
};

/// Rays per second of the method's first samples of all pixels.
double raycast_rate(const CompiledScene& scene, const Method& method, std::uint32_t level, RenderCounters& counters) {
  const auto workspace = method.make_workspace();
  const TileGrid grid({0, 0, scene.film_width(), scene.film_height()});
  const double start = thread_cpu_seconds();
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    method.render(grid.tile_rect({i}), {level, 0}, *workspace);
  }
  const double seconds = thread_cpu_seconds() - start;
  counters = workspace->counters;
  return static_cast<double>(counters.closest_hit_rays + counters.shadow_rays) / seconds;
}

double embree_rate(const BareEmbree& embree, const SampleRays& rays, int passes) {
  std::uint64_t hits = 0;
  const double start = thread_cpu_seconds();
  for (int pass = 0; pass < passes; ++pass) {
    hits += embree.trace(rays);
  }
  const double seconds = thread_cpu_seconds() - start;
  LM_CHECK(hits > 0, "no ray hits anything");
  return passes * static_cast<double>(count(rays.camera) + count(rays.shadow)) / seconds;
}

void measure(const std::filesystem::path& path, const std::string& name, std::uint32_t level, int pairs) {
  const TestScene scene(path);
  auto compiled = *CompiledScene::compile(scene.scene(), scene.assets());
  const auto method = make_method(compiled, {name, 1, 0});
  LM_CHECK(method.ok(), "{}", message_of(method.status()));
  const SampleRays rays = rays_of(*compiled);
  std::printf("%s: %d x %d pixels, %.2f shadow rays per camera ray\n", path.filename().c_str(), compiled->film_width(),
              compiled->film_height(),
              static_cast<double>(count(rays.shadow)) / static_cast<double>(count(rays.camera)));
  for (const bool robust : {true, false}) {
    const BareEmbree embree(scene.scene(), *compiled, scene.assets(), robust);
    std::vector<double> ours, bare, ratios;
    for (int pair = 0; pair < pairs; ++pair) {
      RenderCounters counters;
      ours.push_back(raycast_rate(*compiled, **method, level, counters));
      bare.push_back(embree_rate(embree, rays, 1 << level));
      ratios.push_back(ours.back() / bare.back());
    }
    std::printf("  %s %6.2f Mrays/s   Embree (%s) %6.2f Mrays/s   median ratio %.2f (%.2f to %.2f)\n", name.c_str(),
                median(ours) * 1e-6, robust ? "robust" : "fast", median(bare) * 1e-6, median(ratios),
                *std::min_element(ratios.begin(), ratios.end()), *std::max_element(ratios.begin(), ratios.end()));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Compares the method raycast with plain Embree calls for the same rays, on one thread.");
  std::vector<std::string> scenes;
  std::string method = "raycast";
  std::uint32_t level = 4;
  int pairs = 5;
  app.add_option("scenes", scenes, "scene documents of meshes")->required();
  app.add_option("--method", method, "raycast, raycast:flat, whitted")->capture_default_str();
  app.add_option("--level", level, "log2 of the samples per pixel")->capture_default_str()->check(CLI::Range(1, 10));
  app.add_option("--pairs", pairs, "runs of both in turn")->capture_default_str()->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);
  for (const std::string& scene : scenes) {
    measure(scene, method, level, pairs);
  }
}
