// XML, transforms, sensors and emitters of Mitsuba scenes.
#include "tests/unit/scene_io/mitsuba_fixture.h"

#include <cmath>
#include <numbers>

namespace lightmill::test {
namespace {

using std::numbers::pi;

SphereShape sphere_of(const std::string& body, const TextFiles& files = {}) {
  const LoadedScene loaded = mitsuba_scene(body, files);
  return loaded.scene.objects.empty() ? SphereShape{} : std::get<SphereShape>(loaded.scene.objects.back().shape);
}

/// The centre of a sphere around the origin after the steps of a transform.
Point3d center_after(const std::string& steps, const std::string& center = "") {
  return sphere_of("<shape type=\"sphere\">" + center + "<transform name=\"to_world\">" + steps +
                   "</transform></shape>")
      .center;
}

TEST(MitsubaTransforms, ApplyTheFirstFirst) {
  expect_near(center_after(R"(<translate x="1" y="2" z="3"/>)"), {1, 2, 3});
  expect_near(center_after(R"(<translate value="1, 2, 3"/><scale value="2"/>)"), {2, 4, 6});
  expect_near(center_after(R"(<scale value="2"/><translate value="1 2 3"/>)"), {1, 2, 3});
  expect_near(center_after(R"(<translate x="1"/><rotate z="1" angle="90"/>)"), {0, 1, 0});
  expect_near(center_after(R"(<matrix value="1 0 0 7 0 1 0 8 0 0 1 9 0 0 0 1"/>)"), {7, 8, 9});
  expect_near(center_after(R"(<translate x="1"/><matrix value="0 1 0 1 0 0 0 0 1"/>)"), {0, 1, 0});
  // A camera at (1, 2, 3) that looks along +x has +z there and +x on its left: up × ahead is −z.
  const std::string look = R"(<lookat origin="1, 2, 3" target="9, 2, 3" up="0, 1, 0"/>)";
  expect_near(center_after(R"(<translate z="4"/>)" + look), {5, 2, 3});
  expect_near(center_after(R"(<translate x="1"/>)" + look), {1, 2, 2});
}

TEST(MitsubaTransforms, ApplyAfterCenterAndRadius) {
  const SphereShape ball = sphere_of(R"(<shape type="sphere"><point name="center" x="1" y="0" z="0"/>
<float name="radius" value="0.5"/><transform name="to_world"><scale value="3"/></transform></shape>)");
  expect_near(ball.center, {3, 0, 0});
  EXPECT_NEAR(ball.radius, 1.5, 1e-12);
}

double radius_of(const std::string& defaults, const std::string& value) {
  return sphere_of(defaults + "<shape type=\"sphere\"><float name=\"radius\" value=\"" + value + "\"/></shape>").radius;
}

TEST(MitsubaXml, DefaultsStandForTheirNames) {
  EXPECT_EQ(radius_of(R"(<default name="r" value="2"/>)", "$r"), 2);
  EXPECT_EQ(radius_of(R"(<default name="r" value="2"/><default name="r" value="3"/>)", "$r"), 2);
  EXPECT_EQ(radius_of(R"(<default name="r" value="2"/><default name="rr" value="3"/>)", "$rr"), 3);
  EXPECT_EQ(radius_of(R"(<default name="r" value="2"/>)", "1$r.5"), 12.5);
  EXPECT_EQ(radius_of(R"(<default name="a" value="2"/><default name="b" value="1$a"/>)", "$b"), 12);
  EXPECT_EQ(mitsuba_error("\n<shape type=\"sphere\"><float name=\"radius\" value=\"$none\"/></shape>"),
            "a.xml:3: there is no default for $none");
  EXPECT_EQ(mitsuba_scene(R"(<shape type="sphere" id="a\$b"/>)").scene.objects[0].name, "a$b");
}

TEST(MitsubaXml, IncludedFilesAddTheirObjects) {
  const TextFiles files{
      {"parts/a.xml", "<scene version=\"3.0.0\">\n<include filename=\"b.xml\"/></scene>"},
      {"parts/b.xml", "<shape version=\"3.0.0\" type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>"}};
  EXPECT_EQ(sphere_of(R"(<default name="r" value="4"/><include filename="parts/a.xml"/>)", files).radius, 4);
  EXPECT_EQ(mitsuba_error("<include filename=\"parts/a.xml\"/>", files), "parts/b.xml:1: there is no default for $r");
  EXPECT_EQ(mitsuba_error("\n<include filename=\"none.xml\"/>"), "a.xml:3: cannot open none.xml");
  EXPECT_EQ(mitsuba_error("<include filename=\"c.xml\"/>",
                          {{"c.xml", "<scene version=\"3.0.0\">\n<include filename=\"c.xml\"/></scene>"}}),
            "c.xml:2: at most 10000 files can be included, 15 deep");
}

TEST(MitsubaXml, PathsAreSearchedFirst) {
  const LoadedScene loaded = mitsuba_scene(R"(<path value="common"/><shape type="sphere"><bsdf type="diffuse">
<texture name="reflectance" type="bitmap"><string name="filename" value="a.png"/></texture></bsdf></shape>)",
                                           {{"common/a.png", "picture"}, {"a.png", "another"}});
  EXPECT_EQ(loaded.scene.textures.at(0).file, "common/a.png");
  EXPECT_EQ(sphere_of(R"(<path value="common"/><include filename="b.xml"/>)",
                      {{"common/b.xml", "<scene version=\"3.0.0\"><shape type=\"sphere\"/></scene>"}})
                .radius,
            1);
}

TEST(MitsubaXml, ReferencesNameObjectsAnywhere) {
  const LoadedScene loaded = mitsuba_scene(R"(<shape type="sphere"><ref id="red"/></shape>
<shape type="sphere"><ref name="any" id="other"/></shape>
<bsdf type="diffuse" id="red"><rgb name="reflectance" value="1, 0, 0"/></bsdf><alias id="red" as="other"/>)");
  ASSERT_EQ(loaded.scene.materials.size(), 1u);
  EXPECT_EQ(loaded.scene.materials[0].name, "red");
  EXPECT_EQ(loaded.scene.objects[1].material, 0u);
  EXPECT_EQ(mitsuba_error("<shape type=\"sphere\">\n<ref id=\"blue\"/></shape>"),
            "a.xml:3: there is no object with the id \"blue\"");
  EXPECT_EQ(mitsuba_error("<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"diffuse\" id=\"a\"/>"),
            "a.xml:3: there are two objects with the id \"a\"");
}

TEST(MitsubaXml, ParametersOfOldFilesGetTheirLaterNames) {
  const Result<LoadedScene> loaded = read_xml(R"(<scene version="0.6.0"><shape type="sphere">
<transform name="toWorld"><scale value="2"/></transform>
<bsdf type="diffuse"><rgb name="diffuseReflectance" value="0.25"/></bsdf></shape>
<shape type="cube"><bsdf type="dielectric"><float name="intIOR" value="1.5"/><float name="extIOR" value="1"/></bsdf></shape></scene>)");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(std::get<SphereShape>(loaded->scene.objects[0].shape).radius, 2);
  EXPECT_EQ(std::get<DiffuseMaterial>(loaded->scene.materials[0].kind).reflectance, TexturedColor(0.25f, 0.25f, 0.25f));
  EXPECT_EQ(std::get<DielectricMaterial>(loaded->scene.materials[1].kind).ior, 1.5);
}

// Mitsuba moves the coordinates, then scales them.
TEST(MitsubaXml, TexturesOfOldFilesHaveScalesAndOffsets) {
  const Result<LoadedScene> loaded = read_xml(R"(<scene version="0.6.0"><shape type="sphere">
<boolean name="flipNormals" value="True"/><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<float name="uscale" value="2"/><float name="uoffset" value="0.25"/><float name="vscale" value="3"/></texture></bsdf></shape></scene>)");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_TRUE(loaded->faults.empty());
  EXPECT_EQ(loaded->scene.textures.at(0).scale, (std::array<double, 2>{2, 3}));
  EXPECT_EQ(loaded->scene.textures.at(0).offset, (std::array<double, 2>{0.5, -2}));  // 1 − 3(1 − v) = 3v − 2
}

TEST(MitsubaXml, MistakesHaveTheirLine) {
  const auto in_sphere = [](const std::string& what) { return "<shape type=\"sphere\">\n" + what + "</shape>"; };
  const std::vector<std::pair<std::string, std::string>> cases{
      {"<shape type=\"sphere\">", "a.xml:3: the XML cannot be read: Start-end tags mismatch"},
      {"<sphere/>", "a.xml:2: <sphere> cannot be read here"},
      {"text", "a.xml:1: <scene> has text between its tags"},
      {"<bsdf type=\"diffuse\"><path value=\".\"/></bsdf>", "a.xml:2: <path> cannot be read here"},
      {in_sphere("<float name=\"radius\"/>"), "a.xml:3: <float>: the attribute \"value\" is missing"},
      {in_sphere("<float name=\"radius\" value=\"1\" unit=\"m\"/>"), "a.xml:3: <float>: unknown attribute \"unit\""},
      {in_sphere("<float name=\"radius\" name=\"b\" value=\"1\"/>"),
       "a.xml:3: <float>: the attribute \"name\" is given twice"},
      {in_sphere("<float name=\"radius\" value=\"1\"><b/></float>"), "a.xml:3: <float> cannot have content"},
      {in_sphere("<float name=\"radius\" value=\"one\"/>"), "a.xml:3: a number is expected, got \"one\""},
      {in_sphere("<float name=\"radius\" value=\"-1\"/>"),
       "a.xml:3: shape sphere: float radius: must be from 1e-12 to 1000000000000, got -1"},
      {in_sphere("<string name=\"radius\" value=\"1\"/>"),
       "a.xml:3: shape sphere: string radius: the type float is expected"},
      {in_sphere("<float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"1\"/>"),
       "a.xml:3: shape sphere: the parameter \"radius\" is given twice"},
      {in_sphere("<boolean name=\"flip_normals\" value=\"1\"/>"), "a.xml:3: true or false is expected, got \"1\""},
      {in_sphere("<point name=\"center\" x=\"1\"/>"), "a.xml:3: <point>: x, y and z are expected"},
      {in_sphere("<transform name=\"to_world\">\n<shear x=\"1\"/></transform>"),
       "a.xml:4: <shear> cannot be read in a transform"},
      {in_sphere("<transform name=\"to_world\"><scale x=\"2\"/></transform>"),
       "a.xml:2: shape sphere: a sphere can be moved, turned and scaled, but not distorted"},
      {in_sphere("<transform name=\"to_world\"><rotate angle=\"2\"/></transform>"),
       "a.xml:3: the axis of <rotate> must not be zero"},
      {in_sphere("<transform name=\"to_world\"><matrix value=\"1 2\"/></transform>"),
       "a.xml:3: a matrix has 9 or 16 numbers, got 2"},
      {in_sphere("<texture type=\"bitmap\"/>"), "a.xml:3: shape sphere: the texture bitmap is not read here"},
      {in_sphere("<bsdf type=\"hair\"/>"), "a.xml:3: materials of the type \"hair\" cannot be rendered"},
      {"<shape type=\"sdfgrid\"/>", "a.xml:2: shapes of the type \"sdfgrid\" cannot be rendered"},
      {"<emitter type=\"sunsky\"/>", "a.xml:2: emitters of the type \"sunsky\" cannot be rendered"},
      {"<emitter type=\"area\"/>", "a.xml:2: emitters of the type \"area\" cannot be rendered outside of a shape"},
      {"<emitter type=\"constant\"/>\n<emitter type=\"constant\"/>",
       "a.xml:3: a scene can have only one constant or envmap emitter"},
      {"<volume type=\"gridvolume\"/>", "a.xml:2: scene: the volume gridvolume is not read here"},
      {"", "a.xml:1: the scene has no shapes that can be seen"}};
  for (const auto& [body, message] : cases) {
    EXPECT_EQ(mitsuba_error(body), message) << body;
  }
  EXPECT_EQ(message_of(read_xml("\n<scene/>").status()), "a.xml:2: <scene> has no version");
  EXPECT_EQ(message_of(read_xml("<shape version=\"3\"/>").status()), "a.xml:1: <scene> is expected, got <shape>");
  EXPECT_EQ(message_of(read_xml("").status()), "a.xml:1: the XML cannot be read: No document element found");
}

TEST(MitsubaXml, UnknownParametersAreFaults) {
  const LoadedScene loaded = mitsuba_scene("<shape type=\"sphere\">\n<float name=\"size\" value=\"1\"/></shape>");
  EXPECT_EQ(message_of(loaded.faults.as_error()), "a.xml:3: shape sphere: unknown parameter float \"size\"");
}

LoadedScene seen_by(const std::string& sensor) {
  Result<LoadedScene> loaded = read_xml("<scene version=\"3.0.0\">" + sensor + kSphere + "</scene>");
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? *std::move(loaded) : LoadedScene{};
}

/// Half of the film's height at distance 1, with a film of 200 × 100 pixels.
double half_height(const std::string& parameters) {
  const Camera camera = seen_by("<sensor type=\"perspective\">" + parameters + R"(<film type="hdrfilm">
<integer name="width" value="200"/><integer name="height" value="100"/></film></sensor>)")
                            .scene.camera;
  return std::tan(camera.vertical_fov_degrees * pi / 360);
}

TEST(MitsubaSensor, FieldOfViewIsAlongItsAxis) {
  const auto fov = [](const std::string& axis) {
    return half_height(R"(<float name="fov" value="90"/><string name="fov_axis" value=")" + axis + "\"/>");
  };
  EXPECT_NEAR(half_height(R"(<float name="fov" value="90"/>)"), 0.5, 1e-9);
  EXPECT_NEAR(fov("x"), 0.5, 1e-9);
  EXPECT_NEAR(fov("y"), 1, 1e-9);
  EXPECT_NEAR(fov("larger"), 0.5, 1e-9);
  EXPECT_NEAR(fov("smaller"), 1, 1e-9);
  EXPECT_NEAR(fov("diagonal"), 1 / std::sqrt(5), 1e-9);
  // A 35 mm film is 36 × 24 mm. The diagonal of this film has the same angle.
  const double diagonal = std::hypot(18, 12);
  EXPECT_NEAR(half_height(""), diagonal / 50 / std::sqrt(5), 1e-9);
  EXPECT_NEAR(half_height(R"(<string name="focal_length" value="100mm"/>)"), diagonal / 100 / std::sqrt(5), 1e-9);
}

