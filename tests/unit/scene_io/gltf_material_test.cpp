// Materials and textures of glTF files.
#include "common/scene/mesh.h"
#include "tests/unit/scene_io/gltf_fixture.h"

namespace lightmill {
namespace {

using test::error;
using test::good;
using test::kOneNode;
using test::kPng;
using test::material;
using test::OneTriangle;
using test::read;

TEST(GltfScene, MetallicRoughnessIsPrincipled) {
  std::vector<std::string> notices;
  const Material gold = material(
      R"("name":"gold","pbrMetallicRoughness":{"baseColorFactor":[1,0.75,0.25,1],"metallicFactor":0.5,
"roughnessFactor":0.25},"emissiveFactor":[0.5,0,0],"doubleSided":true,"extensions":{
"KHR_materials_emissive_strength":{"emissiveStrength":8},"KHR_materials_ior":{"ior":1.25},
"KHR_materials_clearcoat":{"clearcoatFactor":0.75,"clearcoatRoughnessFactor":0.125},
"KHR_materials_specular":{"specularFactor":0.5}})",
      &notices);
  EXPECT_EQ(gold.name, "gold");
  const auto& p = std::get<PrincipledMaterial>(gold.kind);
  EXPECT_EQ(p.base_color.rgb, (RgbColor{1, 0.75f, 0.25f}));
  EXPECT_EQ(p.base_color.texture, kNoTexture);
  EXPECT_EQ(p.metallic, 0.5);
  EXPECT_EQ(p.roughness, 0.25);
  EXPECT_EQ(p.specular, 0.25);
  EXPECT_EQ(p.transmission, 0);
  EXPECT_EQ(p.ior, 1.25);
  EXPECT_EQ(p.coat, 0.75);
  EXPECT_EQ(p.coat_roughness, 0.125);
  EXPECT_EQ(gold.emission.rgb, (RgbColor{4, 0, 0}));
  EXPECT_TRUE(gold.two_sided_emission);
  EXPECT_EQ(notices, std::vector<std::string>{
                         "there is no camera: one was added that sees all from the front, above and right (--camera "
                         "chooses another)"});
  const Material matt =
      material(R"("extensions":{"KHR_materials_specular":{"specularColorFactor":[0,0,0]}})", &notices);
  EXPECT_EQ(std::get<PrincipledMaterial>(matt.kind).specular_color, RgbColor{});  // only grazing light is reflected
  EXPECT_EQ(notices.size(), 1u);
  const Material tinted =
      material(R"("extensions":{"KHR_materials_specular":{"specularColorFactor":[2,1,0]}})", &notices);
  // f0 is 0.04 (2, 1, 0): the index has twice the reflectance of 1.5.
  const auto& red = std::get<PrincipledMaterial>(tinted.kind);
  EXPECT_NEAR(red.specular, 0.5, 1e-9);
  EXPECT_EQ(red.specular_color, (RgbColor{1, 0.5f, 0}));
  EXPECT_NEAR(std::pow((red.ior - 1) / (red.ior + 1), 2), 0.08, 1e-9);
  EXPECT_EQ(notices.size(), 1u);
  const Material dim = material(
      R"("extensions":{"KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[0.5,0.25,0]}})", &notices);
  const auto& half = std::get<PrincipledMaterial>(dim.kind);
  EXPECT_EQ(std::tuple(half.specular, half.ior), std::tuple(0.25, 1.5));
  EXPECT_EQ(half.specular_color, (RgbColor{0.5f, 0.25f, 0}));
  // Some programs write a large index instead of 0.
  const Material large = material(R"("extensions":{"KHR_materials_ior":{"ior":1000}})", &notices);
  const auto& shiny = std::get<PrincipledMaterial>(large.kind);
  EXPECT_NEAR(std::pow((shiny.ior - 1) / (shiny.ior + 1), 2) * 2 * shiny.specular, 0.996, 1e-3);
  EXPECT_EQ(notices.size(), 1u);
  // The format's defaults, for a material without members.
  const Material plain = material("");
  const auto& d = std::get<PrincipledMaterial>(plain.kind);
  EXPECT_EQ(d.base_color.rgb, (RgbColor{1, 1, 1}));
  EXPECT_EQ(d.metallic, 1);
  EXPECT_EQ(d.roughness, 1);
  EXPECT_EQ(d.specular, 0.5);
  EXPECT_EQ(d.ior, 1.5);
  EXPECT_EQ(d.coat, 0);
  EXPECT_EQ(plain.emission.rgb, RgbColor{});
}

