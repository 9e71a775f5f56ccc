// Directives, transforms, cameras and lights of pbrt scenes.
#include "common/scene_io/gzip.h"
#include "tests/unit/scene_io/pbrt_fixture.h"

#include <zlib.h>

#include <cmath>
#include <numbers>

namespace lightmill::test {
namespace {

using std::numbers::pi;

void expect_point(const Point3d& a, const Point3d& b, double tolerance = 1e-9) {
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a[i], b[i], tolerance);
  }
}

/// The centre of a sphere of radius 0.5 in the scene.
Point3d center_after(const std::string& directives) {
  const LoadedScene loaded = world(directives + " Shape \"sphere\" \"float radius\" 0.5");
  return loaded.scene.objects.empty() ? Point3d{} : std::get<SphereShape>(loaded.scene.objects.back().shape).center;
}

TEST(PbrtTransforms, ApplyTheLastFirst) {
  expect_point(center_after("Translate 1 2 3"), {1, 2, 3});
  expect_point(center_after("Scale 2 2 2 Translate 1 2 3"), {2, 4, 6});
  expect_point(center_after("Translate 1 2 3 Scale 2 2 2 Translate 1 0 0"), {3, 2, 3});
  expect_point(center_after("Rotate 90 0 0 1 Translate 1 0 0"), {0, 1, 0});
  expect_point(center_after("Translate 5 5 5 Identity Translate 1 0 0"), {1, 0, 0});
  expect_point(center_after("Translate 5 5 5 Transform [1 0 0 0 0 1 0 0 0 0 1 0 7 8 9 1]"), {7, 8, 9});
  expect_point(center_after("Translate 1 0 0 ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 7 8 9 1]"), {8, 8, 9});
  // To a camera at (1, 2, 3) that looks along +x: z is ahead, y is up, and x is y × z.
  expect_point(center_after("LookAt 1 2 3 9 2 3 0 1 0 Translate 4 2 3"), {0, 0, 3});
  expect_point(center_after("Translate 1 0 0 CoordinateSystem \"a\" Translate 1 0 0 CoordSysTransform \"a\""),
               {1, 0, 0});
}

TEST(PbrtTransforms, AttributesAreScoped) {
  expect_point(center_after("AttributeBegin Translate 9 9 9 AttributeEnd Translate 1 0 0"), {1, 0, 0});
  EXPECT_EQ(pbrt_error("AttributeEnd"), "a.pbrt:3: AttributeEnd without AttributeBegin");
  EXPECT_EQ(pbrt_error("ObjectBegin \"o\"\nAttributeBegin\nObjectEnd"),
            "a.pbrt:5: ObjectEnd, but the AttributeBegin at a.pbrt:4 is open");
  EXPECT_EQ(pbrt_error("\nAttributeBegin"), "a.pbrt:4: AttributeBegin without its end");
}

TEST(PbrtTransforms, CameraIsACoordinateSystem) {
  const Result<LoadedScene> loaded = read_text(
      "Scale -1 1 1 LookAt 1 2 3 1 2 9 0 1 0 Camera \"perspective\"\nWorldBegin CoordSysTransform \"camera\" "
      "Translate 0 0 4 Shape \"sphere\"");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  expect_point(std::get<SphereShape>(loaded->scene.objects[0].shape).center, {1, 2, 7});
}

// pbrt's camera has x on the right of one that looks along +z, with y up. Ours has it on the left.
TEST(PbrtCamera, MirrorsTheSceneUnlessTheFileDoes) {
  for (const bool file_mirrors : {false, true}) {
    const Result<LoadedScene> loaded = read_text(
        std::string(file_mirrors ? "Scale -1 1 1 " : "") +
        "Translate 0 0 5 Camera \"perspective\"\nWorldBegin Translate 1 2 3 Shape \"sphere\" LightSource \"point\" \"point3 from\" [1 0 0]");
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    const double side = file_mirrors ? 1 : -1;
    expect_point(std::get<SphereShape>(loaded->scene.objects[0].shape).center, {side, 2, 3});
    expect_point(std::get<PointLight>(loaded->scene.lights[0].kind).position, {2 * side, 2, 3});
    expect_point(loaded->scene.camera.eye, {0, 0, -5});
    expect_point(loaded->scene.camera.up, {0, 1, 0});
    EXPECT_GT(loaded->scene.camera.look_at[2], -5);
  }
}

Camera camera_of(const std::string& options) {
  const Result<LoadedScene> loaded = read_text(options + "\nWorldBegin Shape \"sphere\"");
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? loaded->scene.camera : Camera{};
}