TEST(MitsubaSensor, StandsWhereItsTransformSays) {
  const Scene scene = seen_by(R"(<sensor type="thinlens"><transform name="to_world">
<lookat origin="1, 2, 8" target="1, 2, 3" up="0, 1, 0"/></transform>
<float name="aperture_radius" value="0.25"/><float name="focus_distance" value="6"/><float name="near_clip" value="1"/></sensor>)")
                          .scene;
  expect_near(scene.camera.eye, {1, 2, 8});
  EXPECT_NEAR(scene.camera.look_at[0], 1, 1e-9);
  EXPECT_NEAR(scene.camera.look_at[1], 2, 1e-9);
  EXPECT_LT(scene.camera.look_at[2], 8);
  expect_near(scene.camera.up, {0, 1, 0});
  EXPECT_EQ(scene.camera.lens_radius, 0.25);
  EXPECT_EQ(scene.camera.focus_distance, 6);
  EXPECT_EQ(scene.film.width, 768);
  EXPECT_EQ(scene.film.height, 576);
}

// In widths to the right and in heights down; ours is in heights to the right and up.
TEST(MitsubaSensor, PrincipalPointsAreShifts) {
  const Camera camera = seen_by(R"(<sensor type="perspective"><float name="principal_point_offset_x" value="0.25"/>
<float name="principal_point_offset_y" value="0.5"/></sensor>)")
                            .scene.camera;
  EXPECT_DOUBLE_EQ(camera.shift_x, 0.25 * 768 / 576);
  EXPECT_DOUBLE_EQ(camera.shift_y, -0.5);
}

