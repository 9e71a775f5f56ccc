#include "common/methods/fingerprint.h"

#include <algorithm>
#include <new>

#include "common/base/check.h"
#include "common/math/transcendental.h"
#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {
namespace {

/// One render of the test scene: its filter, and the size and samples that methods render.
struct Rendered {
  FilterKind filter;
  int side;           ///< pixels
  SampleRange range;  ///< of methods without photons
};

// The box filter's scene has every feature of methods. The other scenes cover the filters and the light BVH.
constexpr Rendered kRendered[] = {{FilterKind::box, 24, {2, 0}},
                                  {FilterKind::tent, 16, {0, 0}},
                                  {FilterKind::gaussian, 16, {0, 0}},
                                  {FilterKind::blackman_harris, 16, {0, 0}}};

/// A bumpy sphere around (x, y, z) of rings and segments. No two triangles are alike.
Mesh bumpy_sphere(double x, double y, double z, double radius) {
  constexpr std::uint32_t kRings = 24, kSegments = 32;
  Mesh mesh;
  for (std::uint32_t ring = 0; ring <= kRings; ++ring) {
    for (std::uint32_t segment = 0; segment <= kSegments; ++segment) {
      const double theta = kPiDouble * ring / kRings;
      const double phi = 2 * kPiDouble * segment / kSegments;
      const Vec3d n(sin_fixed(theta) * cos_fixed(phi), cos_fixed(theta), sin_fixed(theta) * sin_fixed(phi));
      const double r = radius * (1 + 0.05 * sin_fixed(7 * theta) * cos_fixed(5 * phi));
      mesh.positions.push_back({x + r * n.x, y + r * n.y, z + r * n.z});
      mesh.normals.push_back({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    }
  }
  for (std::uint32_t ring = 0; ring < kRings; ++ring) {
    for (std::uint32_t segment = 0; segment < kSegments; ++segment) {
      const std::uint32_t a = ring * (kSegments + 1) + segment;
      const std::uint32_t b = a + kSegments + 1;
      mesh.triangles.push_back({a, a + 1, b});
      mesh.triangles.push_back({b, a + 1, b + 1});
    }
  }
  return mesh;
}

/// A parallelogram with corner p and edges u, v.
Mesh quad(Vec3d p, Vec3d u, Vec3d v) {
  Mesh mesh;
  for (const Vec3d& corner : {p, p + u, p + u + v, p + v}) {
    mesh.positions.push_back({corner.x, corner.y, corner.z});
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

const Sha256 kTexture = sha256("a texture"), kSquare = sha256("a square texture");
constexpr const char* kSquareFile = "square";

/// 53×31 or 6×6 texels of hashed bytes.
Result<Texels> test_image(ByteView /*bytes*/, const std::string& name) {
  const bool square = name == kSquareFile;
  const int width = square ? 6 : 53, height = square ? 6 : 31;
  std::vector<std::uint32_t> bytes;
  for (int i = 0; i < width * height; ++i) {
    bytes.push_back(mix(static_cast<std::uint32_t>(i) + 1));
  }
  return Texels{width, height, std::move(bytes), {}, false};
}

struct TestScene {
  Scene scene;
  std::map<Sha256, std::string> assets;

  void add(std::uint32_t material, const Mesh& mesh) {
    std::string bytes = encode_mesh(mesh);
    const Sha256 digest = sha256(bytes);
    assets.emplace(digest, std::move(bytes));
    scene.objects.push_back({fmt::format("mesh {}", scene.objects.size()), material, MeshShape{"", digest}});
  }
  void add(std::uint32_t material, const SphereShape& sphere) {
    scene.objects.push_back({fmt::format("sphere {}", scene.objects.size()), material, sphere});
  }
};

enum class Sky { color, image, square };

/// A light of each kind. `many` adds enough for the light BVH. With shadow catchers, the spread must be 180°.
void add_lights(TestScene& test, bool many, Sky sky_kind, double spread_degrees) {
  std::vector<Light>& lights = test.scene.lights;
  std::string profile =
      "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 3 1 2 0 0 0\n1 1 10\n0 40 130\n0 90 180\n900 800 7 900 400 5 900 20 0\n";
  const Sha256 digest = sha256(profile);
  test.assets.emplace(digest, std::move(profile));
  lights.push_back({"point", PointLight{{-1.5, 2.5, 1.5}, {3, 3, 3}}});
  lights.push_back({"ball", PointLight{{0.9, 2.2, 1.9}, {1, 2, 1}, 0.15}});
  lights.push_back({"sun", DirectionalLight{{-0.3, -1, -0.2}, {0.5f, 0.5f, 0.4f}}});
  lights.push_back({"sun's disk", DirectionalLight{{0.4, -1, 0.3}, {0.2f, 0.3f, 0.4f}, 20}});
  lights.back().hidden_from_camera = true;
  lights.push_back(
      {"disk", DiskLight{{-0.5, 2.4, 1.2}, {0.2, -1, -0.3}, {3, 2, 2}, 0.2, 0.1, {1, 0, 1}, spread_degrees}});
  lights.push_back(
      {"rectangle",
       DiskLight{{0.6, 2.3, 1.1}, {-0.1, -1, -0.2}, {1, 2, 2}, 0.1, 0.3, {1, 1, 0}, spread_degrees, true}});
  lights.push_back({"spot", SpotLight{{1.5, 2.5, 1.5}, {-1, -2, -1}, {9, 8, 7}, 35, 0.4}});
  lights.push_back({"wide spot", SpotLight{{-1.2, 2.5, 0.5}, {1, -2, 0}, {2, 3, 2}, 30, 0.6, 0.2}});
  lights.push_back({"cosine", CosinePowerLight{{0, 2.5, 0}, {0.3, -1, 0.2}, {2, 3, 4}, 7.5}});
  lights.push_back(
      {"ies", IesLight{{0, 2, 1.5}, {0.1, -1, 0}, {1, 0, 0.2}, {1, 1, 0.9f}, 0.8, "fingerprint.ies", digest}});
  EnvironmentLight sky;
  sky.radiance = {0.2f, 0.3f, 0.4f};
  if (sky_kind == Sky::image) {
    sky.has_image = true;
    sky.asset = kTexture;
    sky.rotation_degrees = 33;
  } else if (sky_kind == Sky::square) {
    sky.has_image = sky.equal_area = true;
    sky.file = kSquareFile;
    sky.asset = kSquare;
    sky.orientation = {{{0.6, 0, 0.8}, {0, -1, 0}, {-0.8, 0, 0.6}}};
  }
  lights.push_back({"sky", sky});
  for (int i = 0; many && i < 30; ++i) {
    const double turn = 0.7 * i;
    lights.push_back({"one of many", PointLight{{1.8 * cos_fixed(turn), 0.2 + 0.09 * i, 1.8 * sin_fixed(turn)},
                                                {0.05f, 0.05f, 0.1f}}});
  }
}

Material worn_paint() {
  const auto of_kind = [](const auto& kind) {
    Material out;
    out.kind = kind;
    return out;
  };
  const auto part = [](const Material& material) { return std::make_shared<const Material>(material); };
  Material gloss = of_kind(PrincipledMaterial{{0.8f, 0.3f, 0.2f}, 0.5, 0.3});
  gloss.roughness_map = {0, ScalarMap::Channel::b};
  const Material dents = of_kind(MixtureMaterial{part(of_kind(MirrorMaterial{{0.7f, 0.8f, 0.9f}})),
                                                 part(of_kind(DiffuseMaterial{{0.1f, 0.2f, 0.3f}, 0.3})), 0.4});
  Material out = of_kind(MixtureMaterial{part(gloss), part(dents), 0.7, {1, ScalarMap::Channel::luminance}});
  out.name = "worn paint";
  return out;
}

/// Materials of each kind, with textures. An exponent of 0 makes the glow the same in all directions.
void add_materials(Scene& scene, double glow_exponent) {
  scene.materials = {
      {"white", DiffuseMaterial{{0.7f, 0.7f, 0.7f}}, {}, false},
      {"red", DiffuseMaterial{{0.6f, 0.1f, 0.05f}}, {}, false},
      {"mirror", MirrorMaterial{{0.9f, 0.8f, 0.7f}}, {}, false},
      {"glass", DielectricMaterial{1.5}, {}, false},
      {"lamp", DiffuseMaterial{{0.2f, 0.2f, 0.2f}}, {9, 8, 6}, false},
      {"glow", DiffuseMaterial{{0, 0, 0}}, {2, 3, 4}, true},
      {"phong", PhongMaterial{{0.3f, 0.4f, 0.2f}, {0.4f, 0.3f, 0.5f}, 37}, {}, false},
      {"gold", ConductorMaterial{{0.15f, 0.42f, 1.38f}, {3.6f, 2.5f, 1.9f}, 0.35}, {}, false},
      {"chrome", ConductorMaterial{{3.5f, 2.9f, 2.1f}, {4.3f, 4.2f, 3.9f}, 0}, {}, false},
      {"frosted", DielectricMaterial{1.4, 0.4}, {}, false},
      {"paint", PrincipledMaterial{{0.6f, 0.7f, 0.8f}, 0.3, 0.4, 0.6, 0.4, 1.6, 0.7, 0.2}, {}, false, {{0.5f, 1, 2}}},
      {"drop", DielectricMaterial{1.33}, {}, false, {{2, 0.3f, 0.1f}, {0.5f, 1, 2}, 0.4}, 1},
      {"tiles", DiffuseMaterial{{{0.9f, 0.8f, 0.7f}, 0}}, {}, false},
      {"print", DiffuseMaterial{{{0.7f, 0.8f, 0.9f}, 1}}, {}, false},
      {"shadow_catcher", ShadowCatcherMaterial{}, {}, false},
      {"gauze", DiffuseMaterial{{0.8f, 0.7f, 0.6f}}, {}, false},
      {"leaf", PhongMaterial{{0.2f, 0.5f, 0.2f}, {0.2f, 0.2f, 0.2f}, 5}, {}, false},
      {"dented", PrincipledMaterial{{0.9f, 0.8f, 0.7f}, 0.2, 0.4, 0.6, 0.5, 1.5, 0.6, 0.1, true}, {}, false},
      {"hammered", MirrorMaterial{{0.8f, 0.9f, 0.9f}}, {}, false},
      {"brushed", ConductorMaterial{{3.5f, 2.9f, 2.1f}, {4.3f, 4.2f, 3.9f}, 0.25, {0.7, 35}}, {}, false},
      {"velvet",
       PrincipledMaterial{.base_color = {0.5f, 0.1f, 0.2f},
                          .metallic = 0.2,
                          .roughness = 0.6,
                          .transmission = 0.3,
                          .coat = 0.3,
                          .anisotropy = {0.5, -20},
                          .sheen_color = {{0.9f, 0.8f, 0.7f}, 1},
                          .sheen_roughness = 0.25,
                          .specular_color = {{0.9f, 0.6f, 0.8f}, 1},
                          .inner_reflectance = 0.4,
                          .specular_map = {0, ScalarMap::Channel::r},
                          .transmission_map = {0, ScalarMap::Channel::g},
                          .coat_map = {0, ScalarMap::Channel::b},
                          .coat_roughness_map = {0, ScalarMap::Channel::alpha},
                          .sheen_roughness_map = {2, ScalarMap::Channel::r}},
       {},
       false},
      {"chalk", DiffuseMaterial{{0.9f, 0.8f, 0.6f}, 0.8}, {}, false},
      {"clay", DiffuseMaterial{{0.6f, 0.7f, 0.9f}, 0.5}, {}, false},
      worn_paint(),
      {"paper", DiffuseMaterial{{0.3f, 0.4f, 0.2f}, 0, {{0.2f, 0.5f, 0.1f}, 0}}, {}, false},
      {"skin",
       PrincipledMaterial{.base_color = {0.8f, 0.5f, 0.4f},
                          .metallic = 0.1,
                          .roughness = 0.35,
                          .transmission = 0.1,
                          .ior = 1.4,
                          .coat = 0.2,
                          .sheen_color = {0.2f, 0.3f, 0.4f},
                          .transmittance = {{0.7f, 0.8f, 0.9f}, 0}},
       {},
       false,
       {{0.3f, 0.5f, 0.7f}, {2, 1.5f, 1}, 0.2}},
      {"petal",
       PrincipledMaterial{
           .base_color = {0.6f, 0.2f, 0.4f}, .burley_diffuse = true, .transmittance = {0.4f, 0.3f, 0.5f}},
       {},
       false},
  };
  scene.materials[5].emission_exponent = glow_exponent;
  scene.materials[5].light_group = "key";
  scene.materials[9].single_scattering = true;
  scene.materials[7].roughness_map = {0, ScalarMap::Channel::g};
  scene.materials[10].metallic_map = {1, ScalarMap::Channel::luminance};
  scene.materials[12].normal_map = {1, 0.4};
  scene.materials[13].bump_map = {{0, ScalarMap::Channel::r}, 0.05};
  scene.materials[15].opacity = {Opacity::Mode::blend, 0.6};
  scene.materials[16].opacity = {Opacity::Mode::mask, 0.9, {0, ScalarMap::Channel::alpha}, 0.4};
  scene.materials[17].normal_map = {1, 0.8};
  scene.materials[18].bump_map = {{0, ScalarMap::Channel::luminance}, -0.1};
  scene.materials[21].roughness_map = {1, ScalarMap::Channel::r};
  scene.materials[22].single_scattering = true;
  using Image = TextureImage;
  constexpr std::array kClamped{Image::Wrap::clamp, Image::Wrap::clamp};
  scene.textures = {
      {"tiles", "", kTexture, Image::Filter::bilinear, {}, Image::ColorSpace::srgb, {1.3, 0.7}, 20},
      {"print", "", kTexture, Image::Filter::nearest, kClamped, Image::ColorSpace::linear, {1, 1}, -35},
      {"tile", "", kTexture, Image::Filter::bilinear, {}, Image::ColorSpace::linear, {2, 2}},
      {"tile beside it", "", kTexture},
  };
  scene.textures[2].tile = 1001;
  scene.textures[3].tile = 1012;
  scene.textures[3].tile_of = 2;
}

void add_room(TestScene& test) {
  test.add(0, quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}));  // floor
  test.add(1, quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}));  // a second floor in the same place, for ties
  test.add(0, quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}));  // back
  Mesh left = quad({-2, 0, -2}, {0, 3, 0}, {0, 0, 4});
  left.colors = {{1, 0.5f, 0.25f, 1}, {0.25f, 1, 0.5f, 1}, {1, 1, 0.75f, 1}, {0.5f, 0.25f, 1, 1}};
  test.add(1, left);
  test.add(4, quad({-0.5, 2.9, -0.5}, {1, 0, 0}, {0, 0, 1}));
  test.add(0, bumpy_sphere(-1.0, 0.6, -0.8, 0.6));
  test.add(3, bumpy_sphere(1.2, 0.5, -1.0, 0.4));
  test.add(2, SphereShape{{0.9, 0.5, -0.1}, 0.5, false});
  test.add(3, SphereShape{{-0.3, 0.45, 0.7}, 0.45, false});
  test.add(5, SphereShape{{1.6, 2.0, -1.4}, 0.2, false});
  test.add(6, SphereShape{{-1.5, 0.25, 0.4}, 0.25, false});
  test.add(7, SphereShape{{-0.9, 0.2, 1.1}, 0.2, false});
  test.add(8, SphereShape{{-1.6, 1.9, -1.2}, 0.3, false});
  test.add(9, SphereShape{{0.4, 0.25, 1.2}, 0.25, false});
  test.add(10, SphereShape{{1.3, 0.3, 0.9}, 0.3, false});
  test.add(11, SphereShape{{1.35, 0.35, 1.1}, 0.2, false});  // overlaps the sphere before
  test.add(21, SphereShape{{-0.4, 0.15, 1.4}, 0.15, false});
  test.add(22, SphereShape{{0.8, 0.15, 1.5}, 0.15, false});
  test.add(23, SphereShape{{0.1, 0.2, 1.7}, 0.2, false});
  test.add(24, quad({-0.9, 0.1, 0.2}, {0.5, 0.1, 0.3}, {-0.1, 0.6, 0.1}));
  test.add(25, SphereShape{{-1.1, 0.15, 1.6}, 0.15, false});
  test.add(26, quad({0.9, 0.2, 0.3}, {0.3, 0.1, 0.3}, {-0.1, 0.4, 0.1}));
  test.scene.objects.push_back({"ground", 12, PlaneShape{{0, -0.3, 0}, {0.1, 1, 0.05}}});
  test.scene.objects.push_back({"card", 13, TriangleShape{{-0.6, 1.4, 0}, {0.6, 1.5, 0.1}, {0, 2.2, 0}}});
}

