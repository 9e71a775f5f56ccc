// Materials of scene documents: all kinds survive a round trip, and mistakes are named.
#include <gtest/gtest.h>

#include "common/wire/scene_json.h"
#include "tests/support/error_message.h"

namespace lightmill {
namespace {

std::string material_document(const std::string& material) {
  return R"({"camera": {"eye": [0, 1, 5], "look_at": [0, 1, 0], "vertical_fov_degrees": 30},
"materials": [{"name": "m", )" +
         material + R"(}],
"objects": [{"material": "m", "sphere": {"center": [0, 0, 0], "radius": 1}}]})";
}

/// Read, packed and unpacked.
Material read(const std::string& material) {
  const Result<SceneFile> file = read_scene_json(material_document(material), "m.json");
  EXPECT_TRUE(file.ok()) << file.status();
  const Result<Scene> back = unpack_scene(pack_scene(file->draft.scene));
  EXPECT_TRUE(back.ok()) << back.status();
  return back->materials[0];
}
std::string material_error(const std::string& material) {
  return test::error_message(read_scene_json(material_document(material), "m.json"));
}

TEST(MaterialJson, PhongIsRead) {
  const auto all = std::get<PhongMaterial>(
      read(R"("phong": {"diffuse": {"rgb": [0.5, 0.4, 0.3]}, "specular": {"rgb": [0.5, 0.1, 0]}, "exponent": 1e6})")
          .kind);
  EXPECT_EQ(all.diffuse, (RgbColor{0.5f, 0.4f, 0.3f}));
  EXPECT_EQ(all.specular, (RgbColor{0.5f, 0.1f, 0}));
  EXPECT_EQ(all.exponent, 1e6);
  const auto none = std::get<PhongMaterial>(read(R"("phong": {})").kind);
  EXPECT_EQ(none.diffuse, RgbColor{});
  EXPECT_EQ(none.exponent, 10);
  EXPECT_EQ(material_error(R"("phong": {"diffuse": {"rgb": [0.5, 0.5, 0.5]}, "specular": {"rgb": [0.2, 0.6, 0]}})"),
            "m.json:2:38: materials[0].phong: diffuse + specular may not exceed 1 in any channel, got 0.5 + 0.6");
  EXPECT_EQ(material_error(R"("phong": {"exponent": 1e7})"),
            "m.json:2:51: materials[0].phong.exponent: must be in [0, 1000000], got 10000000");
}

TEST(MaterialJson, ConductorsAreReadByNumbersOrByName) {
  const auto numbers = std::get<ConductorMaterial>(
      read(R"("conductor": {"eta": {"rgb": [1, 2, 3]}, "k": {"rgb": [4, 5, 6]}, "roughness": 0.25})").kind);
  EXPECT_EQ(numbers.eta, (RgbColor{1, 2, 3}));
  EXPECT_EQ(numbers.k, (RgbColor{4, 5, 6}));
  EXPECT_EQ(numbers.roughness, 0.25);
  const auto silver = std::get<ConductorMaterial>(read(R"("conductor": {"metal": "silver"})").kind);
  EXPECT_NEAR(silver.eta.g, 0.06, 0.01);
  EXPECT_NEAR(silver.k.r, 4.4, 0.1);
  EXPECT_EQ(material_error(R"("conductor": {})"),
            "m.json:2:42: materials[0].conductor: metal, or eta and k must be given");
  EXPECT_EQ(material_error(R"("conductor": {"eta": {"rgb": [1, 1, 1]}})"),
            "m.json:2:42: materials[0].conductor.k: must be given");
  EXPECT_EQ(material_error(R"("conductor": {"metal": "tin"})"),
            "m.json:2:52: materials[0].conductor.metal: unknown metal \"tin\". Known metals: aluminium, chromium, "
            "copper, gold, iron, nickel, platinum, silver");
  EXPECT_EQ(material_error(R"("conductor": {"metal": "gold", "k": {"rgb": [1, 1, 1]}})"),
            "m.json:2:52: materials[0].conductor.metal: give either metal, or eta and k");
  EXPECT_EQ(material_error(R"("conductor": {"eta": {"rgb": [1, 0, 1]}, "k": {"rgb": [1, 0, 1]}})"),
            "m.json:2:42: materials[0].conductor: eta and k may not both be 0 in a channel");
}

TEST(MaterialJson, PrincipledMaterialsAreRead) {
  const auto all = std::get<PrincipledMaterial>(
      read(R"("principled": {"base_color": {"rgb": [0.1, 0.2, 0.3]}, "metallic": 0.1, "roughness": 0, "specular": 0,
"transmission": 0.2, "ior": 1.3, "coat": 0.4, "coat_roughness": 0, "burley_diffuse": true,
"specular_color": {"rgb": [1, 0.5, 0.25]}, "inner_reflectance": 0.6})")
          .kind);
  EXPECT_EQ(all.base_color, (RgbColor{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(all.metallic, 0.1);
  EXPECT_EQ(all.roughness, 0);
  EXPECT_EQ(all.specular, 0);
  EXPECT_EQ(all.transmission, 0.2);
  EXPECT_EQ(all.ior, 1.3);
  EXPECT_EQ(all.coat, 0.4);
  EXPECT_EQ(all.coat_roughness, 0);
  EXPECT_TRUE(all.burley_diffuse);
  EXPECT_EQ(all.specular_color, (RgbColor{1, 0.5f, 0.25f}));
  EXPECT_EQ(all.inner_reflectance, 0.6);
  const auto none = std::get<PrincipledMaterial>(read(R"("principled": {})").kind);
  EXPECT_EQ(none.roughness, 0.5);
  EXPECT_EQ(none.specular, 0.5);
  EXPECT_EQ(none.ior, 1.5);
  EXPECT_EQ(none.coat_roughness, 0.03);
  EXPECT_FALSE(none.burley_diffuse);
  EXPECT_EQ(none.specular_color, (RgbColor{1, 1, 1}));
  EXPECT_EQ(none.inner_reflectance, 0);
  EXPECT_EQ(none.anisotropy, Anisotropy{});
  EXPECT_EQ(none.sheen_color, TexturedColor{});
  EXPECT_EQ(none.sheen_roughness, 0.5);
  EXPECT_EQ(material_error(R"("principled": {"coat": 2})"),
            "m.json:2:52: materials[0].principled.coat: must be in [0, 1], got 2");
  EXPECT_EQ(material_error(R"("principled": {"inner_reflectance": 1})"),
            "m.json:2:65: materials[0].principled.inner_reflectance: must be in [0, 0.99], got 1");
  EXPECT_EQ(material_error(R"("principled": {"ior": 0})"),
            "m.json:2:51: materials[0].principled.ior: must be in (0, 10], got 0");
}

TEST(MaterialJson, AnisotropyAndSheenAreRead) {
  const Material cloth = read(R"("principled": {"anisotropy": 0.25, "anisotropy_rotation_degrees": -30,
"sheen_color": {"rgb": [0.1, 0.2, 0.3]}, "sheen_roughness": 0, "transmittance": {"rgb": [1, 0.5, 0]}})");
  const auto& principled = std::get<PrincipledMaterial>(cloth.kind);
  EXPECT_EQ(principled.anisotropy, (Anisotropy{0.25, -30}));
  EXPECT_EQ(principled.sheen_color, TexturedColor(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(principled.sheen_roughness, 0);
  EXPECT_EQ(principled.transmittance, TexturedColor(1, 0.5f, 0));
  EXPECT_EQ(material_error(R"("principled": {"transmittance": {"rgb": [0, 2, 0]}})"),
            "m.json:2:61: materials[0].principled.transmittance: each component must be in [0, 1], got (0, 2, 0)");
  const Material brushed =
      read(R"("conductor": {"metal": "gold", "anisotropy": 1, "anisotropy_rotation_degrees": 400})");
  EXPECT_EQ(std::get<ConductorMaterial>(brushed.kind).anisotropy, (Anisotropy{1, 400}));
  EXPECT_EQ(material_error(R"("principled": {"anisotropy": -0.5})"),
            "m.json:2:58: materials[0].principled.anisotropy: must be in [0, 1], got -0.5");
  EXPECT_EQ(material_error(R"("principled": {"sheen_roughness": 2})"),
            "m.json:2:63: materials[0].principled.sheen_roughness: must be in [0, 1], got 2");
}

TEST(MaterialJson, GlassHasRoughnessAnInteriorAndAPriority) {
  const Material glass =
      read(R"("dielectric": {"roughness": 0.5}, "interior": {"absorption": {"rgb": [0, 1, 2]}}, "priority": -3)");
  EXPECT_EQ(std::get<DielectricMaterial>(glass.kind).ior, 1.5);
  EXPECT_EQ(std::get<DielectricMaterial>(glass.kind).roughness, 0.5);
  EXPECT_EQ(glass.interior.absorption, (RgbColor{0, 1, 2}));
  EXPECT_EQ(glass.priority, -3);
  const Medium colored = read(R"("dielectric": {}, "interior": {"color": {"rgb": [1, 0.5, 0]}})").interior;
  EXPECT_EQ(colored.absorption.r, 0);
  EXPECT_EQ(colored.absorption.g, 1);
  EXPECT_EQ(colored.absorption.b, kMaxAbsorption);
  const Medium fog =
      read(R"("dielectric": {"ior": 1}, "interior": {"scattering": {"rgb": [1, 2, 3]}, "anisotropy": -0.5})").interior;
  EXPECT_EQ(fog.absorption, RgbColor{});
  EXPECT_EQ(fog.scattering, (RgbColor{1, 2, 3}));
  EXPECT_EQ(fog.anisotropy, -0.5);
  const Medium skin = read(R"("diffuse": {"reflectance": {"rgb": [0, 0, 0]}, "transmittance": {"rgb": [1, 1, 1]}},
              "interior": {"subsurface": {"color": {"rgb": [0, 1, 1]},
              "radius": {"rgb": [2, 4, 0.5]}}})")
                          .interior;
  EXPECT_NEAR(skin.absorption.r, 0.5, 1e-5);
  EXPECT_NEAR(skin.scattering.r, 0, 1e-5);
  EXPECT_NEAR(skin.scattering.g, 0.25, 1e-5);
  EXPECT_NEAR(skin.scattering.b, 2, 1e-5);
  EXPECT_NEAR(skin.absorption.b, 0, 1e-5);
  EXPECT_EQ(material_error(R"("dielectric": {}, "interior": {"scattering": {"rgb": [1, 2, 3]}, "subsurface": {}})"),
            "m.json:2:74: materials[0].interior.scattering: give either this or subsurface");
  EXPECT_NE(material_error(R"("dielectric": {}, "interior": {"subsurface": {"color": {"rgb": [0, 1, 1]},
                              "radius": {"rgb": [1, 1, 0]}}})")
                .find("materials[0].interior.subsurface.radius: must be in ["),
            std::string::npos);
  EXPECT_EQ(material_error(R"("dielectric": {}, "interior": {"anisotropy": 1})"),
            "m.json:2:74: materials[0].interior.anisotropy: must be in [-0.99, 0.99], got 1");
  EXPECT_EQ(material_error(R"("dielectric": {"roughness": -1})"),
            "m.json:2:57: materials[0].dielectric.roughness: must be in [0, 1], got -1");
  EXPECT_EQ(material_error(R"("dielectric": {}, "interior": {"color": {"rgb": [1, 2, 0]}})"),
            "m.json:2:69: materials[0].interior.color: each component must be in [0, 1], got (1, 2, 0)");
  EXPECT_EQ(material_error(R"("mirror": {}, "interior": {"absorption": {"rgb": [1, 2, 0]}})"),
            "m.json:2:55: materials[0].interior: only a dielectric, a principled material with transmission, or a "
            "diffuse or principled one with a transmittance, has an inside");
  // Metal has no diffuse part.
  EXPECT_NE(material_error(R"("principled": {"metallic": 1, "transmittance": {"rgb": [1, 1, 1]}},
                              "interior": {"scattering": {"rgb": [1, 2, 0]}})")
                .find("has an inside"),
            std::string::npos);
  EXPECT_EQ(read(R"("principled": {"transmittance": {"rgb": [1, 1, 1]}}, "interior": {"subsurface": {"color":
                    {"rgb": [0, 1, 1]}, "radius": {"rgb": [2, 4, 0.5]}}})")
                .interior,
            skin);
  EXPECT_EQ(material_error(R"("principled": {}, "priority": 1)"),
            "m.json:2:59: materials[0].priority: only a dielectric, a principled material with transmission, or a "
            "diffuse or principled one with a transmittance, has an inside");
}