TEST(MitsubaSensor, SeveralAreCamerasByTheirIds) {
  const LoadedScene loaded = seen_by(R"(<sensor type="perspective" id="near"/><sensor type="perspective" id="far"/>)");
  ASSERT_EQ(loaded.cameras.size(), 2u);
  EXPECT_EQ(loaded.cameras[0].name, "near");
  EXPECT_EQ(loaded.cameras[1].name, "far");
}

TEST(MitsubaSensor, FilmFilterAndCropAreRead) {
  const LoadedScene loaded = seen_by(R"(<sensor type="perspective"><film type="hdrfilm"><rfilter type="tent"/>
<integer name="width" value="20"/><integer name="height" value="10"/><integer name="crop_offset_x" value="5"/>
<integer name="crop_width" value="4"/></film><sampler type="multijitter"><integer name="sample_count" value="36"/></sampler></sensor>)");
  EXPECT_EQ(loaded.scene.film.filter.kind, FilterKind::tent);
  EXPECT_EQ(loaded.scene.film.filter.radius_pixels, 1);
  EXPECT_EQ(loaded.notices,
            (std::vector<std::string>{"the whole film is rendered: --crop 5,0,4,10 renders the scene's crop window",
                                      "left out: the sampler's 36 samples per pixel (the job's samples are used)"}));
  EXPECT_EQ(seen_by("<sensor type=\"perspective\"/>").scene.film.filter.kind, FilterKind::gaussian);
}

