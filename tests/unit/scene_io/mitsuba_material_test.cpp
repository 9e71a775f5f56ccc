// Materials, textures and media of Mitsuba scenes.
#include "common/materials/metals.h"
#include "common/scene_io/rough_coat.h"
#include "tests/unit/scene_io/mitsuba_fixture.h"

#include <cmath>

namespace lightmill::test {
namespace {

TEST(MitsubaMaterials, DiffuseHasItsReflectance) {
  const auto reflectance = [](const std::string& value) {
    return std::get<DiffuseMaterial>(mitsuba_material("<bsdf type=\"diffuse\">" + value + "</bsdf>").kind).reflectance;
  };
  EXPECT_EQ(reflectance(""), TexturedColor(0.5f, 0.5f, 0.5f));
  EXPECT_EQ(reflectance(R"(<rgb name="reflectance" value="0.1, 0.2 0.3"/>)"), TexturedColor(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(reflectance(R"(<spectrum name="reflectance" value="0.25"/>)"), TexturedColor(0.25f, 0.25f, 0.25f));
  EXPECT_EQ(reflectance(R"(<float name="reflectance" value="0.25"/>)"), TexturedColor(0.25f, 0.25f, 0.25f));
  const TexturedColor even = reflectance(R"(<spectrum name="reflectance" value="300:0.25, 900:0.25"/>)");
  EXPECT_NEAR(even.rgb.r, 0.25, 1e-6);
  EXPECT_NEAR(even.rgb.b, 0.25, 1e-6);
}

TEST(MitsubaMaterials, ShapesWithoutAMaterialAreGreyOrEmit) {
  EXPECT_EQ(std::get<DiffuseMaterial>(mitsuba_material("").kind).reflectance, TexturedColor(0.5f, 0.5f, 0.5f));
  const Material lit = mitsuba_material(R"(<emitter type="area"><rgb name="radiance" value="1, 2, 3"/></emitter>)");
  EXPECT_EQ(std::get<DiffuseMaterial>(lit.kind).reflectance, TexturedColor(0, 0, 0));
  EXPECT_EQ(lit.emission, TexturedColor(1, 2, 3));
  EXPECT_FALSE(lit.two_sided_emission);
}

TEST(MitsubaMaterials, GlassHasRelativeIndices) {
  const auto glass = [](const std::string& type, const std::string& parameters) {
    return std::get<DielectricMaterial>(mitsuba_material("<bsdf type=\"" + type + "\">" + parameters + "</bsdf>").kind);
  };
  EXPECT_NEAR(glass("dielectric", "").ior, 1.5046 / 1.000277, 1e-9);
  EXPECT_NEAR(glass("dielectric", R"(<string name="int_ior" value="Water"/><float name="ext_ior" value="1"/>)").ior,
              1.333, 1e-9);
  EXPECT_EQ(glass("dielectric", "").roughness, 0);
  EXPECT_NEAR(glass("roughdielectric", R"(<float name="alpha" value="0.25"/><string name="distribution" value="ggx"/>)")
                  .roughness,
              0.5, 1e-7);
  // tan²θ of half of the facets is below alpha² ln 2 with Beckmann's distribution, and below alpha² with GGX.
  EXPECT_NEAR(glass("roughdielectric", "").roughness, std::sqrt(0.1 * std::sqrt(std::log(2))), 1e-6);
}

// A pane of index 1.5 reflects R = 1/25 on each side, and 2R/(1 + R) = 1/13 in all.
TEST(MitsubaMaterials, ThinGlassIsAPartialMirror) {
  const Material pane = mitsuba_material(R"(<bsdf type="thindielectric"><float name="int_ior" value="1.5"/>
<float name="ext_ior" value="1"/></bsdf>)");
  EXPECT_TRUE(std::holds_alternative<MirrorMaterial>(pane.kind));
  EXPECT_NEAR(pane.opacity.value, 1.0 / 13, 1e-12);
}

TEST(MitsubaMaterials, ConductorsAreMetalsByName) {
  const Material gold = mitsuba_material(R"(<bsdf type="roughconductor"><string name="material" value="Au"/>
<string name="distribution" value="ggx"/><float name="alpha_u" value="0.01"/><float name="alpha_v" value="0.16"/></bsdf>)");
  const auto& metal = std::get<ConductorMaterial>(gold.kind);
  const Metal known = find_metal("gold").value();
  EXPECT_EQ(metal.eta, (RgbColor{known.eta[0], known.eta[1], known.eta[2]}));
  EXPECT_EQ(metal.k, (RgbColor{known.k[0], known.k[1], known.k[2]}));
  // alpha is 0.01 along u, and 0.01 + 0.99 s² = 0.16 along v.
  EXPECT_NEAR(metal.roughness, 0.1, 1e-6);
  EXPECT_NEAR(metal.anisotropy.strength, std::sqrt(0.15 / 0.99), 1e-6);
  EXPECT_EQ(metal.anisotropy.rotation_degrees, 90);
  EXPECT_TRUE(gold.single_scattering);
  const Material given = mitsuba_material(
      R"(<bsdf type="conductor"><rgb name="eta" value="1, 2, 3"/><rgb name="k" value="4, 5, 6"/></bsdf>)");
  EXPECT_EQ(std::get<ConductorMaterial>(given.kind).k, (RgbColor{4, 5, 6}));
}

/// alpha along u and v.
std::pair<double, double> alphas_of(double roughness, const Anisotropy& anisotropy) {
  const double least = roughness * roughness, most = least + (1 - least) * std::pow(anisotropy.strength, 2);
  return anisotropy.rotation_degrees == 0 ? std::pair(most, least) : std::pair(least, most);
}

TEST(MitsubaMaterials, AnisotropicIsDisneys) {
  for (const double strength : {0.0, 0.3, 1.0}) {
    const auto kind = std::get<PrincipledMaterial>(
        mitsuba_material(fmt::format(R"(<bsdf type="principled"><float name="roughness" value="0.5"/>
<float name="anisotropic" value="{}"/></bsdf>)",
                                     strength))
            .kind);
    const double aspect = std::sqrt(1 - 0.9 * strength);
    const auto [u, v] = alphas_of(kind.roughness, kind.anisotropy);
    EXPECT_NEAR(u, 0.25 / aspect, 1e-6) << strength;
    EXPECT_NEAR(v, 0.25 * aspect, 1e-6) << strength;
  }
}

TEST(MitsubaMaterials, ConductorsWithoutAMaterialAreMirrors) {
  const Material mirror =
      mitsuba_material(R"(<bsdf type="conductor"><rgb name="specular_reflectance" value="0.9, 0.8, 0.7"/></bsdf>)");
  EXPECT_EQ(std::get<MirrorMaterial>(mirror.kind).reflectance, TexturedColor(0.9f, 0.8f, 0.7f));
}

TEST(MitsubaMaterials, PlasticIsPrincipled) {
  const auto plastic = [](const std::string& parameters) {
    return std::get<PrincipledMaterial>(
        mitsuba_material(R"(<bsdf type="plastic"><rgb name="diffuse_reflectance" value="0.2, 0.5, 1"/>)" + parameters +
                         "</bsdf>")
            .kind);
  };
  const PrincipledMaterial weak = plastic(R"(<rgb name="specular_reflectance" value="0.5, 0.25, 0.5"/>)");
  EXPECT_EQ(weak.specular, 0.25);
  EXPECT_EQ(weak.specular_color, TexturedColor(1, 0.5f, 1));
  const PrincipledMaterial linear = plastic("");
  EXPECT_EQ(linear.specular_color, TexturedColor(1, 1, 1));
  EXPECT_EQ(linear.base_color, TexturedColor(0.2f, 0.5f, 1));
  EXPECT_NEAR(linear.ior, 1.49 / 1.000277, 1e-9);
  EXPECT_EQ(linear.roughness, 0);
  // An index of 1 has no coat. With any coat, white stays white, and others get darker.
  const std::string nonlinear = R"(<boolean name="nonlinear" value="true"/>)";
  const PrincipledMaterial same =
      plastic(nonlinear + R"(<float name="int_ior" value="1"/><float name="ext_ior" value="1"/>)");
  EXPECT_NEAR(same.base_color.rgb.r, 0.2, 1e-6);
  const PrincipledMaterial darker = plastic(nonlinear);
  EXPECT_LT(darker.base_color.rgb.r, 0.15);
  EXPECT_NEAR(darker.base_color.rgb.b, 1, 1e-6);
}

// The expected shares are means over 150,000 visible normals (Heitz 2018) and random directions, with the index 1.5. Their
// standard deviation is at most 0.001.
TEST(MitsubaMaterials, RoughCoatsPassAsMuchLightAsInASimulation) {
  struct Case {
    double alpha, enters, reflects, reflects_inside;
  };
  for (const Case& known : {Case{0.01, 0.9088, 0.0909, 0.5962}, Case{0.1, 0.9130, 0.0780, 0.5620},
                            Case{0.4, 0.8910, 0.0455, 0.3548}, Case{1, 0.7280, 0.0186, 0.1190}}) {
    const RoughCoat coat = rough_coat(1.5, known.alpha, CoatFacets::ggx);
    EXPECT_NEAR(coat.enters, known.enters, 0.004) << known.alpha;
    EXPECT_NEAR(coat.reflects, known.reflects, 0.004) << known.alpha;
    EXPECT_NEAR(coat.reflects_inside, known.reflects_inside, 0.004) << known.alpha;
  }
  const RoughCoat ggx = rough_coat(1.5, 0.001, CoatFacets::ggx),
                  beckmann = rough_coat(1.5, 0.001, CoatFacets::beckmann);
  EXPECT_NEAR(beckmann.enters, ggx.enters, 0.001);
  EXPECT_NEAR(beckmann.reflects_inside, ggx.reflects_inside, 0.002);
}

TEST(MitsubaMaterials, RoughPlasticIsDarkerThanSmoothOne) {
  const auto red = [](double alpha, bool nonlinear) {
    return std::get<PrincipledMaterial>(
               mitsuba_material(fmt::format(
                                    R"(<bsdf type="roughplastic"><float name="alpha" value="{}"/>
<rgb name="diffuse_reflectance" value="0.5"/><boolean name="nonlinear" value="{}"/></bsdf>)",
                                    alpha, nonlinear))
                   .kind)
        .base_color.rgb.r;
  };
  const float smooth =
      std::get<PrincipledMaterial>(
          mitsuba_material(R"(<bsdf type="plastic"><boolean name="nonlinear" value="true"/></bsdf>)").kind)
          .base_color.rgb.r;
  const Material rough = mitsuba_material(R"(<bsdf type="roughplastic"/>)");
  EXPECT_NEAR(std::get<PrincipledMaterial>(rough.kind).roughness, std::sqrt(0.1 * std::sqrt(std::log(2))), 1e-6);
  EXPECT_TRUE(rough.single_scattering);
  EXPECT_NEAR(red(0.001, false), 0.5, 0.003);
  EXPECT_NEAR(red(0.001, true), smooth, 0.003);
  EXPECT_LT(red(0.4, false), 0.45);
  EXPECT_LT(red(0.4, true), red(0.001, true));
}

TEST(MitsubaMaterials, PrincipledHasTheReflectanceOfItsSpecular) {
  const auto principled = [](const std::string& parameters) {
    return std::get<PrincipledMaterial>(mitsuba_material("<bsdf type=\"principled\">" + parameters + "</bsdf>").kind);
  };
  for (const double specular : {0.0, 0.5, 1.0}) {
    const double ior = principled(fmt::format(R"(<float name="specular" value="{}"/>)", specular)).ior;
    EXPECT_NEAR(std::pow((ior - 1) / (ior + 1), 2), 0.08 * specular, 1e-7);
  }
  const PrincipledMaterial other = principled(
      R"(<float name="roughness" value="0.3"/><float name="metallic" value="0.7"/><float name="spec_trans" value="0.2"/>
<float name="eta" value="1.3"/><float name="clearcoat" value="1"/><float name="clearcoat_gloss" value="1"/>)");
  EXPECT_NEAR(other.roughness, 0.3, 1e-6);
  EXPECT_NEAR(other.metallic, 0.7, 1e-6);
  EXPECT_NEAR(other.transmission, 0.2, 1e-6);
  EXPECT_EQ(other.ior, 1.3);
  EXPECT_EQ(other.coat, 0.25);
  EXPECT_NEAR(other.coat_roughness, std::sqrt(0.001), 1e-7);
}

TEST(MitsubaMaterials, WrappersChangeTheirNestedMaterial) {
  const std::string red = R"(<bsdf type="diffuse"><rgb name="reflectance" value="1, 0, 0"/></bsdf>)",
                    green = R"(<bsdf type="diffuse"><rgb name="reflectance" value="0, 1, 0"/></bsdf>)";
  EXPECT_EQ(std::get<DiffuseMaterial>(mitsuba_material("<bsdf type=\"twosided\">" + red + "</bsdf>").kind).reflectance,
            TexturedColor(1, 0, 0));
  const Material masked =
      mitsuba_material("<bsdf type=\"mask\">" + red + R"(<float name="opacity" value="0.25"/></bsdf>)");
  EXPECT_EQ(masked.opacity.mode, Opacity::Mode::blend);
  EXPECT_EQ(masked.opacity.value, 0.25);
  const Material blend =
      mitsuba_material("<bsdf type=\"blendbsdf\">" + red + green + R"(<float name="weight" value="0.25"/></bsdf>)");
  EXPECT_EQ(std::get<DiffuseMaterial>(blend.kind).reflectance, TexturedColor(0.75f, 0.25f, 0));
  const LoadedScene bumpy = with_bsdf(
      "<bsdf type=\"bumpmap\">" + red +
      R"(<texture type="bitmap"><boolean name="raw" value="true"/><string name="filename" value="a.png"/></texture>
<float name="scale" value="3"/><boolean name="use_shadowing_function" value="true"/></bsdf>)");
  const Material& bumped = bumpy.scene.materials.at(0);
  EXPECT_TRUE(bumpy.faults.empty());
  EXPECT_EQ(bumped.bump_map.height, 3);
  EXPECT_EQ(bumped.bump_map.map.texture, 0u);
}

TEST(MitsubaMaterials, BlendsAreMixtures) {
  const std::string diffuse = R"(<bsdf type="diffuse"><rgb name="reflectance" value="1, 0, 0"/></bsdf>)",
                    metal = R"(<bsdf type="roughconductor"><float name="alpha" value="0.25"/></bsdf>)",
                    image = R"(<texture type="bitmap" name="weight"><string name="filename" value="a.png"/></texture>)";
  const LoadedScene loaded = with_bsdf("<bsdf type=\"blendbsdf\">" + image + diffuse + metal + "</bsdf>");
  EXPECT_TRUE(loaded.faults.empty());
  const auto& mixture = std::get<MixtureMaterial>(loaded.scene.materials.at(0).kind);
  EXPECT_EQ(mixture.factor, 1);
  EXPECT_EQ(mixture.map.texture, 0u);
  EXPECT_TRUE(std::holds_alternative<DiffuseMaterial>(mixture.first->kind));
  EXPECT_TRUE(std::holds_alternative<ConductorMaterial>(mixture.second->kind));
  EXPECT_TRUE(mixture.second->single_scattering);
  const Material gauze = mitsuba_material("<bsdf type=\"blendbsdf\"><bsdf type=\"null\"/>" + metal +
                                          R"(<float name="weight" value="0.25"/></bsdf>)");
  EXPECT_TRUE(std::holds_alternative<ConductorMaterial>(gauze.kind));
  EXPECT_EQ(gauze.opacity.value, 0.25);
}

TEST(MitsubaMaterials, UnsupportedMaterialsAreErrors) {
  const auto error_of = [](const std::string& bsdf) {
    return mitsuba_error("<shape type=\"sphere\">\n" + bsdf + "</shape>");
  };
  EXPECT_EQ(error_of("<bsdf type=\"polarizer\"/>"), "a.xml:3: materials of the type \"polarizer\" cannot be rendered");
  EXPECT_EQ(error_of("<bsdf type=\"twosided\"/>"), "a.xml:3: bsdf twosided: one nested bsdf can be rendered, got 0");
  EXPECT_EQ(error_of("<bsdf type=\"mask\">\n<bsdf type=\"dielectric\"/></bsdf>"),
            "a.xml:3: bsdf mask: a mask of glass, of null or of another mask cannot be rendered");
  EXPECT_EQ(error_of("<bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/></bsdf>"),
            "a.xml:3: bsdf blendbsdf: two nested bsdfs are expected, got 1");
  EXPECT_EQ(
      error_of("<bsdf type=\"blendbsdf\"><bsdf type=\"roughdielectric\"><string name=\"int_ior\" value=\"water\"/>"
               "</bsdf><bsdf type=\"dielectric\"/></bsdf>"),
      "a.xml:3: bsdf blendbsdf: glass with different indices of refraction cannot be mixed");
  EXPECT_EQ(error_of("<bsdf type=\"dielectric\">\n<rgb name=\"specular_transmittance\" value=\"1, 0.5, 1\"/></bsdf>"),
            "a.xml:4: bsdf dielectric: rgb specular_transmittance: only 1 can be rendered");
  EXPECT_EQ(error_of("<bsdf type=\"conductor\">\n<string name=\"material\" value=\"Xx\"/></bsdf>"),
            "a.xml:4: bsdf conductor: string material: unknown metal \"Xx\": give eta and k");
  EXPECT_EQ(error_of("<bsdf type=\"diffuse\">\n<rgb name=\"reflectance\" value=\"2\"/></bsdf>"),
            "a.xml:4: bsdf diffuse: rgb reflectance: must be from 0 to 1");
  EXPECT_EQ(error_of("<bsdf type=\"dielectric\">\n<string name=\"int_ior\" value=\"gold\"/></bsdf>"),
            "a.xml:4: bsdf dielectric: string int_ior: a number or the name of a known medium is expected");
  EXPECT_EQ(error_of("<bsdf type=\"null\"/><emitter type=\"area\"/>"),
            "a.xml:2: shape sphere: a light on null cannot be rendered");
}

TEST(MitsubaMaterials, DifferencesAreNotices) {
  const auto notices = [](const std::string& shape) { return mitsuba_scene(shape).notices; };
  EXPECT_EQ(notices("<shape type=\"rectangle\"/>"),
            (std::vector<std::string>{
                "materials without twosided are the same on both sides. In Mitsuba they are black from behind"}));
  EXPECT_TRUE(
      notices(R"(<shape type="rectangle"><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>)").empty());
  EXPECT_TRUE(notices("<shape type=\"sphere\"/><shape type=\"cube\"/>").empty());
  EXPECT_EQ(notices(R"(<shape type="cube"><bsdf type="plastic"/></shape>)"),
            (std::vector<std::string>{"plastic is rendered as a principled material with the same albedo"}));
  EXPECT_EQ(notices(R"(<shape type="cube"><bsdf type="roughdielectric"/></shape>)"),
            (std::vector<std::string>{
                "rough surfaces with the distribution \"beckmann\" are rendered with GGX of the same median slope"}));
}

TEST(MitsubaMaterials, NullOnlyBoundsItsMedium) {
  const std::string fog = R"(<medium name="interior" type="homogeneous"><float name="sigma_t" value="2"/>
<rgb name="albedo" value="0.25, 0.5, 1"/><float name="scale" value="2"/><phase type="hg"><float name="g" value="0.5"/></phase></medium>)";
  const std::string null = "<bsdf type=\"null\"/>";
  EXPECT_EQ(mitsuba_scene("<shape type=\"cube\"/><shape type=\"sphere\">" + null + "</shape>").scene.objects.size(),
            1u);
  const Medium medium = mitsuba_material(null + fog).interior;
  EXPECT_EQ(medium.scattering, (RgbColor{1, 2, 4}));
  EXPECT_EQ(medium.absorption, (RgbColor{3, 2, 0}));
  EXPECT_EQ(medium.anisotropy, 0.5);
  EXPECT_EQ(mitsuba_error("<shape type=\"sphere\">\n" + fog + "</shape>"),
            "a.xml:3: only glass and null can bound a medium");
}

TextureImage texture_of(const std::string& parameters, const std::string& type = "bitmap") {
  const LoadedScene loaded = with_bsdf("<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"" + type + "\">" +
                                       parameters + "</texture></bsdf>");
  return loaded.scene.textures.empty() ? TextureImage{} : loaded.scene.textures[0];
}

constexpr const char* kImage = R"(<string name="filename" value="a.png"/>)";

TEST(MitsubaTextures, BitmapsHaveTheirOptions) {
  const TextureImage plain = texture_of(kImage);
  EXPECT_EQ(plain.wrap[0], TextureImage::Wrap::repeat);
  EXPECT_EQ(plain.filter, TextureImage::Filter::bilinear);
  EXPECT_EQ(plain.color_space, TextureImage::ColorSpace::automatic);
  EXPECT_EQ(plain.offset, (std::array<double, 2>{0, 0}));
  const TextureImage other = texture_of(std::string(kImage) + R"(<string name="wrap_mode" value="mirror"/>
<string name="filter_type" value="nearest"/><boolean name="raw" value="true"/>)");
  EXPECT_EQ(other.wrap[1], TextureImage::Wrap::mirror);
  EXPECT_EQ(other.filter, TextureImage::Filter::nearest);
  EXPECT_EQ(other.color_space, TextureImage::ColorSpace::linear);
}

// With v' = 1 − v, and Mitsuba's 3v + 1/4: the image is at 1 − 3(1 − v') − 1/4 = 3v' − 2 − 1/4.
TEST(MitsubaTextures, CoordinatesAreTransformed) {
  const TextureImage image = texture_of(std::string(kImage) + R"(<transform name="to_uv"><scale x="2" y="3"/>
<translate x="0.5" y="0.25"/></transform>)");
  EXPECT_EQ(image.scale, (std::array<double, 2>{2, 3}));
  EXPECT_EQ(image.offset, (std::array<double, 2>{0.5, -2.25}));
  EXPECT_EQ(image.rotation_degrees, 0);
  // (u, v) = (1, 0.5) is scaled to (2, −1.5), turned to (1.5, 2), and moved to (2, 2.25).
  const TextureImage turned = texture_of(std::string(kImage) + R"(<transform name="to_uv"><scale x="2" y="-3"/>
<rotate z="1" angle="90"/><translate x="0.5" y="0.25"/></transform>)");
  const auto [u, v] = test::mapped_coordinates(turned, 1, 1 - 0.5);
  EXPECT_NEAR(u, 2, 1e-12);
  EXPECT_NEAR(1 - v, 2.25, 1e-12);
  EXPECT_EQ(
      mitsuba_error(R"(<shape type="sphere"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
<transform name="to_uv"><rotate z="1" angle="45"/><scale x="2"/></transform></texture></bsdf></shape>)"),
      "a.xml:3: texture bitmap: transform to_uv: only scales, then a rotation, then a translation can be rendered");
}

TEST(MitsubaTextures, MissingImagesAreFaults) {
  const LoadedScene loaded = mitsuba_scene(R"(<shape type="sphere"><bsdf type="diffuse">
<texture name="reflectance" type="bitmap"><string name="filename" value="none.png"/></texture></bsdf></shape>)");
  EXPECT_EQ(message_of(loaded.faults.as_error()), "a.xml:3: cannot open none.png");
}

TEST(MitsubaTextures, CheckerboardsAreTinyImages) {
  const LoadedScene loaded = with_bsdf(R"(<bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<rgb name="color0" value="0.5"/><rgb name="color1" value="0.25, 0, 0"/></texture></bsdf>)");
  ASSERT_EQ(loaded.scene.textures.size(), 1u);
  EXPECT_EQ(loaded.scene.textures[0].filter, TextureImage::Filter::nearest);
  EXPECT_EQ(std::get<DiffuseMaterial>(loaded.scene.materials[0].kind).reflectance.rgb, (RgbColor{0.5, 0.5, 0.5}));
  const std::string& bytes = loaded.assets.at(loaded.scene.textures[0].asset);
  // Texels in RGBE, from the upper left: color0, color1, color1, color0 over 1/2.
  const std::string first("\x80\x80\x80\x81", 4), second("\x80\0\0\x80", 4);
  EXPECT_EQ(bytes.substr(bytes.size() - 16), first + second + second + first);
}

}  // namespace
}  // namespace lightmill::test