/// Surfaces that rays pass, anisotropic surfaces with tangents and with texture coordinates, an instance of a mesh with
/// tangents, and two of another mesh, one mirrored.
void add_sheets_and_instances(TestScene& test, bool shadow_catcher) {
  Mesh gauze = quad({-1.4, 0.3, 1.3}, {2.3, -0.1, 0.3}, {0.6, 1.9, -0.2});
  gauze.colors = {{1, 1, 1, 0.5f}, {1, 0.5f, 1, 1}, {1, 1, 0, 0.25f}, {0, 1, 1, 0.75f}};
  test.add(15, gauze);
  test.add(16, SphereShape{{0.2, 1.9, -0.6}, 0.4, false});
  test.scene.objects.push_back({"leaf", 16, TriangleShape{{-1.9, 0.8, 0.1}, {-0.9, 1.1, 0.4}, {-1.3, 1.9, -0.3}}});
  if (shadow_catcher) {
    test.scene.objects.push_back({"catcher", 14, TriangleShape{{0.3, 0.05, 1.8}, {1.1, 0.02, 1.7}, {0.5, 0.1, 1.1}}});
  }
  Mesh bent = quad({-0.2, 0.7, 1.0}, {0.5, 0.1, 0}, {0, 0.5, -0.2});
  bent.texture_coordinates = {{0, 0}, {1, 0.1f}, {1, 1}, {0.1f, 1}};
  test.add(17, bent);
  test.scene.objects.back().transform = {{{-1, 0, 0, -0.6}, {0, 1, 0, 0.5}, {0, 0, 1, 0}}};
  bent.tangents.assign(4, {0.8f, 0, 0.6f, -1});
  test.add(18, bent);
  test.add(19, bent);
  test.scene.objects.back().transform = {{{0.9, 0.1, 0, -0.7}, {0, 0.8, 0.2, 0.9}, {0.1, 0, 1, -0.2}}};
  Mesh cloth = bumpy_sphere(-0.1, 1.4, -1.2, 0.35);
  for (const auto& p : cloth.positions) {
    cloth.texture_coordinates.push_back({static_cast<float>(2 * p[0]), static_cast<float>(p[1])});
  }
  test.add(20, cloth);
  test.add(19, cloth);
  test.scene.objects.back().transform = {{{-0.7, 0, 0, 1.1}, {0, 0.8, 0.1, 0.7}, {0, 0, 0.9, 0.9}}};
  const Mesh shared = bumpy_sphere(0, 0, 0, 1);  // two instances, one mirrored
  test.add(0, shared);
  test.scene.objects.back().transform = {{{0.2, 0.05, 0, 0.6}, {0, 0.3, 0, 1.7}, {0, 0, 0.25, -1}}};
  test.add(2, shared);
  test.scene.objects.back().transform = {{{-0.25, 0, 0, 1.5}, {0, 0.2, 0.05, 1.2}, {0, 0, 0.2, -0.2}}};
}

