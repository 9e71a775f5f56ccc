// Mixtures of materials through public scene documents: all methods show the weighted mean of the parts.
#include <cmath>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string part(const std::string& kind, double reflectance) {
  return fmt::format(R"("{}": {{"reflectance": {}}})", kind, gray(reflectance));
}
std::string mixture(const std::string& first, const std::string& second, double factor) {
  return fmt::format(R"("mixture": {{"first": {{{}}}, "second": {{{}}}, "factor": {}}})", first, second, factor);
}

TEST(Mixtures, ShowTheMeanOfTheirParts) {
  // A floor at the distance 1 below a point light of 1 W/sr, seen from above: (ρ/π) · cos / d².
  const std::string kind = mixture(part("diffuse", 0.2), part("diffuse", 0.8), 0.25);
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 1, 0], "look_at": [0, 0, 0], "up": [1, 0, 0])", 0.01, 8, named("floor", kind),
               mesh("floor", "floor.obj"), R"({"point": {"position": [0, 1, 0], "intensity": {"rgb": [1, 1, 1]}}})"),
      {{"floor.obj", plane(20, 0, true)}});
  for (const char* method : {"path", "vcm:photons=500", "whitted", "raycast"}) {
    expect_answer(mean_of(scene.render({method, 41, 1}, 10), 0), 0.35 / M_PI, 2e-2);
  }
}

TEST(Mixtures, RoomsHaveTheRadianceOfTheMeanAlbedo) {
  // A closed room whose walls emit 1 and reflect half of the light has the radiance 1/(1 − 1/2), whatever the BSDF.
  const std::string half_mirror = mixture(part("mirror", 0.5), part("diffuse", 0.5), 0.5);
  const std::string nested =
      mixture(part("mirror", 0.5), mixture(part("diffuse", 0.2), part("diffuse", 0.8), 0.5), 0.75);
  const auto seen_in = [](const std::string& kind, const char* method) {
    const auto scene = TestScene::from_text(document(R"("eye": [0, 0.2, 0.1], "look_at": [0.3, 0.1, -1])", 60, 32,
                                                     named("wall", kind, 1), sphere("wall", "[0, 0, 0]", 1, true)));
    return mean_of(scene.render({method, 42, 0}, 6), 1);
  };
  for (const char* method : {"path", "caustic:photons=5000", "vcm:photons=2000"}) {
    // Merging photons on a curved wall has a bias, which diffuse rooms have, too.
    const double bias = std::abs(seen_in(part("diffuse", 0.5), method).value - 2);
    EXPECT_LT(bias, 1.5e-2) << method;
    for (const std::string& kind : {half_mirror, nested, mixture(part("diffuse", 0), part("mirror", 1), 0.5)}) {
      const Estimate seen = seen_in(kind, method);
      EXPECT_LT(seen.standard_error, 2e-2) << method << kind;
      EXPECT_NEAR(seen.value, 2, 5 * seen.standard_error + bias) << method << kind;
    }
  }
}

TEST(Mixtures, GlassAndWhiteAreInvisibleInUniformLight) {
  const std::string white = part("diffuse", 1),
                    metal = R"("conductor": {"eta": {"rgb": [1, 1, 1]}, "k": {"rgb": [1000, 1000, 1000]}})";
  for (const std::string& kind :
       {mixture(R"("dielectric": {})", white, 0.5), mixture(white, R"("dielectric": {"roughness": 0.5})", 0.25),
        mixture(mixture(R"("dielectric": {})", R"("dielectric": {"roughness": 0.3})", 0.5), metal, 0.3)}) {
    const auto scene = TestScene::from_text(document(
        R"("eye": [0.5, 2, 4], "look_at": [0, 0, 0])", 40, 32, named("ball", kind) + "," + diffuse("sky", 0, 1),
        sphere("ball", "[0, 0, 0]", 1) + "," + sphere("sky", "[0, 0, 0]", 9, true)));
    for (const char* method : {"path", "caustic:photons=5000", "vcm:photons=10000"}) {
      const Estimate seen = mean_of(scene.render({method, 45, 0}, 6), 1);
      EXPECT_LT(seen.standard_error, 1e-2) << method << kind;
      EXPECT_NEAR(seen.value, 1, 5 * seen.standard_error + 6e-3) << method << kind;
    }
  }
}