TEST(MaterialJson, TexturesWrapAlongEachAxis) {
  using enum TextureImage::Wrap;
  for (const auto& [fields, wrap] : std::vector<std::pair<std::string, std::array<TextureImage::Wrap, 2>>>{
           {"", {repeat, repeat}},
           {R"(, "wrap": "CLAMP")", {clamp, clamp}},
           {R"(, "wrap": "MIRROR")", {mirror, mirror}},
           {R"(, "wrap": "MIRROR", "wrap_v": "CLAMP")", {mirror, clamp}},
           {R"(, "wrap": "CLAMP", "wrap_v": "REPEAT")", {clamp, repeat}},
           {R"(, "wrap_v": "MIRROR")", {repeat, mirror}}}) {
    std::string text = material_document(R"("diffuse": {"reflectance": {"rgb": [1, 1, 1]}})");
    text.insert(1, R"("textures": [{"name": "t", "file": "t.png")" + fields + "}], ");
    const Result<SceneFile> file = read_scene_json(text, "m.json");
    ASSERT_TRUE(file.ok()) << file.status();
    const Result<Scene> back = unpack_scene(pack_scene(file->draft.scene));
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(back->textures.at(0).wrap, wrap) << fields;
  }
}

TEST(MaterialJson, OpacityHasAValueAMapAndACutoff) {
  const auto read_opacity = [](const std::string& opacity, std::string& error) {
    std::string text = material_document(R"("mirror": {})" + opacity);
    text.insert(1, R"("textures": [{"name": "t", "file": "t.png"}], )");
    const Result<SceneFile> file = read_scene_json(text, "m.json");
    if (!file.ok()) {
      error = message_of(file.status());
      return Opacity{};
    }
    const Result<Scene> back = unpack_scene(pack_scene(file->draft.scene));
    EXPECT_TRUE(back.ok()) << back.status();
    return back->materials[0].opacity;
  };
  struct Case {
    std::string text;
    Opacity expected;
  };
  using enum Opacity::Mode;
  for (const Case& c : {Case{"", {}},
                        {R"(, "opacity": {})", {blend, 1}},
                        {R"(, "opacity": {"value": 0})", {blend, 0}},
                        {R"(, "opacity": {"value": 0.25, "map": {"texture": "t", "channel": "A"}})",
                         {blend, 0.25, {0, ScalarMap::Channel::alpha}}},
                        {R"(, "opacity": {"mode": "MASK", "map": {"texture": "t"}})", {mask, 1, {0}}},
                        {R"(, "opacity": {"mode": "MASK", "value": 0.5, "cutoff": 0})", {mask, 0.5, {}, 0}}}) {
    std::string error;
    const Opacity opacity = read_opacity(c.text, error);
    EXPECT_EQ(error, "") << c.text;
    EXPECT_EQ(opacity.mode, c.expected.mode) << c.text;
    EXPECT_EQ(opacity.value, c.expected.value) << c.text;
    EXPECT_EQ(opacity.map, c.expected.map) << c.text;
    EXPECT_EQ(opacity.cutoff, c.expected.cutoff) << c.text;
  }
  for (
      const auto& [text, message] :
      {std::pair{R"(, "opacity": {"value": 1.5})", "materials[0].opacity.value: must be in [0, 1], got 1.5"},
       {R"(, "opacity": {"mode": "MASK", "cutoff": -1})", "materials[0].opacity.cutoff: must be in [0, 1], got -1"},
       {R"(, "opacity": {"map": {"texture": "u"}})",
        "materials[0].opacity.map.texture: unknown texture \"u\": textures must define it"},
       {R"(, "opacity": {"map": {"texture": "t"}}, "emission_flux": {"rgb": [1, 1, 1]})",
        "materials[0]: \"m\" states a power (emission_flux, or emission_strength in watt or lumen), but its opacity varies: "
        "give radiance or watts per square metre"}}) {
    std::string error;
    read_opacity(text, error);
    EXPECT_TRUE(error.ends_with(message)) << error;
  }
}