// KHR_materials_ior with 0: all light is reflected, reduced only by KHR_materials_specular's factors. Converted
// materials of specular and glossiness have this form.
TEST(GltfScene, AnIndexOfZeroReflectsByTheSpecularFactors) {
  // The principled material's reflectances at normal incidence and at grazing angles.
  const auto reflectances = [](const std::string& specular, std::vector<std::string>* notices = nullptr) {
    const Material made = material(
        R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":0})" + specular + "}",
        notices);
    const auto& p = std::get<PrincipledMaterial>(made.kind);
    EXPECT_LE(p.ior, kMaxIor);
    EXPECT_LE(p.specular, 1);
    const double f0 = std::pow((p.ior - 1) / (p.ior + 1), 2) * 2 * p.specular * p.specular_color.rgb.r;
    return std::pair(f0, std::min(2 * p.specular, 1.0));
  };
  const auto expect = [](std::pair<double, double> got, double f0, double f90) {
    EXPECT_NEAR(got.first, f0, 1e-6);
    EXPECT_NEAR(got.second, f90, 1e-3);
  };
  expect(reflectances(""), 1, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[0.25,0.25,0.25]})"), 0.25, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[0.9,0.9,0.9]})"), 0.9, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[0.25,0.25,0.25]})"),
         0.125, 0.5);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[2,1,0.5]})"), 1, 1);
  expect(reflectances(R"(,"KHR_materials_specular":{"specularColorFactor":[0,0,0]})"), 0, 1);
  std::vector<std::string> notices;
  reflectances(R"(,"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_volume":{"thicknessFactor":1})",
               &notices);
  EXPECT_EQ(notices[0], "left out: an index of refraction of 0 where light is transmitted: it is 1.5");
}

TEST(GltfScene, ImagesOfExtensionsAreReadIfTheirFormatIsDecoded) {
  const auto of = [](const std::string& texture, std::vector<std::string>& notices) {
    const Result<LoadedScene> loaded =
        read(OneTriangle().text(kOneNode + fmt::format(R"(,"images":[{{"bufferView":2}}],"textures":[{}],"materials":[
{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.5,0.5,1],"baseColorTexture":{{"index":0}}}}}}])",
                                                       texture),
                                R"(,"material":0)"),
             false);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    notices = loaded.ok() ? loaded->notices : std::vector<std::string>{};
    return loaded.ok() ? std::get<PrincipledMaterial>(loaded->scene.materials.at(0).kind).base_color : TexturedColor{};
  };
  std::vector<std::string> notices;
  for (const char* extension : {"EXT_texture_webp", "MSFT_texture_dds"}) {
    EXPECT_EQ(of(fmt::format(R"({{"extensions":{{"{}":{{"source":0}}}}}})", extension), notices).texture, 0u);
    EXPECT_EQ(notices.size(), 1u) << extension;  // of the camera
  }
  EXPECT_EQ(of(R"({"extensions":{"KHR_texture_basisu":{"source":0}}})", notices),
            (TexturedColor{{0.5f, 0.5f, 0.5f}, kNoTexture}));
  EXPECT_EQ(notices[0], "left out: textures whose only image is of KHR_texture_basisu");
  of(R"({"extensions":{"OTHER_texture":{}}})", notices);
  EXPECT_EQ(notices[0], "left out: textures whose only image is of unknown extensions");
  // A fallback image for readers without the extension is used.
  EXPECT_EQ(of(R"({"source":0,"extensions":{"EXT_texture_webp":{"source":7}}})", notices).texture, 0u);
  EXPECT_EQ(notices.size(), 1u);  // of the camera
}

