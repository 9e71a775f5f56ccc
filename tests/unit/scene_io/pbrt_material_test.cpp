// Materials, textures and media of pbrt scenes.
#include "tests/unit/scene_io/pbrt_fixture.h"

#include <cmath>

#include "common/scene/document/subsurface.h"

namespace lightmill::test {
namespace {

TEST(PbrtMaterials, KindsHaveTheirParameters) {
  EXPECT_EQ(std::get<DiffuseMaterial>(pbrt_material("").kind).reflectance.rgb, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(std::get<DiffuseMaterial>(pbrt_material("Material \"diffuse\" \"rgb reflectance\" [0.1 0.2 0.3]").kind)
                .reflectance.rgb,
            (RgbColor{0.1f, 0.2f, 0.3f}));
  const Material glass = pbrt_material("Material \"dielectric\" \"float eta\" 1.25 \"float roughness\" 0.0625");
  EXPECT_EQ(std::get<DielectricMaterial>(glass.kind).ior, 1.25);
  // pbrt's alpha is √0.0625 = 0.25, and ours the square of the roughness.
  EXPECT_NEAR(std::get<DielectricMaterial>(glass.kind).roughness, 0.5, 1e-12);
  EXPECT_TRUE(glass.single_scattering);
  const Material plain = pbrt_material(
      "Material \"dielectric\" \"spectrum eta\" \"glass-F11\" \"float roughness\" 0.25 \"bool remaproughness\" false");
  EXPECT_EQ(std::get<DielectricMaterial>(plain.kind).ior, 1.78472);
  EXPECT_NEAR(std::get<DielectricMaterial>(plain.kind).roughness, 0.5, 1e-12);
}

TEST(PbrtMaterials, ConductorsAreRougherAlongOneAxis) {
  struct Case {
    std::string parameters;
    double roughness, strength, rotation;
  };
  for (const Case& c :
       std::vector<Case>{// alpha is the square root: 0.5 along u, and 0.25 along v.
                         {R"("float uroughness" 0.25 "float vroughness" 0.0625)", 0.5, std::sqrt(0.25 / 0.75), 0},
                         {R"("float uroughness" 0.0625 "float vroughness" 0.25)", 0.5, std::sqrt(0.25 / 0.75), 90},
                         {R"("float roughness" 0.25 "float vroughness" 0.5 "bool remaproughness" false)", 0.5,
                          std::sqrt(0.25 / 0.75), 90},
                         {R"("float uroughness" 0.25 "float vroughness" 0.25)", std::sqrt(0.5), 0, 0}}) {
    const Material metal = pbrt_material("Material \"conductor\" " + c.parameters);
    const auto& kind = std::get<ConductorMaterial>(metal.kind);
    EXPECT_NEAR(kind.roughness, c.roughness, 1e-6) << c.parameters;
    EXPECT_NEAR(kind.anisotropy.strength, c.strength, 1e-6) << c.parameters;
    EXPECT_EQ(kind.anisotropy.rotation_degrees, c.rotation) << c.parameters;
  }
  const Material coated = pbrt_material(
      R"(Material "coatedconductor" "float conductor.uroughness" 0.25 "float conductor.vroughness" 0.0625)");
  EXPECT_NEAR(std::get<PrincipledMaterial>(coated.kind).anisotropy.strength, std::sqrt(0.25 / 0.75), 1e-6);
}

TEST(PbrtMaterials, ConductorsHaveANameIndicesOrAReflectance) {
  const auto gold = std::get<ConductorMaterial>(
      pbrt_material("Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"").kind);
  EXPECT_EQ(gold.eta, (RgbColor{0.1548f, 0.4233f, 1.3828f}));
  EXPECT_EQ(gold.k, (RgbColor{3.6074f, 2.4745f, 1.9154f}));
  const auto given = std::get<ConductorMaterial>(
      pbrt_material("Material \"conductor\" \"spectrum eta\" [450 3 550 2 650 1] \"rgb k\" [4 5 6]").kind);
  EXPECT_EQ(given.eta, (RgbColor{1, 2, 3}));
  EXPECT_EQ(given.k, (RgbColor{4, 5, 6}));
  // With n = 1, R = k²/(4 + k²) at normal incidence.
  const auto mirror =
      std::get<ConductorMaterial>(pbrt_material("Material \"conductor\" \"rgb reflectance\" [0.9 0.5 0.1]").kind);
  for (const auto& [k, r] : {std::pair{mirror.k.r, 0.9}, {mirror.k.g, 0.5}, {mirror.k.b, 0.1}}) {
    EXPECT_NEAR(k * k / (4 + k * k), r, 1e-6);
  }
  EXPECT_EQ(
      pbrt_error("Material \"conductor\" \"spectrum eta\" \"metal-CuZn-eta\" Shape \"sphere\""),
      "a.pbrt:3: Material conductor: spectrum eta: the spectrum \"metal-CuZn-eta\" is unknown, or cannot be used here");
}

// The albedo of a diffuse base under a smooth coat: (1 − F)ρ(1 − f)/(1 − ρf), and f = 1 − (1 − F)/η². For η = 1.5 the mean
// outer reflectance F is 0.0918 (Jensen et al. 2001), so f = 0.5963.
TEST(PbrtMaterials, MeasuredMetalsHaveTheColourOfTheirReflectance) {
  const auto metal = [](const std::string& eta, const std::string& k) {
    return std::get<ConductorMaterial>(
        pbrt_material(fmt::format("Material \"conductor\" \"spectrum eta\" [{}] \"spectrum k\" [{}]", eta, k)).kind);
  };
  const ConductorMaterial grey = metal("300 1.5 900 1.5", "300 3 900 3");
  EXPECT_NEAR(grey.eta.g, 1.5, 1e-6);
  EXPECT_NEAR(grey.k.g, 3, 1e-2);
  EXPECT_NEAR(grey.k.b, 3, 1e-2);
  // Its indices at 450 nm alone would make this metal dark blue.
  const ConductorMaterial step = metal("300 1 900 1", "300 1 455 1 456 4 900 4");
  EXPECT_GT(step.k.b, 1.5);
  EXPECT_LT(step.k.b, step.k.r);
}

TEST(PbrtMaterials, CoatedDiffuseHasTheAlbedoOfItsLayers) {
  const auto albedo = [](double reflectance, int depth, double thickness, double rough = 0) {
    const Material coated = pbrt_material(
        fmt::format("Material \"coateddiffuse\" \"rgb reflectance\" [{0} {0} {0}] \"integer maxdepth\" {1} "
                    "\"float thickness\" {2} \"float roughness\" {3}",
                    reflectance, depth, thickness, rough));
    return std::get<PrincipledMaterial>(coated.kind).base_color.rgb.r;
  };
  constexpr double kInside = 0.5963;  // the mean reflectance of a smooth surface from inside
  EXPECT_NEAR(albedo(1, 1000, 0), 1, 1e-3);
  EXPECT_NEAR(albedo(0.5, 1000, 0), 0.5 * (1 - kInside) / (1 - 0.5 * kInside), 1e-3);
  EXPECT_NEAR(albedo(0, 1000, 0), 0, 1e-6);
  // Few steps: light leaves the surface below the coat once, or twice.
  EXPECT_NEAR(albedo(1, 1, 0), 1 - kInside, 1e-3);
  EXPECT_NEAR(albedo(1, 2, 0), 1 - kInside, 1e-3);
  EXPECT_NEAR(albedo(1, 3, 0), (1 - kInside) * (1 + kInside), 2e-3);
  // Light crosses the coat twice, at a cosine from 0.745 to 1.
  EXPECT_GT(albedo(1, 1, 0.1), (1 - kInside) * std::exp(-0.2 / 0.745));
  EXPECT_LT(albedo(1, 1, 0.1), (1 - kInside) * std::exp(-0.2));
  EXPECT_LT(albedo(1, 1000, 0, 0.5), 0.9);  // light that meets several facets is lost
}

TEST(PbrtMaterials, ImagesBelowCoatsHaveTheInnerReflectance) {
  // A smooth coat of no thickness changes each texel ρ to ρ (1 − r)/(1 − ρ r), so the image stays as it is.
  const auto coated = [](int depth, double scale) {
    return std::get<PrincipledMaterial>(
        pbrt_material(fmt::format(R"(Texture "i" "spectrum" "imagemap" "string filename" "a.png" "float scale" {}
Material "coateddiffuse" "texture reflectance" "i" "integer maxdepth" {} "float thickness" 0 "float roughness" 0)",
                                  scale, depth))
            .kind);
  };
  const PrincipledMaterial all = coated(1000, 1), dark = coated(1000, 0.25), few = coated(1, 1);
  EXPECT_EQ(all.base_color.texture, 0u);
  EXPECT_NEAR(all.inner_reflectance, 0.5963, 3e-3);
  EXPECT_NEAR(all.base_color.rgb.r, 1, 2e-3);
  EXPECT_NEAR(dark.base_color.rgb.g, 0.25, 2e-3);
  // With one step, ρ counts as ρ (1 − r), which is exact for texels of 1/2.
  const double base = few.base_color.rgb.b / 2, r = few.inner_reflectance;
  EXPECT_NEAR(base * (1 - r) / (1 - base * r), 0.5 * (1 - 0.5963), 1e-3);
}

TEST(PbrtMaterials, CoatedConductorIsCoatedMetal) {
  const auto kind = std::get<PrincipledMaterial>(
      pbrt_material("Material \"coatedconductor\" \"rgb conductor.eta\" [1.5 1.5 1.5] \"rgb conductor.k\" [3 3 3]")
          .kind);
  EXPECT_EQ(kind.metallic, 1);
  EXPECT_EQ(kind.coat, 1);
  EXPECT_NEAR(kind.base_color.rgb.r, 0.5, 1e-6);  // n/1.5 = 1 and k/1.5 = 2 give 4/(4 + 4)
}

TEST(PbrtMaterials, MixturesHaveTheirMaterialsAsParts) {
  const std::string named = R"(MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [0.5 0.5 0.5]
MakeNamedMaterial "b" "string type" "conductor" "float roughness" 0.25
MakeNamedMaterial "ab" "string type" "mix" "string materials" ["a" "b"] "float amount" 0.25
MakeNamedMaterial "glass" "string type" "dielectric"
MakeNamedMaterial "none" "string type" "interface"
Texture "dirt" "float" "imagemap" "string filename" "a.png" "float scale" 0.5
)";
  const Material outer =
      pbrt_material(named + R"(Material "mix" "string materials" ["b" "ab"] "texture amount" "dirt")");
  const auto& mixture = std::get<MixtureMaterial>(outer.kind);
  EXPECT_EQ(mixture.factor, 0.5);
  EXPECT_EQ(mixture.map.texture, 0u);
  EXPECT_TRUE(std::holds_alternative<ConductorMaterial>(mixture.first->kind));
  EXPECT_TRUE(mixture.first->single_scattering);
  const auto& inner = std::get<MixtureMaterial>(mixture.second->kind);
  EXPECT_EQ(inner.factor, 0.25);
  EXPECT_EQ(inner.map.texture, kNoTexture);
  EXPECT_TRUE(std::holds_alternative<DiffuseMaterial>(inner.first->kind));
  EXPECT_TRUE(is_boundary(pbrt_material(named + R"(Material "mix" "string materials" ["a" "glass"])")));
  EXPECT_EQ(pbrt_error(named + R"(Material "mix" "string materials" ["none" "glass"] Shape "sphere")"),
            "a.pbrt:9: glass and transparent materials cannot be mixed with one that light passes unchanged");
  const std::string clear = R"(Material "mix" "string materials" ["b" "none"] "texture amount" "dirt" Shape "sphere")";
  EXPECT_NE(
      pbrt_error(named + clear, {{"a.png", "picture"}}).find("Exchange the two materials, and invert the texture"),
      std::string::npos);
  const Material gauze = pbrt_material(named + R"(Material "mix" "string materials" ["b" "none"] "float amount" 0.25)");
  EXPECT_TRUE(std::holds_alternative<ConductorMaterial>(gauze.kind));
  EXPECT_EQ(gauze.opacity.mode, Opacity::Mode::blend);
  EXPECT_EQ(gauze.opacity.value, 0.75);
  std::string doubled = named;
  for (int i = 1; i <= 5; ++i) {
    doubled += fmt::format(R"(MakeNamedMaterial "m{}" "string type" "mix" "string materials" ["{}" "{}"])", i,
                           i == 1 ? "b" : fmt::format("m{}", i - 1), i == 1 ? "a" : fmt::format("m{}", i - 1));
    doubled += '\n';
  }
  EXPECT_TRUE(std::holds_alternative<MixtureMaterial>(pbrt_material(doubled + R"(NamedMaterial "m4")").kind));
  EXPECT_EQ(pbrt_error(doubled + R"(NamedMaterial "m5" Shape "sphere")"),
            "a.pbrt:13: at most 16 materials can be mixed, got 32");
}

TEST(PbrtMaterials, MixturesOfDiffuseOnesAreMeans) {
  const std::string two = R"(MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [0 0 0]
MakeNamedMaterial "b" "string type" "diffuse" "rgb reflectance" [0.8 0.4 0]
MakeNamedMaterial "c" "string type" "conductor"
)";
  const Material mixed = pbrt_material(two + R"(Material "mix" "string materials" ["a" "b"] "float amount" 0.25)");
  EXPECT_EQ(std::get<DiffuseMaterial>(mixed.kind).reflectance.rgb, (RgbColor{0.2f, 0.1f, 0}));
  EXPECT_TRUE(std::holds_alternative<ConductorMaterial>(
      pbrt_material(two + R"(Material "mix" "string materials" ["a" "c"] "float amount" 1)").kind));
  EXPECT_EQ(pbrt_error(two + R"(Material "mix" "string materials" ["a" "a" "c"] Shape "sphere")"),
            "a.pbrt:6: a mixture needs two materials, got 3");
  EXPECT_EQ(
      pbrt_error(
          R"(MakeNamedMaterial "m" "string type" "mix" "string materials" ["m" "m"] NamedMaterial "m" Shape "sphere")"),
      "a.pbrt:3: mixtures are nested more than 100 deep");
}

TEST(PbrtMaterials, NamesCanBeUsedBeforeTheirDefinition) {
  EXPECT_EQ(world(R"(NamedMaterial "late" Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0]
MakeNamedMaterial "late" "string type" "conductor")")
                .scene.materials.at(0)
                .name,
            "late");
  EXPECT_EQ(pbrt_error("NamedMaterial \"none\"\nShape \"sphere\""), "a.pbrt:4: there is no material \"none\"");
}

TEST(PbrtMaterials, CopiesHaveNamesOfTheirOwn) {
  const LoadedScene loaded =
      world(R"x(MakeNamedMaterial "a (2)" "string type" "diffuse" NamedMaterial "a (2)" Shape "sphere"
MakeNamedMaterial "a" "string type" "diffuse" NamedMaterial "a" Shape "sphere"
AreaLightSource "diffuse" Shape "sphere")x");
  ASSERT_EQ(loaded.scene.materials.size(), 3u);
  EXPECT_EQ(loaded.scene.materials[1].name, "a");
  EXPECT_EQ(loaded.scene.materials[2].name, "a (3)");
}

TEST(PbrtMaterials, ThinSheetsTransmitLight) {
  const auto sheet = std::get<DiffuseMaterial>(
      pbrt_material(R"(Material "diffusetransmission" "rgb transmittance" [0.5 0.25 1] "float scale" 0.5)").kind);
  EXPECT_EQ(sheet.reflectance.rgb, (RgbColor{0.125f, 0.125f, 0.125f}));
  EXPECT_EQ(sheet.transmittance.rgb, (RgbColor{0.25f, 0.125f, 0.5f}));
  const Material pane = pbrt_material(R"(Material "thindielectric" "float eta" 3)");
  EXPECT_TRUE(std::holds_alternative<MirrorMaterial>(pane.kind));
  EXPECT_EQ(pane.opacity.mode, Opacity::Mode::blend);
  EXPECT_NEAR(pane.opacity.value, 0.4, 1e-12);  // R = 1/4, and 2R/(1 + R)
}

TEST(PbrtMaterials, UnsupportedMaterialsAreErrors) {
  for (const char* type : {"hair", "measured", "x"}) {
    EXPECT_EQ(pbrt_error(fmt::format("Material \"{}\"\nShape \"sphere\"", type)),
              fmt::format("a.pbrt:3: materials of the type \"{}\" cannot be rendered", type));
  }
  EXPECT_EQ(pbrt_error("Material \"hair\" Material \"diffuse\" Shape \"sphere\""), "no error") << "no shape has it";
  EXPECT_EQ(pbrt_error("Material \"diffuse\" \"rgb reflectance\" [1 2 1] Shape \"sphere\""),
            "a.pbrt:3: Material diffuse: rgb reflectance: three numbers from 0 to 1 are expected");
}

TEST(PbrtMaterials, SphericalImagesNeedTriangles) {
  std::vector<std::string> notices;
  const Material wood = pbrt_material(
      R"(Texture "wood" "spectrum" "imagemap" "string filename" "a.png" "float uscale" 2 "float vdelta" 0.5 "float scale" 0.5
Material "diffuse" "texture reflectance" "wood")",
      &notices);
  const TexturedColor& color = std::get<DiffuseMaterial>(wood.kind).reflectance;
  EXPECT_EQ(color.texture, 0u);
  EXPECT_EQ(color.rgb, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(notices, std::vector<std::string>{"shapes of the type \"sphere\" are rendered as triangles"});
}

TEST(PbrtTextures, AreComputedWhereTheyAreConstant) {
  const auto reflectance = [](const std::string& textures) {
    return std::get<DiffuseMaterial>(
               pbrt_material(textures + " Material \"diffuse\" \"texture reflectance\" \"t\"").kind)
        .reflectance;
  };
  EXPECT_EQ(reflectance(R"(Texture "t" "spectrum" "constant" "rgb value" [0.1 0.2 0.3])").rgb,
            (RgbColor{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(
      reflectance(
          R"(Texture "a" "spectrum" "constant" "rgb value" [0.25 0.5 1] Texture "b" "float" "constant" "float value" 0.5
Texture "t" "spectrum" "scale" "texture tex" "a" "texture scale" "b")")
          .rgb,
      (RgbColor{0.125f, 0.25f, 0.5f}));
  EXPECT_EQ(
      reflectance(R"(Texture "t" "spectrum" "mix" "rgb tex1" [1 0 0] "rgb tex2" [0 1 0] "float amount" 0.25)").rgb,
      (RgbColor{0.75f, 0.25f, 0}));
  const TexturedColor scaled = reflectance(R"(Texture "i" "spectrum" "imagemap" "string filename" "a.png"
Texture "t" "spectrum" "scale" "texture tex" "i" "float scale" 0.25)");
  EXPECT_EQ(scaled.texture, 0u);
  EXPECT_EQ(scaled.rgb, (RgbColor{0.25f, 0.25f, 0.25f}));
}

TEST(PbrtTextures, ImagesOfEightBitsAreEncodedAlsoAsNumbers) {
  const auto space = [](const char* name, const char* encoding) {
    const LoadedScene loaded = world(
        fmt::format(R"(Texture "t" "float" "imagemap" "string filename" "{}" {} Shape "sphere" "texture alpha" "t")",
                    name, encoding),
        {{name, "picture"}});
    return loaded.scene.textures.at(0).color_space;
  };
  using enum TextureImage::ColorSpace;
  EXPECT_EQ(space("a.png", ""), srgb);
  EXPECT_EQ(space("a.TGA", ""), srgb);
  EXPECT_EQ(space("a.png", R"("string encoding" "linear")"), linear);
  EXPECT_EQ(space("a.exr", ""), automatic);
}

TEST(PbrtTextures, CheckerboardsAreSmallImages) {
  const LoadedScene loaded =
      world(R"(Texture "t" "spectrum" "checkerboard" "float uscale" 4 "rgb tex1" [0.5 0.25 0] "rgb tex2" [0 0 0.5]
Material "diffuse" "texture reflectance" "t" Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 0])");
  ASSERT_EQ(loaded.scene.textures.size(), 1u);
  const TextureImage& image = loaded.scene.textures[0];
  EXPECT_EQ(image.filter, TextureImage::Filter::nearest);
  EXPECT_EQ(image.scale, (std::array<double, 2>{2, 0.5}));
  const std::string bytes = loaded.assets.at(image.asset);
  // RGBE, row by row from the top. The byte 129 is an exponent of 1. The largest component is 1.
  const std::string a("\x80\x40\0\x81", 4), b("\0\0\x80\x81", 4);
  EXPECT_EQ(bytes.substr(bytes.size() - 16), b + a + a + b);
  EXPECT_EQ(std::get<DiffuseMaterial>(loaded.scene.materials[0].kind).reflectance.rgb, (RgbColor{0.5f, 0.5f, 0.5f}));
}

TEST(PbrtTextures, UnsupportedTexturesAreErrorsWhereTheyAreUsed) {
  const std::string marble = "Texture \"t\" \"spectrum\" \"marble\"\n";
  EXPECT_EQ(pbrt_error(marble + "Shape \"sphere\""), "no error");
  EXPECT_EQ(pbrt_error(marble + "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\""),
            "a.pbrt:3: textures of the type \"marble\" cannot be rendered");
  EXPECT_EQ(pbrt_error("Material \"diffuse\" \"texture reflectance\" \"u\" Shape \"sphere\""),
            "a.pbrt:3: Material diffuse: texture reflectance: there is no such texture \"u\" before this line");
  const Result<LoadedScene> loaded = read_text(
      "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"none.png\" Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->faults.notices(),
            std::vector<std::string>{"a.pbrt:1: cannot open none.png. The texture is left out"});
}

/// Coefficients of a channel, each within a thousandth of the extinction.
void expect_channel(const Medium& medium, float RgbColor::*channel, double extinction, double color) {
  const double scattering = extinction * scattering_albedo(color, medium.anisotropy);
  EXPECT_NEAR(medium.scattering.*channel, scattering, extinction / 1000);
  EXPECT_NEAR(medium.absorption.*channel, extinction - scattering, extinction / 1000);
}

// Below a surface of index 1.5, diffuse light is reflected back by the mean share 0.596. Without a surface, albedo 0.8
// with g = 0 returns 0.3403 (van de Hulst: s = √0.2). So below it the body returns 0.3403·0.404/(1 − 0.3403·0.596).
TEST(PbrtMaterials, SubsurfaceShowsTheColourOfItsMediumBelowItsSurface) {
  std::vector<std::string> notices;
  const Material wax = pbrt_material(
      R"(Material "subsurface" "rgb sigma_a" [1 0 2] "rgb sigma_s" [4 4 0] "float scale" 0.5 "float eta" 1.5 "float roughness" 0.0625)",
      &notices);
  const auto& sheet = std::get<PrincipledMaterial>(wax.kind);
  EXPECT_EQ(sheet.transmittance.rgb, (RgbColor{1, 1, 1}));
  EXPECT_EQ(sheet.ior, 1.5);
  EXPECT_NEAR(sheet.roughness, 0.5, 1e-12);
  expect_channel(wax.interior, &RgbColor::r, 2.5, 0.3403 * 0.404 / (1 - 0.3403 * 0.596));
  expect_channel(wax.interior, &RgbColor::g, 2, 1);
  expect_channel(wax.interior, &RgbColor::b, 1, 0);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find("a principled sheet around a medium"), std::string::npos) << notices[0];
}

TEST(PbrtMaterials, SubsurfaceKnowsMeasuredMediaPerMillimetre) {
  const Medium milk = pbrt_material("Material \"subsurface\"").interior;
  EXPECT_NEAR(milk.absorption.r + milk.scattering.r, 2.5511, 1e-4) << "Wholemilk is the default";
  const Medium skin =
      pbrt_material(R"(Material "subsurface" "string name" "Skin1" "float scale" 10 "float g" 0.5)").interior;
  EXPECT_NEAR(skin.absorption.r + skin.scattering.r, 7.72, 1e-4);
  EXPECT_EQ(skin.anisotropy, 0) << "reduced coefficients";
  EXPECT_EQ(
      pbrt_error("Material \"subsurface\" \"string name\" \"Skin9\" Shape \"sphere\""),
      "a.pbrt:3: Material subsurface: string name: there is no measured medium \"Skin9\": give sigma_a and sigma_s instead");
  EXPECT_EQ(pbrt_error("Material \"subsurface\" \"rgb sigma_a\" [1 1 1] Shape \"sphere\""),
            "a.pbrt:3: Material subsurface: rgb sigma_a: needs sigma_a and sigma_s together");
}

TEST(PbrtMaterials, SubsurfaceHasAReflectanceAndAMeanFreePath) {
  const Material wax = pbrt_material(
      R"(Material "subsurface" "rgb reflectance" [0.8 0.5 0.2] "rgb mfp" [2 1 0.5] "float scale" 0.5 "float g" 0.5)");
  expect_channel(wax.interior, &RgbColor::r, 1, 0.8);
  expect_channel(wax.interior, &RgbColor::g, 2, 0.5);
  expect_channel(wax.interior, &RgbColor::b, 4, 0.2);
}

TEST(PbrtMaterials, MixturesKeepAMediumOfSubsurface) {
  const std::string parts = R"(MakeNamedMaterial "wax" "string type" "subsurface"
MakeNamedMaterial "milk" "string type" "subsurface" "float scale" 2
MakeNamedMaterial "paint" "string type" "diffuse"
)";
  for (const char* const names : {"\"wax\" \"paint\"", "\"paint\" \"wax\"", "\"wax\" \"wax\""}) {
    EXPECT_EQ(pbrt_material(parts + fmt::format("Material \"mix\" \"string materials\" [{}]", names)).interior,
              pbrt_material("Material \"subsurface\"").interior)
        << names;
  }
  EXPECT_EQ(pbrt_error(parts + R"(Material "mix" "string materials" ["wax" "milk"] Shape "sphere")"),
            "a.pbrt:6: a mixture of two subsurface media cannot be rendered");
}

TEST(PbrtMedia, PresetsAreMeasuredMedia) {
  const Material fog = pbrt_material(
      R"(MakeNamedMedium "fog" "string type" "homogeneous" "string preset" "Regular Milk" "float scale" 0.5 "float g" 0.25
Material "interface" MediumInterface "fog" "")");
  EXPECT_EQ(fog.interior.absorption, (RgbColor{0.0015333f / 2, 0.0046f / 2, 0.019933f / 2}));
  EXPECT_EQ(fog.interior.scattering, (RgbColor{4.5513f / 2, 5.8294f / 2, 7.136f / 2}));
  EXPECT_EQ(fog.interior.anisotropy, 0.25);
  EXPECT_EQ(
      pbrt_error(R"(MakeNamedMedium "fog" "string type" "homogeneous" "string preset" "mud")"),
      "a.pbrt:3: MakeNamedMedium fog: string preset: there is no measured medium \"mud\": give sigma_a and sigma_s instead");
}

TEST(PbrtMedia, FillTheirShapes) {
  const Material fog = pbrt_material(
      R"(MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [1 2 3] "rgb sigma_s" [4 5 6] "float scale" 0.5 "float g" 0.25
Material "interface" MediumInterface "fog" "")");
  EXPECT_EQ(std::get<DielectricMaterial>(fog.kind).ior, 1);
  EXPECT_EQ(fog.interior.absorption, (RgbColor{0.5f, 1, 1.5f}));
  EXPECT_EQ(fog.interior.scattering, (RgbColor{2, 2.5f, 3}));
  EXPECT_EQ(fog.interior.anisotropy, 0.25);
  EXPECT_EQ(world("Material \"interface\" Shape \"sphere\" Material \"diffuse\" Shape \"sphere\"").scene.objects.size(),
            1u)
      << "nothing is there";
  EXPECT_EQ(pbrt_error("MakeNamedMedium \"m\" \"string type\" \"cloud\""),
            "a.pbrt:3: only homogeneous media can be rendered, got \"cloud\"");
  EXPECT_EQ(pbrt_error("Material \"interface\" MediumInterface \"none\" \"\"\nShape \"sphere\""),
            "a.pbrt:4: there is no medium \"none\"");
}

TEST(PbrtMedia, InnerOnesHaveThePriority) {
  const LoadedScene loaded =
      world(R"(MakeNamedMedium "fog" "string type" "homogeneous" MakeNamedMedium "ink" "string type" "homogeneous"
Material "dielectric" MediumInterface "ink" "fog" Shape "sphere" "float radius" 0.5
Material "interface" MediumInterface "fog" "" Shape "sphere")");
  ASSERT_EQ(loaded.scene.materials.size(), 2u);
  EXPECT_GT(loaded.scene.materials[0].priority, loaded.scene.materials[1].priority);
  EXPECT_EQ(
      pbrt_error(
          "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" Material \"dielectric\" MediumInterface \"\" \"fog\"\nShape \"sphere\""),
      "a.pbrt:4: no surface bounds the medium \"fog\" outside of this one");
}

}  // namespace
}  // namespace lightmill::test