TEST(MaterialJson, NormalMapsAndBumpMapsAreRead) {
  const auto with_texture = [](const std::string& material) {
    std::string text = material_document(material);
    text.insert(1, R"("textures": [{"name": "t", "file": "t.png"}], )");
    return read_scene_json(text, "m.json");
  };
  const auto good = [&](const std::string& map) {
    const Result<SceneFile> file = with_texture(R"("mirror": {}, )" + map);
    EXPECT_TRUE(file.ok()) << file.status();
    const Result<Scene> back = unpack_scene(pack_scene(file->draft.scene));
    EXPECT_TRUE(back.ok()) << back.status();
    return back->materials[0];
  };
  EXPECT_EQ(good(R"("normal_map": {"texture": "t"})").normal_map, (NormalMap{0, 1}));
  EXPECT_EQ(good(R"("normal_map": {"texture": "t", "scale": -0.5})").normal_map, (NormalMap{0, -0.5}));
  EXPECT_EQ(good(R"("bump_map": {"texture": "t"})").bump_map, (BumpMap{{0, ScalarMap::Channel::luminance}, 1}));
  EXPECT_EQ(good(R"("bump_map": {"texture": "t", "channel": "B", "height": 0})").bump_map,
            (BumpMap{{0, ScalarMap::Channel::b}, 0}));
  const auto refusal = [&](const std::string& material) {
    const Result<SceneFile> bad = with_texture(material);
    const std::string message = bad.ok() ? "materials[0]: no error" : message_of(bad.status());
    return message.substr(message.find("materials[0]"));
  };
  EXPECT_EQ(refusal(R"("mirror": {}, "normal_map": {"texture": "u"})"),
            "materials[0].normal_map.texture: unknown texture \"u\": textures must define it");
  EXPECT_EQ(refusal(R"("mirror": {}, "normal_map": {"texture": "t"}, "bump_map": {"texture": "t"})"),
            "materials[0].bump_map: give either a normal map or a bump map");
  EXPECT_EQ(refusal(R"("shadow_catcher": {}, "bump_map": {"texture": "t"})"),
            "materials[0].bump_map: a shadow catcher has no shading normals");
  EXPECT_EQ(refusal(R"("mirror": {}, "bump_map": {"texture": "t", "height": 1e13})"),
            "materials[0].bump_map.height: must be in [-1000000000000, 1000000000000], got 10000000000000");
  EXPECT_EQ(refusal(R"("mirror": {}, "normal_map": {"texture": "t", "scale": 1e7})"),
            "materials[0].normal_map.scale: must be in [-1000000, 1000000], got 10000000");
}