TEST(MitsubaSensor, UnsupportedSensorsAreErrors) {
  const auto error_of = [](const std::string& sensor) {
    return message_of(read_xml("<scene version=\"3.0.0\">\n" + sensor + kSphere + "</scene>").status());
  };
  EXPECT_EQ(error_of("<sensor type=\"orthographic\"/>"),
            "a.xml:2: sensors of the type \"orthographic\" cannot be rendered");
  EXPECT_EQ(
      error_of("<sensor type=\"perspective\">\n<transform name=\"to_world\"><scale x=\"-1\"/></transform></sensor>"),
      "a.xml:3: sensor perspective: transform to_world: only moves and turns of a camera can be rendered");
  EXPECT_EQ(error_of("<sensor type=\"perspective\">\n<film type=\"specfilm\"/></sensor>"),
            "a.xml:3: films of the type \"specfilm\" cannot be rendered");
}

TEST(MitsubaIntegrator, IsLeftOutWithANotice) {
  const LoadedScene loaded = mitsuba_scene(std::string(R"(<integrator type="path"><integer name="max_depth" value="3"/>
<boolean name="hide_emitters" value="true"/></integrator>)") +
                                           kSphere);
  EXPECT_EQ(loaded.notices,
            (std::vector<std::string>{"left out: the integrator \"path\" (the job's method is used)",
                                      "left out: hide_emitters: the camera sees all lights",
                                      "left out: max_depth 3 of the integrator (bounces are not limited by it)"}));
  EXPECT_EQ(mitsuba_scene(std::string(R"(<integrator type="moment"><integrator type="direct"><integer name="max_depth"
value="2"/></integrator></integrator>)") +
                          kSphere)
                .notices.back(),
            "left out: max_depth 2 of the integrator (bounces are not limited by it)");
}