TEST(GltfScene, TexturesAreScaledThenRotatedThenMoved) {
  const Result<LoadedScene> loaded = read(OneTriangle().text(
      kOneNode +
          R"(,"images":[{"bufferView":2}],"textures":[{"source":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":
{"index":0,"extensions":{"KHR_texture_transform":{"scale":[2,3],"rotation":1.5707963267948966,"offset":[0.5,0.25]}}}}}])",
      R"(,"material":0)"));
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  // v grows downwards. (1, 0.5) is scaled to (2, 1.5), turned counter-clockwise to (1.5, −2), and moved.
  const auto [u, v] = test::mapped_coordinates(loaded->scene.textures.at(0), 1, 1 - 0.5);
  EXPECT_NEAR(u, 1.5 + 0.5, 1e-12);
  EXPECT_NEAR(1 - v, -2 + 0.25, 1e-12);
}

/// The only mesh and material of a file with a normal map, and tangents.
struct Mapped {
  Mesh mesh;
  Material material;
  TextureImage texture;
  std::vector<std::string> notices, faults;
};
Mapped mapped(const std::string& members, const std::vector<float>& tangents = {1, 0, 0, 1, 0, 2, 0, -1, 0, 0, 1, 1}) {
  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  buffer.add(test::packed<float>({0, 0, 1, 0, 0, 1}), "VEC2", 5126, 3);
  buffer.add(kPng, "SCALAR", 5121, kPng.size());
  buffer.add(test::packed(tangents), "VEC4", 5126, 3);
  const Result<LoadedScene> loaded = read(
      test::gltf(fmt::format(
          R"({},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1,"TANGENT":3}},"material":0}}]}}],
"nodes":[{{"mesh":0}}],"samplers":[{{"wrapS":33071,"wrapT":33648}}],
"images":[{{"bufferView":2}}],"textures":[{{"source":0,"sampler":0}}],"materials":[{{{}}}])",
          buffer.embedded(), members)),
      false);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  const Scene& scene = loaded->scene;
  const auto& shape = std::get<MeshShape>(scene.objects.at(0).shape);
  return {*decode_mesh(as_byte_view(loaded->assets.at(shape.asset))), scene.materials.at(0),
          scene.textures.empty() ? TextureImage{} : scene.textures[0], loaded->notices, loaded->faults.notices()};
}

TEST(GltfScene, NormalTexturesAreNormalMaps) {
  const Mapped plain = mapped(R"("normalTexture":{"index":0})");
  EXPECT_EQ(plain.material.normal_map, (NormalMap{0, 1}));
  EXPECT_EQ(plain.texture.color_space, TextureImage::ColorSpace::linear);
  EXPECT_EQ(plain.texture.wrap, (std::array{TextureImage::Wrap::clamp, TextureImage::Wrap::mirror}));
  EXPECT_EQ(plain.notices.size(), 1u);  // of the camera
  const Mapped placed = mapped(
      R"("normalTexture":{"index":0,"scale":-0.5,"extensions":{"KHR_texture_transform":{"scale":[2,3],"offset":[0.25,0]}}})");
  EXPECT_EQ(placed.material.normal_map, (NormalMap{0, -0.5}));
  EXPECT_EQ(placed.texture.scale, (std::array{2.0, 3.0}));
  EXPECT_EQ(placed.texture.offset, (std::array{0.25, -2.0}));
  const Mapped coated =
      mapped(R"("normalTexture":{"index":0},"extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":1}})");
  EXPECT_EQ(coated.notices[0], "normal maps also change the normals of clearcoats");
  // The colour's texture is another one: it is not data.
  const Mapped both = mapped(R"("pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"normalTexture":{"index":0})");
  EXPECT_EQ(both.material.normal_map.texture, 1u);
  EXPECT_EQ(both.texture.color_space, TextureImage::ColorSpace::srgb);
}

TEST(GltfScene, TangentsAreThoseOfTheFile) {
  const Mapped given = mapped(R"("normalTexture":{"index":0})");
  EXPECT_EQ(given.mesh.tangents, (std::vector<std::array<float, 4>>{{1, 0, 0, 1}, {0, 1, 0, -1}, {0, 0, 1, 1}}));
  EXPECT_TRUE(mapped("").mesh.tangents.empty());
  const Mapped broken = mapped(R"("normalTexture":{"index":0})", {1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1});
  EXPECT_TRUE(broken.mesh.tangents.empty());
  EXPECT_EQ(broken.faults,
            std::vector<std::string>{"a.gltf: meshes[0].primitives[0].attributes.TANGENT: 1 tangent "
                                     "without a direction. The tangents of the texture coordinates are used"});
}