TEST(PbrtCamera, FieldOfViewIsAlongTheShorterSide) {
  const std::string wide = R"(Film "rgb" "integer xresolution" 200 "integer yresolution" 100 )",
                    high = R"(Film "rgb" "integer xresolution" 100 "integer yresolution" 200 )";
  EXPECT_NEAR(camera_of(wide + R"(Camera "perspective" "float fov" 50)").vertical_fov_degrees, 50, 1e-9);
  EXPECT_NEAR(std::tan(camera_of(high + R"(Camera "perspective" "float fov" 50)").vertical_fov_degrees * pi / 360),
              2 * std::tan(25 * pi / 180), 1e-9);
  EXPECT_NEAR(std::tan(camera_of(wide + R"(Camera "perspective" "float fov" 90 "float screenwindow" [-1 1 -0.5 0.5])")
                           .vertical_fov_degrees *
                       pi / 360),
              0.5, 1e-9);
  EXPECT_NEAR(camera_of("").vertical_fov_degrees, 90, 1e-9);
}

TEST(PbrtCamera, TheWindowsCentreIsAShift) {
  const Camera camera = camera_of(R"(Film "rgb" "integer xresolution" 100 "integer yresolution" 100
Camera "perspective" "float fov" 90 "float screenwindow" [0 4 -1.5 2.5])");
  EXPECT_NEAR(std::tan(camera.vertical_fov_degrees * pi / 360), 2, 1e-9);
  EXPECT_DOUBLE_EQ(camera.shift_x, 2 / 4.0);
  EXPECT_DOUBLE_EQ(camera.shift_y, 0.5 / 4);
}

TEST(PbrtCamera, LensIsScaledWithItsTransform) {
  const Camera camera = camera_of(R"(Scale 2 2 2 Camera "perspective" "float lensradius" 1 "float focaldistance" 6)");
  EXPECT_NEAR(camera.lens_radius, 0.5, 1e-12);
  EXPECT_NEAR(camera.focus_distance, 3, 1e-12);
}

TEST(PbrtCamera, UnsupportedCamerasAreErrors) {
  const auto error_of = [](const std::string& options) {
    return error_message(read_text(options + "\nWorldBegin Shape \"sphere\""));
  };
  EXPECT_EQ(error_of("\nCamera \"spherical\""),
            "a.pbrt:2: only the camera \"perspective\" can be rendered, got \"spherical\"");
  EXPECT_EQ(error_of("Scale 1 2 1 Camera \"perspective\""),
            "a.pbrt:1: the camera's transform must be a similarity: it can move, turn, mirror and scale");
  EXPECT_EQ(error_of("Film \"rgb\" \"integer xresolution\" 0"),
            "a.pbrt:1: Film rgb: integer xresolution: must be from 1 to 65536, got 0");
  EXPECT_EQ(message_of(read_text("Camera \"perspective\"").status()), "a.pbrt:1: the scene has no WorldBegin");
  EXPECT_EQ(error_of("LookAt 0 0 0 0 0 1 0 0 1"),
            "a.pbrt:1: LookAt: the points must differ, and up must not be along the view");
}

TEST(PbrtFilm, SizeFilterAndCropAreRead) {
  const Result<LoadedScene> loaded = read_text(
      R"(Film "rgb" "integer xresolution" 200 "integer yresolution" 100 "float cropwindow" [0.25 0.5 0 1]
PixelFilter "triangle" "float xradius" 1.25 "float yradius" 1.25
WorldBegin Shape "sphere")");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->scene.film.width, 200);
  EXPECT_EQ(loaded->scene.film.height, 100);
  EXPECT_EQ(loaded->scene.film.filter.kind, FilterKind::tent);
  EXPECT_EQ(loaded->scene.film.filter.radius_pixels, 1.25);
  EXPECT_EQ(loaded->notices,
            std::vector<std::string>{"the whole film is rendered: --crop 50,0,50,100 renders the scene's crop window"});
  const Result<LoadedScene> defaults = read_text("WorldBegin Shape \"sphere\"");
  ASSERT_TRUE(defaults.ok()) << defaults.status();
  EXPECT_EQ(defaults->scene.film.width, 1280);
  EXPECT_EQ(defaults->scene.film.height, 720);
  EXPECT_EQ(defaults->scene.film.filter.kind, FilterKind::gaussian);
  EXPECT_EQ(defaults->scene.film.filter.radius_pixels, 1.5);
}