TEST(MaterialJson, DiffuseMaterialsHaveARoughness) {
  const auto diffuse = [](const std::string& rest) {
    return R"("diffuse": {"reflectance": {"rgb": [0.5, 0.5, 0.5]})" + rest + "}";
  };
  EXPECT_EQ(std::get<DiffuseMaterial>(read(diffuse("")).kind).roughness, 0);
  EXPECT_EQ(std::get<DiffuseMaterial>(read(diffuse(R"(, "roughness": 0.25)")).kind).roughness, 0.25);
  EXPECT_TRUE(read(diffuse("") + R"(, "single_scattering": true)").single_scattering);
  for (const char* value : {"-0.1", "1.1"}) {
    EXPECT_NE(material_error(diffuse(fmt::format(R"(, "roughness": {})", value))).find("diffuse.roughness: must be in"),
              std::string::npos);
  }
}

TEST(MaterialJson, MixturesHaveTwoParts) {
  const Material material = read(
      R"("mixture": {"first": {"conductor": {"metal": "gold", "roughness": 0.4}, "single_scattering": true},
          "second": {"mixture": {"first": {"diffuse": {"reflectance": {"rgb": [0.5, 0.4, 0.3]}}}, "second": {"mirror": {}}}},
          "factor": 0.25})");
  const auto& mixture = std::get<MixtureMaterial>(material.kind);
  EXPECT_EQ(mixture.factor, 0.25);
  EXPECT_TRUE(mixture.first->single_scattering);
  EXPECT_EQ(std::get<ConductorMaterial>(mixture.first->kind).roughness, 0.4);
  const auto& inner = std::get<MixtureMaterial>(mixture.second->kind);
  EXPECT_EQ(inner.factor, 0.5);
  EXPECT_EQ(std::get<DiffuseMaterial>(inner.first->kind).reflectance, (RgbColor{0.5f, 0.4f, 0.3f}));
  EXPECT_TRUE(std::holds_alternative<MirrorMaterial>(inner.second->kind));
}