TEST(GltfScene, AnisotropyIsThatOfTheExtension) {
  const auto extension = [](const std::string& members, const std::string& others = "") {
    return R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_anisotropy":{)" + members + "}" +
           others + "}";
  };
  const Mapped brushed = mapped(extension(R"("anisotropyStrength":0.5,"anisotropyRotation":1.5707963267948966)"));
  const auto& kind = std::get<PrincipledMaterial>(brushed.material.kind);
  EXPECT_EQ(kind.anisotropy.strength, 0.5);
  EXPECT_NEAR(kind.anisotropy.rotation_degrees, 90, 1e-9);
  EXPECT_EQ(kind.roughness, 1);
  EXPECT_EQ(brushed.mesh.tangents.size(), 3u);
  EXPECT_EQ(brushed.mesh.texture_coordinates.size(), 3u);
  EXPECT_EQ(brushed.notices.size(), 1u);  // of the camera
  const Mapped none = mapped(extension(R"("anisotropyRotation":1)"));
  EXPECT_EQ(std::get<PrincipledMaterial>(none.material.kind).anisotropy, Anisotropy{});
  EXPECT_TRUE(none.mesh.tangents.empty());
  EXPECT_TRUE(none.mesh.texture_coordinates.empty());
  EXPECT_EQ(mapped(extension(R"("anisotropyStrength":0.5,"anisotropyTexture":{"index":0})")).notices[0],
            "left out: textures of anisotropy: it is the same everywhere");
  EXPECT_EQ(mapped(extension(R"("anisotropyStrength":0.5)",
                             R"(,"KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_volume":{
"thicknessFactor":1})"))
                .notices[0],
            "left out: anisotropy of glass");
}

TEST(GltfScene, AnisotropyWithoutADirectionIsNamed) {
  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const LoadedScene loaded =
      good(test::gltf(buffer.embedded() +
                      R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"nodes":[{"mesh":0}],
"materials":[{"extensions":{"KHR_materials_anisotropy":{"anisotropyStrength":1}}}])"));
  EXPECT_EQ(loaded.notices[0], "anisotropic surfaces without tangents and texture coordinates have the mean roughness");
}

TEST(GltfScene, DiffuseTransmissionIsAMixtureWithAThinSheet) {
  const auto extension = [](const std::string& members, double metallic) {
    return fmt::format(
        R"("pbrMetallicRoughness":{{"metallicFactor":{},"roughnessFactor":0.5,"metallicRoughnessTexture":{{"index":0}}}},
"extensions":{{"KHR_materials_diffuse_transmission":{{{}}}}})",
        metallic, members);
  };
  const Mapped leaf = mapped(extension(
      R"("diffuseTransmissionFactor":0.5,"diffuseTransmissionColorFactor":[0.25,0.5,0.75],"diffuseTransmissionTexture":{"index":0})",
      0));
  const auto& mixture = std::get<MixtureMaterial>(leaf.material.kind);
  EXPECT_EQ(mixture.factor, 0.5);
  EXPECT_EQ(mixture.map, (ScalarMap{0, ScalarMap::Channel::alpha}));
  EXPECT_EQ(std::get<PrincipledMaterial>(mixture.first->kind).specular, 1) << "twice as bright on half of the light";
  EXPECT_EQ(mixture.first->roughness_map.texture, 0u);
  const auto& sheet = std::get<DiffuseMaterial>(mixture.second->kind);
  EXPECT_EQ(sheet.transmittance.rgb, (RgbColor{0.25f, 0.5f, 0.75f}));
  EXPECT_EQ(sheet.reflectance.rgb, (RgbColor{0, 0, 0}));
  EXPECT_EQ(leaf.material.roughness_map.texture, kNoTexture);
  const Mapped metal = mapped(extension(R"("diffuseTransmissionFactor":0.5)", 1));
  EXPECT_TRUE(std::holds_alternative<PrincipledMaterial>(metal.material.kind));
}