template <class Kind>
Kind light_of(const std::string& directive, const std::string& options = "") {
  const Result<LoadedScene> loaded =
      read_text(fmt::format("{} {}WorldBegin\n{} Shape \"sphere\"", options, kUnmirrored, directive));
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? std::get<Kind>(loaded->scene.lights.at(0).kind) : Kind{};
}

TEST(PbrtLights, PowerIsDividedByTheSolidAngle) {
  EXPECT_FLOAT_EQ(light_of<PointLight>(R"(LightSource "point" "rgb I" [1 2 3] "float scale" 2)").intensity.b, 6);
  EXPECT_FLOAT_EQ(light_of<PointLight>(R"(LightSource "point" "rgb I" [1 2 3] "float power" 10)").intensity.g,
                  static_cast<float>(2 * 10 / (4 * pi)));
  const auto spot = light_of<SpotLight>(
      R"(LightSource "spot" "point3 from" [0 0 1] "point3 to" [0 0 -1] "float coneangle" 60 "float conedeltaangle" 60 "float power" 5)");
  EXPECT_EQ(spot.cutoff_degrees, 60);
  EXPECT_EQ(spot.blend, 1);
  // The smooth falloff from cos 0 to cos 60° is half on average.
  EXPECT_NEAR(spot.intensity.r, 5 / (2 * pi * 0.5 / 2), 1e-5);
  expect_point(spot.position, {0, 0, 1});
  EXPECT_LT(spot.direction[2], 0);
  const auto sun = light_of<DirectionalLight>(
      R"(Rotate 90 1 0 0 LightSource "distant" "point3 from" [0 0 0] "point3 to" [0 0 2] "rgb L" [1 1 1] "float illuminance" 3)");
  expect_point(sun.direction, {0, -2, 0});
  EXPECT_FLOAT_EQ(sun.irradiance.r, 3);
  EXPECT_FLOAT_EQ(light_of<EnvironmentLight>(R"(LightSource "infinite" "float illuminance" 5)").radiance.r,
                  static_cast<float>(5 / pi));
}

TEST(PbrtLights, ExposureMultipliesThem) {
  const std::string options =
      R"(Camera "perspective" "float shutteropen" 0.5 "float shutterclose" 1 Film "rgb" "float iso" 300)";
  EXPECT_FLOAT_EQ(light_of<PointLight>(R"(LightSource "point" "rgb I" [1 1 1])", options + "\n#").intensity.r, 1.5f);
}

TEST(PbrtLights, SpectraHaveLuminanceOne) {
  for (const char* color : {"\"blackbody I\" 3000", "\"spectrum I\" [400 5 700 5]", "\"spectrum I\" \"stdillum-F11\"",
                            "\"spectrum I\" \"lamp.spd\""}) {
    const LoadedScene loaded = world(fmt::format("LightSource \"point\" {} \"float scale\" 2 Shape \"sphere\"", color),
                                     {{"lamp.spd", "# nm\n300 1\n600 2 800 3\n"}});
    ASSERT_EQ(loaded.scene.lights.size(), 1u);
    const RgbColor i = std::get<PointLight>(loaded.scene.lights[0].kind).intensity;
    EXPECT_NEAR(0.2126 * i.r + 0.7152 * i.g + 0.0722 * i.b, 2, 2e-3) << color;
    EXPECT_GT(i.r, i.b) << color;
  }
  EXPECT_EQ(light_of<PointLight>("LightSource \"point\" \"spectrum I\" \"stdillum-D65\"").intensity,
            (RgbColor{1, 1, 1}));
}

TEST(PbrtLights, UniformInfiniteLightsAreAdded) {
  const LoadedScene loaded = world(
      R"(LightSource "infinite" "rgb L" [1 2 3] LightSource "point" LightSource "infinite" "rgb L" [1 1 1] "float scale" 2 Shape "sphere")");
  ASSERT_EQ(loaded.scene.lights.size(), 2u);
  EXPECT_EQ(std::get<EnvironmentLight>(loaded.scene.lights[0].kind).radiance, (RgbColor{3, 4, 5}));
}