TEST(MaterialJson, RoughMaterialsCanScatterOnce) {
  for (const char* kind : {R"("conductor": {"metal": "gold"})", R"("dielectric": {})", R"("principled": {})",
                           R"("diffuse": {"reflectance": {"rgb": [1, 1, 1]}, "roughness": 1})"}) {
    EXPECT_FALSE(read(kind).single_scattering) << kind;
    EXPECT_TRUE(read(std::string(kind) + R"(, "single_scattering": true)").single_scattering) << kind;
  }
  EXPECT_EQ(material_error(R"("mirror": {}, "single_scattering": true)"),
            "m.json:2:64: materials[0].single_scattering: only a diffuse, dielectric, conductor or "
            "principled material has it");
}

TEST(MaterialJson, MapsNameTexturesAndChannels) {
  const auto with_texture = [](const std::string& material) {
    std::string text = material_document(material);
    text.insert(1, R"("textures": [{"name": "t", "file": "t.png"}], )");
    return read_scene_json(text, "m.json");
  };
  const Result<SceneFile> file = with_texture(
      R"("principled": {}, "roughness_map": {"texture": "t", "channel": "G"}, "metallic_map": {"texture": "t"})");
  ASSERT_TRUE(file.ok()) << file.status();
  const Result<Scene> back = unpack_scene(pack_scene(file->draft.scene));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->materials[0].roughness_map, (ScalarMap{0, ScalarMap::Channel::g}));
  EXPECT_EQ(back->materials[0].metallic_map, (ScalarMap{0, ScalarMap::Channel::luminance}));
  const auto refusal = [&](const std::string& material) {
    const std::string message = test::error_message(with_texture(material));
    return message.substr(message.find("materials[0]"));
  };
  const Result<SceneFile> layers = with_texture(
      R"("principled": {"specular_map": {"texture": "t", "channel": "R"}, "transmission": 0.5, "coat": 1, "transmission_map": {"texture": "t", "channel": "G"},
      "coat_map": {"texture": "t", "channel": "B"}, "coat_roughness_map": {"texture": "t", "channel": "A"},
      "sheen_roughness_map": {"texture": "t"}})");
  ASSERT_TRUE(layers.ok()) << layers.status();
  const Result<Scene> again = unpack_scene(pack_scene(layers->draft.scene));
  ASSERT_TRUE(again.ok()) << again.status();
  const auto& kind = std::get<PrincipledMaterial>(again->materials[0].kind);
  EXPECT_EQ(kind.specular_map, (ScalarMap{0, ScalarMap::Channel::r}));
  EXPECT_EQ(kind.transmission_map, (ScalarMap{0, ScalarMap::Channel::g}));
  EXPECT_EQ(kind.coat_map, (ScalarMap{0, ScalarMap::Channel::b}));
  EXPECT_EQ(kind.coat_roughness_map, (ScalarMap{0, ScalarMap::Channel::alpha}));
  EXPECT_EQ(kind.sheen_roughness_map, (ScalarMap{0, ScalarMap::Channel::luminance}));
  EXPECT_EQ(refusal(R"("principled": {"coat_map": {"texture": "t"}})"),
            "materials[0].principled.coat_map: multiplies coat, which must be above 0");
  EXPECT_EQ(refusal(R"("principled": {"coat_map": {"texture": "u"}})"),
            "materials[0].principled.coat_map.texture: unknown texture \"u\": textures must define it");
  EXPECT_EQ(refusal(R"("principled": {}, "roughness_map": {"texture": "u"})"),
            "materials[0].roughness_map.texture: unknown texture \"u\": textures must define it");
  EXPECT_EQ(refusal(R"("principled": {"roughness": 0}, "roughness_map": {"texture": "t"})"),
            "materials[0].roughness_map: multiplies the roughness of a diffuse, dielectric, conductor or principled "
            "material, which must be above 0");
  EXPECT_EQ(refusal(R"("mirror": {}, "metallic_map": {"texture": "t"})"),
            "materials[0].metallic_map: only a principled material has one");
  for (const char* more : {"", R"(, "rgb": [1, 1, 1])"}) {
    EXPECT_EQ(refusal(R"("dielectric": {}, "interior": {"color": {"texture": "t")" + std::string(more) + "}}"),
              "materials[0].interior.color.texture: only reflectances and emission can have a texture: give only "
              "rgb");
  }
}

}  // namespace
}  // namespace lightmill