TEST(GltfScene, SheenIsThatOfTheExtension) {
  const auto extension = [](const std::string& members, const std::string& others = "") {
    return R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_sheen":{)" + members + "}" +
           others + "}";
  };
  const Mapped velvet = mapped(
      extension(R"("sheenColorFactor":[0.25,0.5,0.75],"sheenRoughnessFactor":0.3,"sheenColorTexture":{"index":0})"));
  const auto& kind = std::get<PrincipledMaterial>(velvet.material.kind);
  EXPECT_EQ(kind.sheen_color, (TexturedColor{{0.25f, 0.5f, 0.75f}, 0}));
  EXPECT_EQ(kind.sheen_roughness, 0.3);
  EXPECT_EQ(velvet.texture.color_space, TextureImage::ColorSpace::srgb);
  EXPECT_EQ(velvet.notices.size(), 1u);  // of the camera
  const Material sharp = material(extension(R"("sheenColorFactor":[1,1,1])"));
  EXPECT_EQ(std::get<PrincipledMaterial>(sharp.kind).sheen_roughness, 0);
  const Mapped black = mapped(extension(R"("sheenRoughnessFactor":0.3,"sheenColorTexture":{"index":0})"));
  EXPECT_EQ(std::get<PrincipledMaterial>(black.material.kind).sheen_color, TexturedColor{});
  EXPECT_TRUE(black.mesh.texture_coordinates.empty());
  const Mapped rough =
      mapped(extension(R"("sheenColorFactor":[1,1,1],"sheenRoughnessFactor":0.5,"sheenRoughnessTexture":{"index":0})"));
  EXPECT_EQ(std::get<PrincipledMaterial>(rough.material.kind).sheen_roughness_map,
            (ScalarMap{0, ScalarMap::Channel::alpha}));
  EXPECT_EQ(rough.texture.color_space, TextureImage::ColorSpace::linear);
  EXPECT_EQ(mapped(extension(R"("sheenColorFactor":[1,1,1])",
                             R"(,"KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_volume":{
"thicknessFactor":1})"))
                .notices[0],
            "left out: sheen of glass");
}

TEST(GltfScene, TheSpecularFactorOfGlassIsIgnoredWithANotice) {
  for (const auto& [members, is_named] : {std::pair(R"("specularFactor":0.5)", true),
                                          {R"("specularColorFactor":[1,0.5,0.5])", true},
                                          {R"("specularTexture":{"index":0})", true},
                                          {R"("specularFactor":1)", false}}) {
    const Mapped glass = mapped(
        fmt::format(R"("pbrMetallicRoughness":{{"metallicFactor":0}},"extensions":{{"KHR_materials_specular":{{{}}},
"KHR_materials_transmission":{{"transmissionFactor":1}},"KHR_materials_volume":{{"thicknessFactor":1}}}})",
                    members));
    EXPECT_EQ(std::ranges::count(glass.notices, "left out: specular factor and colour of glass"), is_named) << members;
  }
}

TEST(GltfScene, TexturesOfExtensionsAreMaps) {
  using enum ScalarMap::Channel;
  const auto kind_of = [](const std::string& extensions) {
    return std::get<PrincipledMaterial>(
        mapped(R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{)" + extensions + "}").material.kind);
  };
  const PrincipledMaterial coat = kind_of(
      R"("KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatRoughnessFactor":1,"clearcoatTexture":{"index":0},"clearcoatRoughnessTexture":{"index":0}})");
  EXPECT_EQ(coat.coat_map, (ScalarMap{0, r}));
  EXPECT_EQ(coat.coat_roughness_map, (ScalarMap{0, g}));
  EXPECT_EQ(kind_of(R"("KHR_materials_clearcoat":{"clearcoatTexture":{"index":0}})").coat_map, ScalarMap{})
      << "no coat";
  EXPECT_EQ(kind_of(R"("KHR_materials_transmission":{"transmissionFactor":1,"transmissionTexture":{"index":0}})")
                .transmission_map,
            (ScalarMap{0, r}));
  EXPECT_EQ(kind_of(R"("KHR_materials_specular":{"specularTexture":{"index":0}})").specular_map, (ScalarMap{0, alpha}));
}

TEST(GltfScene, VolumesAbsorb) {
  const Material amber = material(
      R"("pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_transmission":{"transmissionFactor":1},
"KHR_materials_volume":
{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[1,0.5,0]}})");
  EXPECT_EQ(std::get<PrincipledMaterial>(amber.kind).transmission, 1);
  EXPECT_EQ(amber.interior.absorption.r, 0);
  EXPECT_NEAR(amber.interior.absorption.g, std::numbers::ln2 / 2, 1e-6);  // half of it is left after 2
  EXPECT_GT(amber.interior.absorption.b, 1e20f);
  std::vector<std::string> notices;
  const std::string half = R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":0.5}})";
  material(R"("pbrMetallicRoughness":{"metallicFactor":0},)" + half, &notices);
  EXPECT_EQ(notices[0], "materials that transmit without a volume are rendered as solid glass: light is refracted");
  material(half, &notices);  // a metal: nothing gets in
  EXPECT_EQ(notices.size(), 1u);
}