TEST(Mixtures, GlassPartsAbsorbInside) {
  // The camera looks along a diameter of a ball of index 1 whose surface is half black.
  const std::string kind = mixture(R"("dielectric": {"ior": 1})", part("diffuse", 0), 0.5) +
                           R"(, "interior": {"absorption": {"rgb": [0.3, 0.3, 0.3]}})";
  const auto scene = TestScene::from_text(
      document(R"("eye": [0, 0, 4], "look_at": [0, 0, 0])", 0.01, 8, named("ball", kind) + "," + diffuse("sky", 0, 1),
               sphere("ball", "[0, 0, 0]", 1) + "," + sphere("sky", "[0, 0, 0]", 9, true)));
  for (const char* method : {"path", "vcm:photons=500"}) {
    const Estimate seen = mean_of(scene.render({method, 46, 0}, 12), 0);
    EXPECT_LT(seen.standard_error, 5e-3) << method;
    EXPECT_NEAR(seen.value, 0.25 * std::exp(-0.6), 5 * seen.standard_error + 1e-5) << method;
  }
}

TEST(Mixtures, AllMethodsAgreeOnCausticsOfHalfMirrorsAndHalfGlass) {
  for (const std::string& ball : {mixture(part("diffuse", 0.4), part("mirror", 0.9), 0.6),
                                  mixture(part("diffuse", 0.4), R"("dielectric": {"roughness": 0.1})", 0.6)}) {
    const auto scene =
        TestScene::from_text(document(R"("eye": [0, 3, 0.5], "look_at": [0, 0, 0.5], "up": [0, 0, -1])", 50, 32,
                                      named("ball", ball) + "," + diffuse("floor", 0.7) + "," + diffuse("lamp", 0, 20),
                                      sphere("ball", "[0, 0.5, 0]", 0.5) + "," + sphere("lamp", "[1.5, 2, 1]", 0.3) +
                                          "," + mesh("floor", "floor.obj")),
                             {{"floor.obj", plane(8, 0, true)}});
    const Estimate path = mean_of(scene.render({"path", 43, 0}, 11), 1);
    for (const char* method : {"caustic:photons=20000", "vcm:photons=4000"}) {
      const Estimate other = mean_of(scene.render({method, 44, 0}, 7), 1);
      const double error = std::hypot(path.standard_error, other.standard_error);
      EXPECT_LT(error, 1e-2 * path.value) << method;
      EXPECT_NEAR(other.value, path.value, 5 * error + 3e-3 * path.value) << method;
    }
  }
}

TEST(Mixtures, RefuseShadowCatchersTwoIndicesAndTooManyParts) {
  const auto why = [](const std::string& kind) {
    return refusal(document(R"("eye": [0, 1, 0], "look_at": [0, 0, 0], "up": [1, 0, 0])", 1, 8, named("floor", kind),
                            sphere("floor", "[0, 0, 0]", 1)));
  };
  const std::string grey = part("diffuse", 0.5);
  EXPECT_NE(why(mixture(R"("dielectric": {})", R"("dielectric": {"ior": 1.3})", 0.5)).find("got 1.5 and 1.3"),
            std::string::npos);
  EXPECT_NE(why(mixture(R"("shadow_catcher": {})", grey, 0.5)).find("mixture.first: a shadow catcher"),
            std::string::npos);
  EXPECT_NE(why(mixture(grey, grey, 1.5)).find("mixture.factor"), std::string::npos);
  EXPECT_NE(why(mixture(grey + R"(, "name": "inner")", grey, 0.5)).find("a part of a mixture has only"),
            std::string::npos);
  std::string deep = grey;
  for (int i = 0; i < 16; ++i) {
    deep = mixture(grey, deep, 0.5);
  }
  EXPECT_NE(why(deep).find("at most 16 parts are possible, got 17"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test