TestScene make_test_scene(const Rendered& rendered) {
  const bool box = rendered.filter == FilterKind::box, tent = rendered.filter == FilterKind::tent;
  TestScene test;
  Scene& scene = test.scene;
  scene.camera = {{0.1, 1.2, 4.1}, {0, 0.9, 0}, {0, 1, 0}, 50};
  scene.film = {rendered.side, rendered.side, {rendered.filter, box ? 0.5 : 1.5}};
  add_materials(scene, box ? 0 : 1.5);
  if (tent) {
    scene.camera.lens_radius = 0.1;
    scene.materials[13].emission = {{0.9f, 0.8f, 0.7f}, 0};
    scene.materials[13].two_sided_emission = true;
  }
  add_room(test);
  add_sheets_and_instances(test, box);
  scene.meters = {{"meter", PatchMeter{{{-1, 0.2, -1}, {0, 0, 0.7}, {0.9, 0.1, 0}}}}};
  const Sky sky = box ? Sky::image : rendered.filter == FilterKind::gaussian ? Sky::square : Sky::color;
  add_lights(test, !box, sky, box ? 180 : 120);
  for (std::uint32_t material = 0; box && material < scene.materials.size(); ++material) {
    LM_CHECK(std::ranges::count(scene.objects, material, &Object::material) > 0, "no object has the material {}",
             material);
  }
  return test;
}