TEST(GltfScene, UnlitMaterialsEmit) {
  const Material unlit =
      material(R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,1,0,1]},"extensions":{"KHR_materials_unlit":{}})");
  EXPECT_EQ(unlit.emission.rgb, (RgbColor{0.5f, 1, 0}));
  EXPECT_TRUE(unlit.two_sided_emission);
  EXPECT_EQ(std::get<DiffuseMaterial>(unlit.kind).reflectance.rgb, RgbColor{});
}

TEST(GltfScene, AlphaIsTheOpacityThatTheModeSays) {
  using enum Opacity::Mode;
  const std::string base = R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25],"metallicFactor":0})";
  struct Case {
    std::string more;
    Opacity expected;
    std::string notice = {};
  };
  for (const Case& c : std::vector<Case>{
           {"", {}},  // alpha is ignored
           {R"(,"alphaMode":"OPAQUE")", {}},
           {R"(,"alphaMode":"BLEND")", {blend, 0.25}},
           {R"(,"alphaMode":"MASK")", {mask, 0.25, {}, 0.5}},
           {R"(,"alphaMode":"MASK","alphaCutoff":0.125)", {mask, 0.25, {}, 0.125}},
           {R"(,"alphaMode":"MASK","alphaCutoff":1.5)", {blend, 0}},  // no alpha reaches it
           {R"(,"alphaMode":"BLEND","extensions":{"KHR_materials_unlit":{}})", {blend, 0.25}},
           {R"(,"alphaMode":"DITHER")",
            {},
            R"(OPAQUE, MASK or BLEND is expected, got "DITHER". The material is rendered opaque)"},
           {R"(,"alphaMode":"BLEND","extensions":{"KHR_materials_transmission":{"transmissionFactor":1}})",
            {},
            "left out: alpha of materials that transmit light"}}) {
    const LoadedScene loaded = good(
        OneTriangle().text(kOneNode + fmt::format(R"(,"materials":[{{{}{}}}])", base, c.more), R"(,"material":0)"));
    const Opacity& opacity = loaded.scene.materials.at(0).opacity;
    EXPECT_EQ(opacity.mode, c.expected.mode) << c.more;
    EXPECT_EQ(opacity.value, c.expected.value) << c.more;
    EXPECT_EQ(opacity.cutoff, c.expected.cutoff) << c.more;
    std::vector<std::string> said = loaded.notices;
    const std::vector<std::string> faults = loaded.faults.notices();
    said.insert(said.end(), faults.begin(), faults.end());
    EXPECT_EQ(std::ranges::any_of(said, [&](const std::string& n) { return n.ends_with(c.notice); }), true) << c.more;
    EXPECT_EQ(std::ranges::any_of(said, [](const auto& n) { return n.find("lpha") != n.npos; }), !c.notice.empty())
        << c.more;
  }
}

TEST(GltfScene, AlphaOfTheBaseColourTextureMultipliesTheOpacity) {
  const LoadedScene loaded = good(OneTriangle().text(
      kOneNode + R"(,"images":[{"bufferView":2}],"textures":[{"source":0}],"materials":[{"alphaMode":"MASK",
"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
      R"(,"material":0)"));
  const Opacity& opacity = loaded.scene.materials.at(0).opacity;
  EXPECT_EQ(opacity.mode, Opacity::Mode::mask);
  EXPECT_EQ(opacity.value, 1);
  EXPECT_EQ(opacity.map, (ScalarMap{0, ScalarMap::Channel::alpha}));
}