// The light's z is the centre of its image.
TEST(PbrtLights, ImagesOfInfiniteLightsAreTurnedSquaresOfEqualAreas) {
  const TextFiles files{{"sky.exr", "sky"}};
  const std::string sky = R"(LightSource "infinite" "string filename" "sky.exr" "float scale" 2 Shape "sphere")";
  const LoadedScene loaded = world("Rotate 90 1 0 0 Scale 3 3 3 " + sky, files);
  const auto& light = std::get<EnvironmentLight>(loaded.scene.lights.at(0).kind);
  EXPECT_TRUE(light.has_image && light.equal_area);
  EXPECT_EQ(light.radiance, (RgbColor{2, 2, 2}));
  ASSERT_TRUE(light.orientation);
  expect_near((*light.orientation)[0], {1, 0, 0});
  expect_near((*light.orientation)[1], {0, 0, 1});
  expect_near((*light.orientation)[2], {0, -1, 0});
  ASSERT_EQ(loaded.images.size(), 1u);
  EXPECT_TRUE(loaded.images[0].environment && loaded.images[0].equal_area);
  EXPECT_EQ(pbrt_error("Scale 1 2 1 " + sky, files),
            "a.pbrt:3: LightSource infinite: string filename: the image is scaled along its axes. Only a turned or "
            "mirrored one can be rendered");
  EXPECT_EQ(
      pbrt_error("LightSource \"infinite\" " + sky, files),
      "a.pbrt:1: the light \"infinite of line 3\": a scene whose infinite light has an image can have no other infinite light");
}

TEST(PbrtLights, UnsupportedLightsAreErrors) {
  EXPECT_EQ(pbrt_error("LightSource \"projection\""), "a.pbrt:3: lights of the type \"projection\" cannot be rendered");
  EXPECT_EQ(pbrt_error("LightSource \"infinite\"\n\"string filename\" \"sky.exr\" \"rgb L\" [1 1 1]"),
            "a.pbrt:4: LightSource infinite: rgb L: cannot be rendered together with an image");
  EXPECT_EQ(pbrt_error("LightSource \"point\" \"rgb I\" [-1 0 0]"),
            "a.pbrt:3: LightSource point: rgb I: three numbers from 0 to 1e+20 are expected");
  EXPECT_EQ(
      pbrt_error("LightSource \"point\" \"spectrum I\" [500 1 400 1]"),
      "a.pbrt:3: LightSource point: spectrum I: pairs of ascending wavelengths and values that are not negative are "
      "expected, at most 100000");
}

TEST(PbrtFile, IncludedFilesShareTheStateAndImportedOnesDoNot) {
  const TextFiles files{{"geometry/moved.pbrt", "Translate 1 0 0\n"}};
  const auto x = [&](const std::string& directive) {
    const LoadedScene loaded = world(directive + " \"geometry/moved.pbrt\" Shape \"sphere\"", files);
    return loaded.scene.objects.empty() ? -1 : std::get<SphereShape>(loaded.scene.objects[0].shape).center[0];
  };
  EXPECT_EQ(x("Include"), 1);
  EXPECT_EQ(x("Import"), 0);
  EXPECT_EQ(pbrt_error("\nInclude \"none.pbrt\""), "a.pbrt:4: cannot open none.pbrt");
  EXPECT_EQ(pbrt_error("Include \"b.pbrt\"", {{"b.pbrt", "\n\nShape \"cube\""}}),
            "b.pbrt:3: shapes of the type \"cube\" cannot be rendered");
  EXPECT_EQ(pbrt_error("Include \"b.pbrt\"", {{"b.pbrt", "Include \"b.pbrt\""}}),
            "b.pbrt:1: at most 10000 files can be included, 50 deep");
}

/// A gzip file with one member.
std::string zipped(const std::string& plain) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, plain.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

TEST(PbrtFile, CompressedFilesAreUnpacked) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 0 1 2\n";
  const LoadedScene loaded =
      world("Include \"b.pbrt.gz\"",
            {{"b.pbrt.gz", zipped("Shape \"plymesh\" \"string filename\" \"m.ply.gz\"")}, {"m.ply.gz", zipped(ply)}});
  EXPECT_EQ(object_mesh(loaded).triangles.size(), 1u);
  EXPECT_EQ(pbrt_error("Include \"b.pbrt.gz\"", {{"b.pbrt.gz", "Shape"}}), "a.pbrt:3: b.pbrt.gz: cannot be unpacked");
}

TEST(Gzip, FilesHaveMembersUpToALimit) {
  const std::string large(3'000'000, 'a'), both = zipped(large) + zipped("b");
  const Result<std::string> got = gunzip(both, "f.gz", 3'000'001);
  ASSERT_TRUE(got.ok());
  EXPECT_TRUE(*got == large + "b");
  EXPECT_EQ(message_of(gunzip(both, "f.gz", 3'000'000).status()), "f.gz: unpacks to more than 2.86 MiB");
  for (const std::string& broken : {std::string(), both.substr(0, both.size() - 1), both + "b"}) {
    EXPECT_EQ(message_of(gunzip(broken, "f.gz", 4'000'000).status()), "f.gz: cannot be unpacked");
  }
}

