#include "common/scene_io/mtl.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill {
namespace {

std::vector<MtlMaterial> read_good(const std::string& text, const std::string& file = "box.mtl") {
  Faults faults;
  std::vector<MtlMaterial> read = read_mtl(text, file, faults);
  EXPECT_TRUE(faults.empty()) << faults.as_error();
  return read;
}

std::vector<Material> materials_of(const std::string& text, KaMeaning ka, std::vector<std::string>& notices) {
  Scene scene;
  map_materials(read_good(text), ka, scene, notices);
  return scene.materials;
}

TEST(Mtl, ModelsAreMapped) {
  std::vector<std::string> notices;
  const auto materials = materials_of(
      "newmtl a\nKd 0.1 0.2 0.3\nKs 1 1 1\nNs 10\nillum 1\nnewmtl b\nillum 3\nKs 0.5 0.5 0.5\nnewmtl c\nillum "
      "4\nnewmtl d\nNi 1.33\nillum 4\n"
      "newmtl e\nillum 3\nnewmtl f\nnewmtl g\nKd 0.5\nillum 0\n",
      KaMeaning::automatic, notices);
  ASSERT_EQ(materials.size(), 7u);
  EXPECT_EQ(std::get<DiffuseMaterial>(materials[0].kind).reflectance, (RgbColor{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(std::get<MirrorMaterial>(materials[1].kind).reflectance, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(std::get<DielectricMaterial>(materials[2].kind).ior, 1.5);
  EXPECT_EQ(std::get<DielectricMaterial>(materials[3].kind).ior, 1.33);
  EXPECT_EQ(std::get<MirrorMaterial>(materials[4].kind).reflectance, (RgbColor{1, 1, 1}));
  EXPECT_EQ(std::get<DiffuseMaterial>(materials[5].kind).reflectance, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(std::get<DiffuseMaterial>(materials[6].kind).reflectance, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_TRUE(notices.empty());
}

TEST(Mtl, GlossyMetalAndAbsorbingModelsAreMapped) {
  std::vector<std::string> notices;
  const auto materials = materials_of(
      "newmtl glossy\nKd 0.25 0.5 0\nKs 0.25 0.25 0.25\nNs 50\nillum 2\n"
      "newmtl bright\nKd 1 0.5 0\nKs 1 0 0\nillum 2\n"
      "newmtl amber\nKd 0.5 1 0\nNi 1.4\nillum 12\n"
      "newmtl gold\nKs 1 0.75 0.25\nNs 30\nillum 11\n"
      "newmtl chrome\nKd 0.5 0.5 0.5\nillum 11\n"
      "newmtl pbr\nKd 0.5 0.25 0\nPr 0.25\nPm 0.75\nPc 1\nPcr 0.125\nNi 1.3\nillum 2\n"
      "newmtl pane\nillum 7\nTf 1 0.5 1\n"
      "newmtl ground\nKa 1 1 1\nillum 10\n"
      "newmtl milk\nKd 0.5 1 1\nKs 2 3 4\nNi 1.3\nillum 13\n"
      "newmtl fog\nKs 2 3 4\nNi 1.3\nillum 14\n",
      KaMeaning::automatic, notices);
  const auto& glossy = std::get<PhongMaterial>(materials[0].kind);
  EXPECT_EQ(glossy.diffuse.rgb, (RgbColor{0.25f, 0.5f, 0}));
  EXPECT_EQ(glossy.specular.rgb, (RgbColor{0.25f, 0.25f, 0.25f}));
  EXPECT_EQ(glossy.exponent, 50);
  const auto& bright = std::get<PhongMaterial>(materials[1].kind);
  EXPECT_NEAR(bright.diffuse.rgb.r, 0.5f, 1e-5f);
  EXPECT_NEAR(bright.specular.rgb.r, 0.5f, 1e-5f);
  EXPECT_NEAR(bright.diffuse.rgb.g, 0.25f, 1e-5f);
  EXPECT_LE(bright.diffuse.rgb.r + bright.specular.rgb.r, 1);
  EXPECT_EQ(std::get<DielectricMaterial>(materials[2].kind).ior, 1.4);
  // σ = 1/ρ − 1
  EXPECT_EQ(materials[2].interior.absorption.r, 1);
  EXPECT_EQ(materials[2].interior.absorption.g, 0);
  EXPECT_GT(materials[2].interior.absorption.b, 1e6f);
  const auto& gold = std::get<PrincipledMaterial>(materials[3].kind);
  EXPECT_EQ(gold.metallic, 1);
  EXPECT_EQ(gold.base_color.rgb, (RgbColor{1, 0.75f, 0.25f}));
  EXPECT_DOUBLE_EQ(std::pow(gold.roughness, 4), 2.0 / 32);  // alpha² = 2 / (s + 2)
  EXPECT_EQ(std::get<PrincipledMaterial>(materials[4].kind).base_color.rgb, (RgbColor{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(std::get<PrincipledMaterial>(materials[4].kind).roughness, 0);
  const auto& pbr = std::get<PrincipledMaterial>(materials[5].kind);
  EXPECT_EQ(pbr.roughness, 0.25);
  EXPECT_EQ(pbr.metallic, 0.75);
  EXPECT_EQ(pbr.coat, 1);
  EXPECT_EQ(pbr.coat_roughness, 0.125);
  EXPECT_EQ(pbr.ior, 1.3);
  EXPECT_TRUE(std::holds_alternative<DielectricMaterial>(materials[6].kind));
  EXPECT_TRUE(std::holds_alternative<ShadowCatcherMaterial>(materials[7].kind));
  EXPECT_EQ(materials[7].emission, TexturedColor{});
  EXPECT_EQ(std::get<DielectricMaterial>(materials[8].kind).ior, 1.3);
  EXPECT_EQ(materials[8].interior.absorption, (RgbColor{1, 0, 0}));
  EXPECT_EQ(materials[8].interior.scattering, (RgbColor{2, 3, 4}));
  EXPECT_EQ(std::get<DielectricMaterial>(materials[9].kind).ior, 1);
  EXPECT_EQ(notices,
            (std::vector<std::string>{
                "Ka was read as emission, because only some materials have it: ground",
                "box.mtl:8: Kd + Ks of material \"bright\" is above 1, and both were scaled down: a surface "
                "cannot reflect more than it gets",
                "box.mtl:30: illum 7 of material \"pane\" was read as illum 4 (glass)",
                "left out: box.mtl:31: Tf of material \"pane\"",
                "box.mtl:39: illum 13 of material \"milk\" was read as glass that absorbs 1/Kd - 1 and scatters "
                "Ks per unit of length",
                "box.mtl:43: illum 14 of material \"fog\" was read as a medium without a surface that absorbs "
                "1/Kd - 1 and scatters Ks per unit of length"}));
}

TEST(Mtl, KaIsEmissionIfOnlySomeMaterialsHaveItAndNoneHasKe) {
  const std::string emitter_only = "newmtl white\nKd 1 1 1\nnewmtl lamp\nKa 3 2 1\n";
  const std::string everywhere = "newmtl white\nKd 1 1 1\nKa 1 1 1\nnewmtl lamp\nKa 1 1 1\n";
  const std::string with_ke = "newmtl white\nKd 1 1 1\nnewmtl lamp\nKa 3 2 1\nKe 9 8 7\n";
  std::vector<std::string> notices;
  auto materials = materials_of(emitter_only, KaMeaning::automatic, notices);
  EXPECT_EQ(materials[0].emission, RgbColor{});
  EXPECT_EQ(materials[1].emission, (RgbColor{3, 2, 1}));
  EXPECT_TRUE(materials[1].two_sided_emission);
  EXPECT_EQ(std::get<DiffuseMaterial>(materials[1].kind).reflectance, RgbColor{});
  EXPECT_EQ(notices, std::vector<std::string>{"Ka was read as emission, because only some materials have it: lamp"});

  notices.clear();
  EXPECT_EQ(materials_of(emitter_only, KaMeaning::ambient, notices)[1].emission, RgbColor{});
  EXPECT_EQ(notices, std::vector<std::string>{"Ka was read as ambient light and left out, as requested"});
  notices.clear();
  materials_of("newmtl white\nKd 1 1 1\nKa 0 0 0\n", KaMeaning::ambient, notices);
  EXPECT_TRUE(notices.empty());

  materials = materials_of(everywhere, KaMeaning::automatic, notices);
  EXPECT_EQ(materials[1].emission, RgbColor{});
  EXPECT_FALSE(materials[1].two_sided_emission);
  EXPECT_EQ(notices,
            std::vector<std::string>{"Ka was read as ambient light and left out, because all materials have it"});
  EXPECT_EQ(materials_of(everywhere, KaMeaning::emission, notices)[0].emission, (RgbColor{1, 1, 1}));

  notices.clear();
  EXPECT_EQ(materials_of(with_ke, KaMeaning::automatic, notices)[1].emission, (RgbColor{9, 8, 7}));
  EXPECT_EQ(notices,
            std::vector<std::string>{"Ka was read as ambient light and left out, because materials emit by Ke"});
}

TEST(Mtl, NormsAreNormalMapsAndBumpsAreHeights) {
  std::vector<std::string> notices;
  Scene scene;
  map_materials(
      read_good("newmtl norm\nnorm -bm 0.5 n.png\nbump b.png\nnewmtl bump\nmap_bump -bm 0.25 -imfchan g b.png\n"
                "newmtl blender\nmap_Bump -bm 2 Wall_NORMAL.png\nnewmtl plain\nillum 3\nbump b.png\n"
                "newmtl hold\nillum 10\nbump b.png\n"),
      KaMeaning::automatic, scene, notices);
  const auto& materials = scene.materials;
  EXPECT_EQ(materials[0].normal_map, (NormalMap{0, 0.5}));
  EXPECT_EQ(materials[0].bump_map, BumpMap{});
  EXPECT_EQ(materials[1].bump_map, (BumpMap{{1, ScalarMap::Channel::g}, 0.25}));
  EXPECT_EQ(materials[1].normal_map, NormalMap{});
  EXPECT_EQ(materials[2].normal_map, (NormalMap{2, 2}));
  EXPECT_EQ(materials[3].bump_map, (BumpMap{{1, ScalarMap::Channel::luminance}, 1}));
  EXPECT_FALSE(has_mapped_normals(materials[4]));
  for (const TextureImage& texture : scene.textures) {
    EXPECT_EQ(texture.color_space, TextureImage::ColorSpace::linear) << texture.file;
  }
  EXPECT_EQ(notices, (std::vector<std::string>{
                         "left out: box.mtl:3: bump of material \"norm\" and of 1 other",
                         "box.mtl:7: map_Bump of material \"blender\" was read as a normal map, because of its name"}));
}

TEST(Mtl, OmissionsAreReported) {
  std::vector<std::string> notices;
  const auto materials = materials_of(
      "newmtl a\nKd 2 1 1\nmap_Pr a.png\nd 0.5\nrefl b.png\nnewmtl b\nillum 13\nKs 1 1 1\nnewmtl c\nillum 2\n"
      "Ks 0 0 0\nnewmtl d\nillum 77\nnewmtl e\nKs 0 0 0.5\n",
      KaMeaning::automatic, notices);
  const auto& a = std::get<PrincipledMaterial>(materials[0].kind);
  EXPECT_EQ(a.base_color.rgb, (RgbColor{1, 1, 1}));
  EXPECT_EQ(a.roughness, 1);
  EXPECT_EQ(a.metallic, 0);
  EXPECT_EQ(materials[0].roughness_map, (ScalarMap{0, ScalarMap::Channel::luminance}));
  EXPECT_EQ(
      notices,
      (std::vector<std::string>{
          "box.mtl:2: Kd of material \"a\" is above 1 and was cut: a surface cannot reflect more than it gets",
          "left out: box.mtl:5: refl of material \"a\"",
          "box.mtl:7: illum 13 of material \"b\" was read as glass that absorbs 1/Kd - 1 and scatters Ks per unit of "
          "length",
          "left out: box.mtl:13: illum 77 of material \"d\". It is rendered as diffuse",
          "left out: box.mtl:15: Ks of material \"e\". Without illum it is diffuse, with illum 2 it is glossy"}));
}

TEST(Mtl, UnknownStatementsAreNamedOnceAtTheirFirstLine) {
  std::vector<std::string> notices;
  materials_of(
      "newmtl a\nKd 1 1 1\nPs 0.5\n\nPs 0.25\nfoo bar\nnewmtl b\nPs 1\nsharpness 60\nKm 1\nd 0.5\n"
      "newmtl c\nPs 1\nTr 0.5\n",
      KaMeaning::automatic, notices);
  EXPECT_EQ(notices, (std::vector<std::string>{"left out: box.mtl:3: Ps of material \"a\" and of 2 others",
                                               "left out: box.mtl:6: foo of material \"a\"",
                                               "left out: box.mtl:9: sharpness of material \"b\"",
                                               "left out: box.mtl:10: Km of material \"b\""}));
}

TEST(Mtl, TheListOfOmissionsIsBounded) {
  std::vector<std::string> notices;
  std::string text;
  for (int i = 0; i < 200'000; ++i) {  // seconds, or minutes where all are compared with all
    text += fmt::format("{}x{} 1\n", i % 1000 == 0 ? fmt::format("newmtl m{}\n", i) : "", i);
  }
  const std::vector<MtlMaterial> read = read_good(text + std::string(100'000, 'y') + " 1");
  EXPECT_EQ(read.front().unused.size(), kMaxMtlUnused);
  EXPECT_EQ(read.front().unused.back(), (MtlUnused{"more statements"}));
  EXPECT_EQ(read.front().unused.back().line, 1 + static_cast<int>(kMaxMtlUnused));
  Scene scene;
  map_materials(read, KaMeaning::automatic, scene, notices);
  ASSERT_EQ(notices.size(), 101u);
  EXPECT_EQ(notices.front(), "left out: box.mtl:2: x0 of material \"m0\"");
  EXPECT_TRUE(notices.back().starts_with("left out: ")) << notices.back();
  EXPECT_TRUE(notices.back().ends_with(" more in materials")) << notices.back();
}

TEST(Mtl, MapOptionsAreRead) {
  const std::vector<MtlMaterial> read = read_good(
      "newmtl a\r\nmap_Kd -s 2 3 1 -o 0.5 -clamp on -blendu off -mm 0 1 my wood.png \\\r\n# a comment\n"
      "map_kd -boost 2 -s 4 second.png\nmap_Pr -imfchan g rough.png\nmap_Ke -weird.png\n"
      "map_Kd -mm 0.1 2 -t 1 1 third -s.png\nbump -bm 0.5 b.png\nmap_Bump c.png\nrefl -type sphere d.png\n");
  const MtlMaterial& material = read.front();
  EXPECT_EQ(material.maps, (std::vector<MtlMap>{{"map_Pr", "rough.png", {1, 1}, {0, 0}, false, 'g'},
                                                {"map_Ke", "-weird.png", {1, 1}, {0, 0}, false},
                                                {"map_Kd", "third -s.png", {1, 1}, {0, 0}, false},
                                                {"bump", "b.png", {1, 1}, {0, 0}, false, 0, 0.5},
                                                {"map_Bump", "c.png", {1, 1}, {0, 0}, false}}));
  EXPECT_EQ(material.unused, (std::vector<MtlUnused>{{"map_Kd -mm"}, {"map_Kd -t"}, {"refl -type"}, {"refl"}}));
  const std::vector<MtlMaterial> first = read_good("newmtl a\nmap_Kd -s 2 3 1 -o 0.5 -clamp on my wood.png");
  EXPECT_EQ(*first.front().map("map_Kd"), (MtlMap{"map_Kd", "my wood.png", {2, 3}, {0.5, 0}, true}));
  EXPECT_EQ(first.front().map("map_Ks"), nullptr);
}

TEST(Mtl, MapsBecomeTextures) {
  const std::vector<MtlMaterial> read = read_good(
      "newmtl a\nKd 0.5 0.5 0.5\nmap_Kd -s 2 3 -o 0.5 -clamp on wood.png\nnewmtl b\nmap_Kd wood.png\nnewmtl c\n"
      "map_Kd wood.png\nillum 3\nmap_Ks m.png\nnewmtl d\nmap_Ke glow.png\n",
      "folder/box.mtl");
  Scene scene;
  std::vector<std::string> notices;
  map_materials(read, KaMeaning::automatic, scene, notices);
  ASSERT_EQ(scene.textures.size(), 4u);
  const TextureImage& wood = scene.textures[0];
  EXPECT_EQ(wood.file, "folder/wood.png");
  EXPECT_EQ(wood.scale, (std::array<double, 2>{2, 3}));
  EXPECT_EQ(wood.offset, (std::array<double, 2>{0.5, 0}));
  EXPECT_EQ(wood.wrap, (std::array{TextureImage::Wrap::clamp, TextureImage::Wrap::clamp}));
  EXPECT_EQ(scene.textures[1].wrap, (std::array{TextureImage::Wrap::repeat, TextureImage::Wrap::repeat}));
  EXPECT_EQ(std::get<DiffuseMaterial>(scene.materials[0].kind).reflectance, (TexturedColor{{0.5f, 0.5f, 0.5f}, 0}));
  EXPECT_EQ(std::get<DiffuseMaterial>(scene.materials[1].kind).reflectance, (TexturedColor{{1, 1, 1}, 1}));
  EXPECT_EQ(std::get<MirrorMaterial>(scene.materials[2].kind).reflectance, (TexturedColor{{1, 1, 1}, 2}));
  EXPECT_EQ(scene.materials[3].emission, (TexturedColor{{1, 1, 1}, 3}));
  EXPECT_TRUE(scene.materials[3].two_sided_emission);
  EXPECT_EQ(notices, std::vector<std::string>{"left out: folder/box.mtl:7: map_Kd of material \"c\""});
}

TEST(Mtl, OpacityIsDElseOneMinusTrTimesItsMap) {
  using enum ScalarMap::Channel;
  struct Case {
    std::string text;
    std::optional<double> value;  // opaque without
    std::optional<ScalarMap::Channel> channel = {};
    std::vector<std::string> notices = {};
  };
  for (const Case& c :
       std::vector<Case>{{"Kd 1 0 0", {}},
                         {"d 1", {}},
                         {"Tr 0", {}},
                         {"d 0.25", 0.25},
                         {"Tr 0.25", 0.75},
                         {"d 0.5\nTr 0.75", 0.5},  // d counts, in either order
                         {"Tr 0.75\nd 0.5", 0.5},
                         {"d 1\nTr 1", {}},
                         {"illum 2\nKs 0.5 0.5 0.5\nd 0.25", 0.25},
                         {"illum 3\nd 0.25", 0.25},
                         {"Pr 0.5\nd 0.25", 0.25},
                         {"illum 4\nd 0.25", {}},  // glass is transparent as it is
                         {"illum 4\nPr 0.5\nd 0.25", {}},
                         {"map_d leaf.png", 1.0, luminance},
                         {"d 0.5\nmap_d leaf.png", 0.5, luminance},
                         {"map_d -imfchan r leaf.png", 1.0, r},
                         {"map_Kd leaf.png\nmap_d leaf.png", 1.0, alpha},  // one image with colour and alpha
                         {"map_Kd leaf.png\nmap_d -imfchan l leaf.png", 1.0, luminance},
                         {"map_Kd leaf.png\nmap_d cut.png", 1.0, luminance},
                         {"illum 4\nmap_d leaf.png", {}, {}, {"left out: box.mtl:3: map_d of material \"a\""}}}) {
    std::vector<std::string> notices;
    Scene scene;
    map_materials(read_good("newmtl a\n" + c.text + "\nnewmtl b\n"), KaMeaning::automatic, scene, notices);
    const Opacity& opacity = scene.materials.at(0).opacity;
    EXPECT_EQ(notices, c.notices) << c.text;
    EXPECT_EQ(opacity.mode, c.value ? Opacity::Mode::blend : Opacity::Mode::opaque) << c.text;
    EXPECT_EQ(opacity.value, c.value.value_or(1)) << c.text;
    ASSERT_EQ(opacity.map.texture != kNoTexture, c.channel.has_value()) << c.text;
    if (c.channel) {
      EXPECT_EQ(opacity.map.channel, *c.channel) << c.text;
      EXPECT_EQ(scene.textures.at(opacity.map.texture).color_space, TextureImage::ColorSpace::linear) << c.text;
    }
  }
}

TEST(Mtl, OpacityIsIgnoredIfNothingWouldBeVisible) {
  std::vector<std::string> notices;
  for (const Material& material : materials_of("newmtl a\nTr 1\nnewmtl b\nd 0\n", KaMeaning::automatic, notices)) {
    EXPECT_EQ(material.opacity.mode, Opacity::Mode::opaque);
  }
  EXPECT_EQ(notices,
            std::vector<std::string>{"d and Tr were left out, because by them all materials would be invisible"});
}

TEST(Mtl, NumbersAreRead) {
  const std::vector<MtlMaterial> read = read_good(
      "newmtl a\nNs 50\nd -halo 0.25\nPr 0.5\nPm 1\nPc .5\nPcr .1\nTf 1 .5 0\nnewmtl b\nTr 0.25\n"
      "Kd spectral a.rfl 1\nKs xyz 1 1 1\nsharpness 60\n");
  const MtlMaterial& a = read.front();
  EXPECT_EQ(a.exponent, 50);
  EXPECT_EQ(a.opacity, 0.25);
  EXPECT_EQ(a.roughness, 0.5);
  EXPECT_EQ(a.metallic, 1);
  EXPECT_EQ(a.coat, 0.5);
  EXPECT_EQ(a.coat_roughness, 0.1);
  EXPECT_EQ(a.tf, (RgbColor{1, 0.5f, 0}));
  EXPECT_EQ(read[1].opacity, 0.75);
  EXPECT_EQ(read[1].unused, (std::vector<MtlUnused>{{"Kd spectral"}, {"Ks xyz"}, {"sharpness"}}));
}

TEST(Mtl, WrongStatementsAreSkippedAndNamedWithTheirPlace) {
  const auto fault = [](const std::string& text) {
    Faults faults;
    read_mtl(text, "box.mtl", faults);
    const std::vector<std::string> all = faults.notices();
    EXPECT_EQ(all.size(), 1u) << text;
    constexpr std::string_view kAnswer = ". The line is skipped";
    EXPECT_TRUE(!all.empty() && all[0].ends_with(kAnswer)) << text;
    return all.empty() ? "" : all[0].substr(0, all[0].size() - kAnswer.size());
  };
  EXPECT_EQ(fault("Kd 1 1 1"), "box.mtl:1: newmtl is expected before \"Kd\"");
  EXPECT_EQ(fault("newmtl"), "box.mtl:1: newmtl: the name of a material is expected");
  EXPECT_EQ(fault("newmtl a\nKd 1 1"), "box.mtl:2: Kd: three numbers are expected, got 2");
  EXPECT_EQ(fault("newmtl a\nKd 1 1 1 1"), "box.mtl:2: Kd: three numbers are expected, got more");
  EXPECT_EQ(fault("newmtl a\nKd 1 nan 1"), "box.mtl:2: Kd: a finite number is expected, got \"nan\"");
  EXPECT_EQ(fault("newmtl a\nKe 1 -1 1"), "box.mtl:2: Ke: numbers from 0 to 1e20 are expected, got -1");
  EXPECT_EQ(fault("newmtl a\nNi x"), "box.mtl:2: Ni: a number in (0, 10] is expected, got \"x\"");
  EXPECT_EQ(fault("newmtl a\nNi 0"), "box.mtl:2: Ni: a number in (0, 10] is expected, got \"0\"");
  EXPECT_EQ(fault("newmtl a\nd x"), "box.mtl:2: d: a number from 0 to 1 is expected, got \"x\"");
  EXPECT_EQ(fault("newmtl a\nTr -1"), "box.mtl:2: Tr: a number from 0 to 1 is expected, got \"-1\"");
  EXPECT_EQ(fault("newmtl a\nNs -1"), "box.mtl:2: Ns: a number from 0 to 1000000000 is expected, got \"-1\"");
  EXPECT_EQ(fault("newmtl a\nmap_Kd"), "box.mtl:2: map_Kd: the name of a file is expected");
  EXPECT_EQ(fault("newmtl a\nmap_Kd -clamp x a.png"), "box.mtl:2: map_Kd: -clamp: on or off is expected, got \"x\"");
  EXPECT_EQ(fault("newmtl a\nmap_Kd -s a.png"), "box.mtl:2: map_Kd: -s: one to three numbers are expected");
  EXPECT_EQ(fault("newmtl a\nmap_Kd -s 1e7 a.png"),
            "box.mtl:2: map_Kd: -s: numbers of at most 1e6 are expected, got 10000000");
  EXPECT_EQ(fault("newmtl a\nmap_Kd -mm 1 a.png"), "box.mtl:2: map_Kd: -mm: 2 numbers are expected, got 1");
  EXPECT_EQ(fault("newmtl a\nmap_Pr -imfchan q a.png"),
            "box.mtl:2: map_Pr: -imfchan: one of r, g, b, m, l, z is expected, got \"q\"");
  EXPECT_EQ(fault("newmtl a\nillum x"), "box.mtl:2: illum: the number of an illumination model is expected, got \"x\"");
}

TEST(Mtl, AWrongStatementChangesNothingElse) {
  Faults faults;
  const std::vector<MtlMaterial> read =
      read_mtl("newmtl a\rKd 1 0 0\rKd 1 2\rNs x\rillum 2\rnewmtl b\rKd 0 1 0\r", "box.mtl", faults);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].kd, (RgbColor{1, 0, 0}));
  EXPECT_EQ(read[0].illum, 2);
  EXPECT_FALSE(read[0].exponent);
  EXPECT_EQ(read[1].kd, (RgbColor{0, 1, 0}));
  EXPECT_EQ(faults.notices(),
            (std::vector<std::string>{
                "box.mtl:3: Kd: three numbers are expected, got 2. The line is skipped",
                "box.mtl:4: Ns: a number from 0 to 1000000000 is expected, got \"x\". The line is skipped"}));
}

}  // namespace
}  // namespace lightmill