TEST(GltfScene, TexturesAreKeptAsTheyAre) {
  const LoadedScene loaded = good(OneTriangle().text(
      kOneNode +
          R"(,"images":[{"bufferView":2,"name":"wood"}],"samplers":[{"magFilter":9728,"wrapS":33071,"wrapT":33071}],
"textures":[{"source":0,"sampler":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,
"extensions":{"KHR_texture_transform":{"scale":[2,3],"offset":[0.25,0.5]}}},"metallicRoughnessTexture":{"index":0}},"emissiveFactor":[1,1,1],
"emissiveTexture":{"index":0}}])",
      R"(,"material":0)"));
  ASSERT_EQ(loaded.scene.textures.size(), 3u);
  const TextureImage& base = loaded.scene.textures[1];
  EXPECT_EQ(base.file, "wood.png");
  EXPECT_EQ(loaded.assets.at(base.asset), kPng);
  ASSERT_EQ(loaded.images.size(), 2u);  // with the sky's
  EXPECT_EQ(loaded.images[0].asset, base.asset);
  EXPECT_EQ(loaded.images[0].place, "a.gltf: images[0]");
  EXPECT_EQ(base.filter, TextureImage::Filter::nearest);
  EXPECT_EQ(base.wrap, (std::array{TextureImage::Wrap::clamp, TextureImage::Wrap::clamp}));
  EXPECT_EQ(base.color_space, TextureImage::ColorSpace::srgb);
  // glTF: v' = 3v + 0.5, counted downwards. Ours is 1 − v: at glTF's v = 0.25 it is 0.75 before and −0.25 after.
  EXPECT_EQ(base.scale, (std::array<double, 2>{2, 3}));
  EXPECT_DOUBLE_EQ(base.scale[1] * 0.75 + base.offset[1], 1 - (3 * 0.25 + 0.5));
  EXPECT_DOUBLE_EQ(base.offset[0], 0.25);
  const TextureImage& emission = loaded.scene.textures[0];
  EXPECT_EQ(emission.scale, (std::array<double, 2>{1, 1}));
  EXPECT_EQ(emission.offset, (std::array<double, 2>{0, 0}));
  EXPECT_NE(base.name, emission.name);
  EXPECT_EQ(loaded.scene.materials[0].emission.texture, 0u);
  EXPECT_EQ(std::get<PrincipledMaterial>(loaded.scene.materials[0].kind).base_color.texture, 1u);
  EXPECT_EQ(loaded.scene.materials[0].roughness_map, (ScalarMap{2, ScalarMap::Channel::g}));
  EXPECT_EQ(loaded.scene.materials[0].metallic_map, (ScalarMap{2, ScalarMap::Channel::b}));
  EXPECT_EQ(loaded.scene.textures[2].color_space, TextureImage::ColorSpace::linear);
  const auto& shape = std::get<MeshShape>(loaded.scene.objects[0].shape);
  const Result<Mesh> mesh = decode_mesh(as_byte_view(loaded.assets.at(shape.asset)));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->texture_coordinates, (std::vector<std::array<float, 2>>{{0, 1}, {1, 1}, {0, 0}}));
}

TEST(GltfScene, TexturesWrapByTheModeOfEachAxis) {
  using enum TextureImage::Wrap;
  struct Case {
    std::string sampler;
    std::array<TextureImage::Wrap, 2> wrap;
    std::vector<std::string> notices = {};
  };
  for (const Case& c : std::vector<Case>{
           {"{}", {repeat, repeat}},
           {R"({"wrapS":10497,"wrapT":33071})", {repeat, clamp}},
           {R"({"wrapS":33648,"wrapT":33071})", {mirror, clamp}},
           {R"({"wrapS":33071,"wrapT":33648})", {clamp, mirror}},
           {R"({"wrapT":33648})", {repeat, mirror}},
           {R"({"wrapS":10496})", {repeat, repeat}, {"textures with an unknown wrap mode are repeated"}}}) {
    const LoadedScene loaded = good(OneTriangle().text(
        kOneNode + R"(,"images":[{"bufferView":2}],"textures":[{"source":0,"sampler":0}],"materials":[{
"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"samplers":[)" +
            c.sampler + "]",
        R"(,"material":0)"));
    ASSERT_EQ(loaded.scene.textures.size(), 1u);
    EXPECT_EQ(loaded.scene.textures[0].wrap, c.wrap) << c.sampler;
    for (const std::string& notice : c.notices) {
      EXPECT_NE(std::ranges::find_if(loaded.notices, [&](const std::string& n) { return n.ends_with(notice); }),
                loaded.notices.end())
          << notice;
    }
    EXPECT_EQ(std::ranges::count_if(loaded.notices, [](const auto& n) { return n.find("textures") != n.npos; }),
              static_cast<std::ptrdiff_t>(c.notices.size()));
  }
}