template <class Kind>
Kind light_of(const std::string& emitter, const TextFiles& files = {}) {
  const LoadedScene loaded = mitsuba_scene(emitter + kSphere, files);
  return loaded.scene.lights.empty() ? Kind{} : std::get<Kind>(loaded.scene.lights[0].kind);
}

TEST(MitsubaEmitters, AreaEmittersAreDefinedForShapes) {
  const LoadedScene loaded =
      mitsuba_scene(R"(<emitter type="area" id="lamp"><rgb name="radiance" value="1, 2, 3"/></emitter>
<shape type="sphere"><ref id="lamp"/></shape>)");
  EXPECT_TRUE(loaded.scene.lights.empty());
  EXPECT_EQ(loaded.scene.materials.at(0).emission, TexturedColor(1, 2, 3));
}

TEST(MitsubaEmitters, HaveThePlaceAndStrengthOfTheFile) {
  const auto point = light_of<PointLight>(
      R"(<emitter type="point"><point name="position" value="1, 2, 3"/><rgb name="intensity" value="4, 5, 6"/></emitter>)");
  expect_near(point.position, {1, 2, 3});
  EXPECT_EQ(point.intensity, (RgbColor{4, 5, 6}));
  expect_near(light_of<PointLight>(
                  R"(<emitter type="point"><transform name="to_world"><translate y="7"/></transform></emitter>)")
                  .position,
              {0, 7, 0});
  const auto sun = light_of<DirectionalLight>(
      R"(<emitter type="directional"><vector name="direction" value="0, -2, 0"/><float name="irradiance" value="3"/></emitter>)");
  expect_near(sun.direction, {0, -1, 0});
  EXPECT_EQ(sun.irradiance, (RgbColor{3, 3, 3}));
  const auto spot = light_of<SpotLight>(R"(<emitter type="spot"><float name="cutoff_angle" value="40"/>
<transform name="to_world"><lookat origin="0, 5, 0" target="0, 0, 0" up="0, 0, 1"/></transform></emitter>)");
  expect_near(spot.position, {0, 5, 0});
  expect_near(spot.direction, {0, -1, 0});
  EXPECT_EQ(spot.cutoff_degrees, 40);
  EXPECT_NEAR(spot.blend, 0.25, 1e-12);
  EXPECT_EQ(
      light_of<EnvironmentLight>(R"(<emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>)").radiance,
      (RgbColor{0.5, 0.5, 0.5}));
}