std::shared_ptr<const CompiledScene> compiled(const TestScene& test) {
  const auto asset = [&](const Sha256& digest) -> Result<std::string> {
    return digest == kTexture || digest == kSquare ? std::string() : test.assets.at(digest);
  };
  auto scene = CompiledScene::compile(test.scene, asset, test_image);
  if (scene.status().code() == StatusCode::kResourceExhausted) {
    throw std::bad_alloc();
  }
  LM_CHECK(scene.ok(), "the built-in test scene does not compile: {}", message_of(scene.status()));
  return *std::move(scene);
}

void append_samples(const std::shared_ptr<const CompiledScene>& scene, const std::string& text, SampleRange range,
                    Xxh3Hasher& hasher) {
  const std::string name = parse_method(text)->name;
  const auto method = make_method(scene, {text, 1, 0, all_layers(name, scene->light_groups())});
  LM_CHECK(method.ok(), "{}", message_of(method.status()));
  const auto workspace = (*method)->make_workspace();
  const PixelRect film{0, 0, scene->film_width(), scene->film_height()};
  const Node node = (*method)->render(film, range, *workspace);
  hasher.append(std::as_bytes(std::span(node.values)));
  if (method_reads_meters(name)) {
    const PixelRect first = meter_rect(0), part{first.x, first.y, film.width, film.height};
    const Node meter = (*method)->render(part, {0, 0}, *workspace);
    hasher.append(std::as_bytes(std::span(meter.values)));
  }
}

}  // namespace

std::string fingerprint_class() {
  Xxh3Hasher hasher;
  for (const Rendered& rendered : kRendered) {
    TestScene test = make_test_scene(rendered);
    const bool box = rendered.filter == FilterKind::box;
    const std::shared_ptr<const CompiledScene> scene = compiled(test);
    for (Material& material : test.scene.materials) {
      material.interior.scattering = {};
    }
    // For `vcm`, which refuses media that scatter.
    const std::shared_ptr<const CompiledScene> clear = box ? compiled(test) : nullptr;
    for (const std::string_view name : method_names()) {
      if (name == kAutoMethod) {
        continue;
      }
      if (shared_samples(*parse_method(name)) == 0) {
        append_samples(scene, name == "ao" ? "ao:distance=1" : std::string(name), rendered.range, hasher);
      } else if (box) {
        append_samples(name == "vcm" ? clear : scene, fmt::format("{}:photons=1000", name), {0, 0}, hasher);
      }
    }
  }
  return hasher.finish().hex().substr(0, 16);
}

}  // namespace lightmill