TEST(GltfScene, WrongValuesOfMaterialsAreIgnored) {
  const auto of = [](const std::string& members, LoadedScene& loaded) {
    loaded = good(OneTriangle().text(kOneNode + fmt::format(R"(,"materials":[{{{}}}])", members), R"(,"material":0)"));
    const std::vector<std::string> faults = loaded.faults.notices();
    EXPECT_EQ(faults.size(), 1u) << members;
    return faults.empty() ? "" : faults[0];
  };
  LoadedScene loaded;
  const std::string base = R"("pbrMetallicRoughness":{"roughnessFactor":0.25,)";
  EXPECT_EQ(of(base + R"("metallicFactor":2})", loaded),
            "a.gltf: materials[0].pbrMetallicRoughness.metallicFactor: a number from 0 to 1 is expected, got 2. It is "
            "ignored");
  const auto& kind = std::get<PrincipledMaterial>(loaded.scene.materials[0].kind);
  EXPECT_EQ(kind.metallic, 1);  // the default of glTF
  EXPECT_EQ(kind.roughness, 0.25);
  EXPECT_EQ(of(R"("emissiveFactor":[1,1])", loaded),
            "a.gltf: materials[0].emissiveFactor: a list of 3 is expected, got a list of 2. It is ignored");
  EXPECT_EQ(loaded.scene.materials[0].emission, TexturedColor{});
  EXPECT_EQ(
      of(base + R"("baseColorTexture":{"index":0}})", loaded),
      "a.gltf: materials[0].pbrMetallicRoughness.baseColorTexture.index: an index into the 0 textures is expected, "
      "got 0. It is ignored");
}

// Downloaded models often come without their images.
TEST(GltfScene, TexturesWithoutTheirImageAreLeftOut) {
  const LoadedScene loaded = good(OneTriangle().text(
      kOneNode + R"(,"images":[{"uri":"a%20b.png"}],"textures":[{"source":0}],"materials":[{"emissiveFactor":[1,1,1],
"emissiveTexture":{"index":0},"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0,1],"baseColorTexture":{"index":0}}}])",
      R"(,"material":0)"));
  EXPECT_EQ(loaded.faults.notices(),
            std::vector<std::string>{"a.gltf: images[0].uri: cannot open a b.png. The textures "
                                     "with it are left out (and 1 more like it)"});
  EXPECT_TRUE(loaded.scene.textures.empty());
  EXPECT_EQ(loaded.scene.materials[0].emission, TexturedColor{});  // most of an emissive map is black
  EXPECT_EQ(std::get<PrincipledMaterial>(loaded.scene.materials[0].kind).base_color.rgb, (RgbColor{0.5f, 0.25f, 0}));
}

TEST(GltfScene, ImageMistakesAreNamed) {
  EXPECT_EQ(error(kOneNode + R"(,"images":[{"bufferView":0}],"textures":[{"source":0}],
"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
                  R"(,"material":0)"),
            "a.gltf: images[0]: PNG, JPEG, WebP or DDS is expected");
  const std::string textured = R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])";
  for (const auto& [texture, fault] :
       {std::pair{"{}", "a.gltf: textures[0].source: an image is expected"},
        {R"({"source":0})", "a.gltf: textures[0].source: an index into the 0 images is expected, got 0"},
        {R"({"source":0,"sampler":"x"})",
         "a.gltf: textures[0].sampler: an index into the 0 samplers is expected, got \"x\""}}) {
    const LoadedScene loaded = good(
        OneTriangle().text(fmt::format("{},\"textures\":[{}],{}", kOneNode, texture, textured), R"(,"material":0)"));
    EXPECT_EQ(loaded.faults.notices().at(0), std::string(fault) + ". It is ignored");
    EXPECT_TRUE(loaded.scene.textures.empty());
  }
}

}  // namespace
}  // namespace lightmill