std::string envmap(const std::string& steps) {
  return "<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.exr\"/><float name=\"scale\" value=\"2\"/>"
         "<transform name=\"to_world\">" +
         steps + "</transform></emitter>";
}

// Mitsuba's image has its centre at +z, ours at +x. Both have +y above, and turn from +z to −x to the right.
TEST(MitsubaEmitters, EnvironmentsAreTurned) {
  const TextFiles files{{"sky.exr", "sky"}};
  const auto still = light_of<EnvironmentLight>(envmap(""), files);
  EXPECT_TRUE(still.has_image);
  EXPECT_EQ(still.radiance, (RgbColor{2, 2, 2}));
  EXPECT_EQ(still.rotation_degrees, -90);
  // The turn takes y to z, and z to −y.
  const auto turned = light_of<EnvironmentLight>(envmap(R"(<rotate x="1" angle="90"/><scale value="3"/>)"), files);
  ASSERT_TRUE(turned.orientation);
  expect_near((*turned.orientation)[0], {1, 0, 0});
  expect_near((*turned.orientation)[1], {0, 0, 1});
  expect_near((*turned.orientation)[2], {0, -1, 0});
  const auto mirrored = light_of<EnvironmentLight>(envmap("<scale x=\"-1\"/>"), files);
  expect_near(mirrored.orientation.value()[0], {-1, 0, 0});
  EXPECT_EQ(mitsuba_error(envmap("<scale x=\"2\"/>") + kSphere, files),
            "a.xml:2: emitter envmap: transform to_world: only a turned or mirrored image can be rendered");
}

TEST(MitsubaEmitters, SpectraAreIntegrated) {
  const auto radiance = [](const std::string& value) {
    return light_of<EnvironmentLight>("<emitter type=\"constant\"><spectrum name=\"radiance\" value=\"" + value +
                                      "\"/></emitter>")
        .radiance;
  };
  const auto luminance = [](const RgbColor& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; };
  EXPECT_NEAR(luminance(radiance("1")), 1, 1e-3);
  EXPECT_NEAR(luminance(radiance("300:2, 900:2")), 2, 2e-3);
  const RgbColor low = radiance("300:1, 550:1"), high = radiance("550:1, 900:1");
  EXPECT_GT(high.r, low.r);
  EXPECT_GT(low.b, high.b);
  EXPECT_EQ(
      mitsuba_error("<emitter type=\"constant\">\n<spectrum name=\"radiance\" value=\"500:1, 400:1\"/></emitter>"),
      "a.xml:3: emitter constant: spectrum radiance: pairs of ascending wavelengths and values that are not "
      "negative are expected, at most 100000");
  EXPECT_EQ(
      light_of<EnvironmentLight>(R"(<emitter type="constant"><spectrum name="radiance" filename="a.spd"/></emitter>)",
                                 {{"a.spd", "# light\n300 2\n900 2\n"}})
          .radiance,
      radiance("300:2, 900:2"));
}

}  // namespace
}  // namespace lightmill::test