TEST(PbrtFile, ManyReadsOfAFileAreBounded) {
  FileSource files = at_most(10, [](const std::string& name) -> Result<SourceFile> {
    return SourceFile{name, "four"};
  });
  EXPECT_TRUE(files("a").ok());
  EXPECT_TRUE(files("a").ok());
  EXPECT_EQ(message_of(files("a").status()), "a: the scene reads files with more than 10 B");
}

TEST(PbrtFile, ErrorsNameTheirLine) {
  EXPECT_EQ(pbrt_error(""), "a.pbrt:1: the scene has no shapes");
  EXPECT_EQ(pbrt_error("Sphere"), "a.pbrt:3: unknown directive Sphere");
  EXPECT_EQ(pbrt_error("Film \"rgb\""), "a.pbrt:3: Film must be before WorldBegin");
  EXPECT_EQ(message_of(read_text("\nShape \"sphere\"").status()), "a.pbrt:2: Shape must be after WorldBegin");
  EXPECT_EQ(pbrt_error("Shape \"sphere"), "a.pbrt:3: a string must end on its line, with \"");
  EXPECT_EQ(pbrt_error("Shape sphere"), "a.pbrt:3: Shape in quotes is expected, got sphere");
  EXPECT_EQ(pbrt_error("Shape \"sphere\" \"radius\" 1"), "a.pbrt:3: a type and a name are expected, got \"radius\"");
  EXPECT_EQ(pbrt_error("Shape \"sphere\"\n\"number radius\" 1"),
            "a.pbrt:4: unknown type \"number\" of the parameter \"radius\"");
  EXPECT_EQ(pbrt_error("Shape \"sphere\" \"float radius\" [1"), "a.pbrt:3: the list of \"radius\" has no ]");
  EXPECT_EQ(pbrt_error("Shape \"sphere\" \"float radius\" x"), "a.pbrt:3: float radius: a number is expected, got x");
  EXPECT_EQ(pbrt_error("Shape \"sphere\" \"float radius\" [1 2]"),
            "a.pbrt:3: Shape sphere: float radius: one value is expected, got 2");
  EXPECT_EQ(pbrt_error("Shape \"sphere\" \"string radius\" \"1\""),
            "a.pbrt:3: Shape sphere: string radius: the type float is expected");
  EXPECT_EQ(pbrt_error("Attribute \"camera\""),
            "a.pbrt:3: Attribute: shape, light, material, medium or texture is expected, got \"camera\"");
  EXPECT_EQ(pbrt_error("NamedMaterial \"" + std::string(201, 'x') + "\""),
            "a.pbrt:3: a material's name may have at most 200 bytes");
  EXPECT_EQ(pbrt_error("Translate 1 2"), "a.pbrt:3: a number is expected, got the end of the file");
  EXPECT_EQ(pbrt_error("ColorSpace \"rec2020\""),
            "a.pbrt:3: only the ColorSpace \"srgb\" can be rendered, got \"rec2020\"");
}

TEST(PbrtFile, UnknownParametersAreFaults) {
  const LoadedScene loaded = world("Attribute \"shape\" \"float radius\" 3\nShape \"sphere\" \"float size\" 2");
  EXPECT_EQ(loaded.faults.notices(),
            std::vector<std::string>{"a.pbrt:4: Shape sphere: unknown parameter \"float size\". It is left out"});
  EXPECT_EQ(std::get<SphereShape>(loaded.scene.objects.at(0).shape).radius, 3) << "an attribute";
}

TEST(PbrtFile, MotionAndJobSettingsAreLeftOut) {
  const LoadedScene loaded = world("ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Shape \"sphere\"");
  expect_point(std::get<SphereShape>(loaded.scene.objects.at(0).shape).center, {0, 0, 0});
  EXPECT_EQ(loaded.notices,
            std::vector<std::string>{
                "left out: motion blur: everything has its position at the time when the shutter opens"});
  const Result<LoadedScene> options = read_text(
      "Option \"seed\" 5 Sampler \"halton\" \"integer pixelsamples\" 4 Integrator \"path\" WorldBegin Shape \"sphere\"");
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_EQ(options->notices,
            (std::vector<std::string>{
                "left out: Option directives",
                "left out: Sampler, Integrator and Accelerator (the job's samples and method are used)"}));
}

}  // namespace
}  // namespace lightmill::test
