// Layers and meters of pictures, as the command line writes them.
#include <bit>
#include <cstring>
#include <numeric>
#include <set>

#include "client/cli/film_fetch.h"
#include "common/base/check.h"
#include "common/base/file.h"
#include "common/image/exr.h"
#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

/// A float channel of an EXR.
const std::vector<float>& plane(const Image& image, const std::string& name) {
  const std::vector<float>* values = image.floats(name);
  LM_CHECK(values != nullptr, "no channel {}", name);
  return *values;
}

TEST_F(SharedFarmTest, LayersAreWrittenAndTheHashCoversThem) {
  const std::vector<std::string> render{
      "render", scene("cornell-bench-balls.json"), "--size", "70x66", "--spp", "20", "-o", file("a.exr")};
  std::vector<std::string> layered = render;
  layered.insert(layered.end(), {"--layers", "id,direct,indirect,albedo,normal,depth", "--denoise"});
  const nlohmann::json done = on_farm(layered);
  const nlohmann::json again = json({"error", file("a.exr"), file("a.exr")});
  EXPECT_EQ(again["rel_mse"], 0);
  const Result<FilmPicture> picture = load_film_picture(file("a.exr"));
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(film_hash_of(*picture).hex(), done["film_hash"]);
  const auto bytes = read_file(file("a.exr"));
  ASSERT_TRUE(bytes.ok());
  const Result<Image> image = decode_exr(as_byte_view(*bytes));
  ASSERT_TRUE(image.ok()) << image.status();
  // From (278, 273, −800) along +z, so that x is to the left; (278, 273, 0) is in the middle of the picture.
  const auto* camera = std::get_if<ImageMatrix>(&image->attributes.at("worldToCamera"));
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(*camera, (ImageMatrix{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 278, -273, 800, 1}));
  EXPECT_TRUE(image->attributes.contains("worldToNDC"));
  const nlohmann::json undenoisable = on_farm(render);
  EXPECT_NE(undenoisable["film_hash"], done["film_hash"]);
  const Result<FilmPicture> plain = load_film_picture(file("a.exr"));
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_EQ(plain->beauty, picture->beauty);

  // The film has features, and can be denoised. This does not change the raw picture and its hash.
  const auto fetch = [&](const nlohmann::json& job) {
    return std::vector<std::string>{"fetch", std::to_string(job["id"].get<int>()), "--denoise", "-o", file("b.exr")};
  };
  EXPECT_EQ(on_farm(fetch(done))["film_hash"], done["film_hash"]);
  const Result<FilmPicture> denoised = load_film_picture(file("b.exr"));
  ASSERT_TRUE(denoised.ok()) << denoised.status();
  EXPECT_EQ(denoised->beauty, picture->beauty);
  EXPECT_EQ(denoised->denoised.size(), picture->beauty.size());
  EXPECT_EQ(denoised->denoised, picture->denoised);
  EXPECT_TRUE(plain->denoised.empty());
  const nlohmann::json refused = on_farm(fetch(undenoisable), 2);
  EXPECT_NE(refused["failure"].value("message", "").find("its film has no layer"), std::string::npos) << refused;

  // Each pixel that shows something is covered by objects that the manifest names.
  const auto manifest = nlohmann::json::parse(image->text("cryptomatte/3ae39a5/manifest"));
  std::set<std::uint32_t> ids;
  for (const auto& [name, hash] : manifest.items()) {
    ids.insert(static_cast<std::uint32_t>(std::stoul(hash.get<std::string>(), nullptr, 16)));
  }
  EXPECT_TRUE(manifest.contains("mirror ball")) << manifest;
  const std::vector<float>& depth = plane(*image, "Z");
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const float beauty = plane(*image, "G")[i];
    EXPECT_NEAR(plane(*image, "Direct.G")[i] + plane(*image, "Indirect.G")[i], beauty, 1e-5 * beauty);
    float covered = 0;
    for (const auto& [id, coverage] : {std::pair{"CryptoObject00.R", "CryptoObject00.G"},
                                       {"CryptoObject00.B", "CryptoObject00.A"},
                                       {"CryptoObject01.R", "CryptoObject01.G"},
                                       {"CryptoObject01.B", "CryptoObject01.A"}}) {
      covered += plane(*image, coverage)[i];
      if (plane(*image, coverage)[i] > 0) {
        EXPECT_TRUE(ids.contains(std::bit_cast<std::uint32_t>(plane(*image, id)[i])));
      }
    }
    EXPECT_LE(covered, 1);  // the box is open towards the camera, and the picture is wider than the box
    EXPECT_EQ(covered > 0, depth[i] < kNoDepth);
    EXPECT_GT(depth[i], 799);  // the box begins at a distance of 800 from the camera
  }
}

/// Identifiers by name, as a Cryptomatte layer's manifest has them.
std::map<std::string, std::uint32_t> manifest_of(const Image& image, const std::string& layer) {
  std::map<std::string, std::uint32_t> ids;
  for (const auto& [name, value] : image.attributes) {
    const std::string prefix = name.substr(0, name.rfind('/') + 1);
    if (!name.starts_with("cryptomatte/") || !name.ends_with("/name") || image.text(name) != layer) {
      continue;
    }
    const auto manifest = nlohmann::json::parse(image.text(prefix + "manifest"));
    for (const auto& [thing, hash] : manifest.items()) {
      ids[thing] = static_cast<std::uint32_t>(std::stoul(hash.get<std::string>(), nullptr, 16));
    }
  }
  return ids;
}

TEST_F(SharedFarmTest, ConvertMakesThePictureThatFetchMakes) {
  const nlohmann::json job = on_farm({"render", scene("cornell-bench-blocks.json"), "--size", "24x20", "--spp", "2",
                                      "--layers", "normal,id", "--denoise", "-o", file("a.exr")});
  std::set<std::string> different;
  for (const std::vector<std::string>& view : {std::vector<std::string>{},
                                               {"--exposure", "1", "--view", "filmic", "--gamma", "1.2"},
                                               {"--png-layer", "normal"},
                                               {"--denoise"}}) {
    on_farm(with({"fetch", std::to_string(job["id"].get<int>()), "-o", file("fetched.png"), "-o", file("fetched.exr")},
                 view));
    json(with({"convert", file("a.exr"), "-o", file("converted.png"), "-o", file("converted.exr")}, view));
    EXPECT_EQ(read_file(file("converted.exr")).value(), read_file(file("fetched.exr")).value());
    const std::string converted = read_file(file("converted.png")).value();
    EXPECT_EQ(converted, read_file(file("fetched.png")).value()) << fmt::format("{}", fmt::join(view, " "));
    different.insert(converted);
  }
  EXPECT_EQ(different.size(), 4u);
  EXPECT_EQ(lightmill({"convert", file("a.exr"), "-o", file("b.png")}).out,
            fmt::format("{} -> {}\n", file("a.exr"), file("b.png")));
}

TEST_F(CliTest, ConvertSaysWhatAFileLacks) {
  Image image{{0, 0, 4, 2}, {1, 0, 2, 2}, {}, {}};
  for (const char* name : {"R", "G", "B"}) {
    image.channels.push_back({name, std::vector<float>{0, 0.25f, 0.5f, 1}});
  }
  std::ofstream(file("other.exr")) << encode_exr(image).value();
  json({"convert", file("other.exr"), "-o", file("other.png")});
  const Result<RgbImage> png = load_rgb(file("other.png"));
  ASSERT_TRUE(png.ok()) << png.status();
  EXPECT_EQ(std::pair(png->width, png->height), std::pair(2, 2));
  EXPECT_EQ(png->values.at(3), 1);
  const auto failure = [&](const std::vector<std::string>& more) {
    return json(with({"convert"}, more), 2)["failure"].value("message", "");
  };
  EXPECT_EQ(failure({file("other.png"), "-o", file("b.png")}),
            file("other.png") + ": this is not an EXR file: give an .exr file");
  EXPECT_EQ(failure({file("none.exr"), "-o", file("b.png")}),
            "cannot open " + file("none.exr") + ": No such file or directory");
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"-o", file("b.exr")}, {"-o", file("b.png"), "--png-layer", "normal"}}) {
    EXPECT_NE(failure(with({file("other.exr")}, more)).find("another program has saved it"), std::string::npos);
  }
  image.channels = {{"Y", std::vector<float>{0, 0.25f, 0.5f, 1}}};
  std::ofstream(file("grey.exr")) << encode_exr(image).value();
  json({"convert", file("grey.exr"), "-o", file("grey.png")});
  EXPECT_EQ(read_file(file("grey.png")).value(), read_file(file("other.png")).value());
  image.channels = {{"R", std::vector<float>(4)}, {"G", std::vector<float>(4)}};
  std::ofstream(file("two.exr")) << encode_exr(image).value();
  EXPECT_EQ(failure({file("two.exr"), "-o", file("b.png")}), file("two.exr") + ": the file has no channel B");
}

// Such a program may change the channels' type, and keep the checksum of the file that it has read.
TEST_F(CliTest, ConvertShowsAFilmThatAnotherProgramHasSaved) {
  json({"render", scene("cornell-bench-blocks.json"), "--local", "--size", "24x20", "--spp", "2", "-o", file("a.exr"),
        "-o", file("a.png")});
  Image image = decode_exr(as_byte_view(read_file(file("a.exr")).value())).value();
  std::erase_if(image.channels, [](const ImageChannel& channel) { return channel.name.size() > 1; });
  std::ofstream(file("saved.exr")) << encode_exr(image).value();
  const CommandResult converted = lightmill({"convert", file("saved.exr"), "-o", file("saved.png")});
  EXPECT_EQ(converted.exit_code, 0);
  EXPECT_NE(converted.err.find("Only its R, G and B are shown"), std::string::npos) << converted.err;
  EXPECT_EQ(read_file(file("saved.png")).value(), read_file(file("a.png")).value());
}

TEST_F(SharedFarmTest, LayersHaveTheirValuesInTheFile) {
  // A wall 4 units in front of the camera in the left half, and points of equal power in groups that light it.
  write("wall.obj", "v -3 -3 0\nv 0 -3 0\nv 0 3 0\nv -3 3 0\nf 1 2 3 4\n");
  write("scene.json", R"({"camera": {"eye": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 20},
    "film": {"width": 70, "height": 66, "filter": {"kind": "BOX", "radius_pixels": 0.5}},
    "materials": [{"name": "paint", "diffuse": {"reflectance": {"rgb": [0.5, 0.25, 0.125]}}}],
    "objects": [{"name": "wall", "material": "paint", "mesh": {"file": "wall.obj"}}],
    "lights": [{"point": {"position": [-0.3, 0, 4], "intensity": {"rgb": [60, 0, 30]}}, "group": "key"},
               {"point": {"position": [-1, 0, 2], "intensity": {"rgb": [10, 18, 0]}}, "group": "fill"},
               {"point": {"position": [-1, 1, 3], "intensity": {"rgb": [0, 0, 206]}}}]})");
  const Vec3d albedo(0.5, 0.25, 0.125);
  const double pixel = 8 * std::tan(10 * M_PI / 180) / 66;  // on the wall
  // The wall's value from one point, summed over all of its pixels.
  const auto sum_of_point = [&](const Vec3d& light, const Vec3d& intensity) {
    double sum = 0;
    for (int row = 0; row < 66; ++row) {
      for (int column = 0; column < 35; ++column) {
        const Vec3d to_light = light - Vec3d((column + 0.5 - 35) * pixel, (33 - row - 0.5) * pixel, 0);
        sum += light.z / std::pow(glm::length(to_light), 3) / M_PI;
      }
    }
    return albedo * intensity * sum;
  };
  const Vec3d key = sum_of_point({-0.3, 0, 4}, {60, 0, 30}), fill = sum_of_point({-1, 0, 2}, {10, 18, 0});
  const Vec3d rest = sum_of_point({-1, 1, 3}, {0, 0, 206});

  for (const std::string method : {"path", "raycast"}) {
    const bool path = method == "path";
    on_farm({"render", file("scene.json"), "--spp", "20", "--method", method, "-o", file("a.exr"), "--layers",
             path ? "direct,indirect,albedo,light:key,light:fill,normal,depth,id" : "albedo,normal,depth,id"});
    const auto bytes = read_file(file("a.exr"));
    ASSERT_TRUE(bytes.ok());
    const Result<Image> image = decode_exr(as_byte_view(*bytes));
    ASSERT_TRUE(image.ok()) << image.status();

    // `path` samples one of three lights per sample. The standard deviation is √2 of the mean, or 0.7 % of the mean of
    // 46,200 samples. Five of these raise a false alarm once in 1.7 million values. `raycast` has no noise.
    const double tolerance = path ? 0.035 : 1e-3;
    const auto expect_sum = [&](const std::string& layer, const Vec3d& exact) {
      for (int channel = 0; channel < 3; ++channel) {
        const std::vector<float>& values = plane(*image, layer + "RGB"[channel]);
        double sum = 0;
        for (std::size_t row = 0; row < 66; ++row) {
          sum += std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(70 * row),
                                 values.begin() + static_cast<std::ptrdiff_t>(70 * row + 35), 0.0);
        }
        EXPECT_NEAR(sum, exact[channel], tolerance * exact[channel]) << method << ' ' << layer << channel;
      }
    };
    expect_sum("", key + fill + rest);
    if (path) {
      expect_sum("Direct.", key + fill + rest);
      expect_sum("Indirect.", Vec3d(0));
      expect_sum("Light.key.", key);
      expect_sum("Light.fill.", fill);
      expect_sum("Light.rest.", rest);
    }

    const auto objects = manifest_of(*image, "CryptoObject"), materials = manifest_of(*image, "CryptoMaterial");
    ASSERT_TRUE(objects.contains("wall") && materials.contains("paint"));
    const auto value = [&](const std::string& name, std::size_t i) { return plane(*image, name)[i]; };
    for (const std::size_t i : {std::size_t{70 * 5 + 3}, std::size_t{70 * 33 + 20}, std::size_t{70 * 60 + 33}}) {
      EXPECT_NEAR(value("Albedo.R", i), albedo.x, 1e-6);
      EXPECT_NEAR(value("Albedo.G", i), albedo.y, 1e-6);
      EXPECT_NEAR(value("Albedo.B", i), albedo.z, 1e-6);
      EXPECT_NEAR(value("N.X", i), 0, 1e-6);
      EXPECT_NEAR(value("N.Y", i), 0, 1e-6);
      EXPECT_NEAR(value("N.Z", i), 1, 1e-6);
      EXPECT_NEAR(value("Z", i), 4, 1e-4);
      EXPECT_EQ(std::bit_cast<std::uint32_t>(value("CryptoObject00.R", i)), objects.at("wall"));
      EXPECT_EQ(value("CryptoObject00.G", i), 1);
      EXPECT_EQ(std::bit_cast<std::uint32_t>(value("CryptoMaterial00.R", i)), materials.at("paint"));
      EXPECT_EQ(value("CryptoMaterial00.G", i), 1);
    }
    const std::size_t beside = 70 * 33 + 60;  // nothing is there
    EXPECT_EQ(value("Z", beside), kNoDepth);
    for (const char* const name : {"R", "N.Z", "Albedo.R", "CryptoObject00.G", "CryptoMaterial00.G"}) {
      EXPECT_EQ(value(name, beside), 0) << name;
    }
  }
}

/// A black emitter of radiance 3, half a unit wide, and two meters that see it.
const std::string kLit = R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 40},
    "film": {"width": 96, "height": 70},
    "materials": [{"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [3, 3, 3]}}],
    "objects": [{"material": "lamp", "sphere": {"center": [0, 1, 0], "radius": 0.5}}])";
const std::string kMeters = R"(, "meters": [
    {"name": "desk", "irradiance": {"point": [0, -1, 0], "normal": [0, 1, 0]}},
    {"name": "eye", "radiance": {"point": [0, 0, 5], "direction": [0, 1, -5]}}]})";

TEST_F(SharedFarmTest, MetersAreReadAndDoNotChangeThePicture) {
  const auto render = [&](const std::string& name, const std::string& method) {
    return std::vector<std::string>{"render",     file(name), "--spp",       "20",       "--crop",
                                    "10,0,70,66", "-o",       file("a.exr"), "--method", method};
  };
  write("plain.json", kLit + "}");
  write("metered.json", kLit + kMeters);
  const nlohmann::json plain = on_farm(render("plain.json", "path"));
  const Result<FilmPicture> plain_picture = load_film_picture(file("a.exr"));
  const nlohmann::json metered = on_farm(render("metered.json", "path"));
  const Result<FilmPicture> picture = load_film_picture(file("a.exr"));
  ASSERT_TRUE(picture.ok() && plain_picture.ok());
  EXPECT_EQ(picture->beauty, plain_picture->beauty);
  EXPECT_EQ(metered["error"], plain["error"]);
  EXPECT_NE(metered["film_hash"], plain["film_hash"]);
  EXPECT_EQ(film_hash_of(*picture).hex(), metered["film_hash"]);
  EXPECT_EQ(metered["samples_done"], (70 * 66 + 2 * 4096) * 20);

  // E = πL (R/d)², and L.
  const auto bytes = read_file(file("a.exr"));
  const Result<Image> image = decode_exr(as_byte_view(*bytes));
  ASSERT_TRUE(image.ok()) << image.status();
  for (const nlohmann::json& readings : {metered["meters"], nlohmann::json::parse(image->text("lightmill.meters"))}) {
    ASSERT_EQ(readings.size(), 2u);
    EXPECT_EQ(readings[0]["name"], "desk");
    EXPECT_NEAR(readings[0]["value"].get<double>(), M_PI * 3 / 16, 1e-3);
    EXPECT_NEAR(readings[0]["photometric"].get<double>(), 683 * M_PI * 3 / 16, 0.7);
    EXPECT_GT(readings[0]["half_width"].get<double>(), 0);
    EXPECT_EQ(readings[0]["unit"], "W/m²");
    EXPECT_EQ(readings[1]["photometric_unit"], "cd/m²");
    EXPECT_NEAR(readings[1]["value"].get<double>(), 3, 1e-5);
    EXPECT_EQ(readings[1]["samples"], 20);
  }
  const std::string id = std::to_string(metered["id"].get<std::uint64_t>());
  const std::string shown = lightmill({"show", id, "--server", server()}).out;
  EXPECT_NE(shown.find("each ± has 95% confidence"), std::string::npos) << shown;
  EXPECT_NE(shown.find(", 95% confidence)"), std::string::npos) << shown;
  // Other methods read no meters.
  EXPECT_FALSE(on_farm(render("metered.json", "preview")).contains("meters"));
  const CommandResult preview = lightmill(with(render("metered.json", "preview"), {"--server", server()}));
  EXPECT_NE(preview.err.find("left out: the scene's 2 meters, which method preview does not support (path does)"),
            std::string::npos)
      << preview.err;
}

TEST_F(CliTest, LayersMetersAndLimitsWorkOnALocalFarm) {
  write("scene.json", kLit + kMeters);
  const nlohmann::json done =
      json({"render", file("scene.json"), "--local", "--method", "path", "--layers", "direct,depth", "--error", "1e-9",
            "--spp", "20", "--seconds", "10m", "-o", file("a.exr")});
  EXPECT_EQ(done["reached"], "samples");
  EXPECT_EQ(done["min_tile_samples"], 20);
  ASSERT_EQ(done["meters"].size(), 2u);
  EXPECT_NEAR(done["meters"][1]["value"].get<double>(), 3, 1e-5);
  const Result<FilmPicture> picture = load_film_picture(file("a.exr"));
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(film_hash_of(*picture).hex(), done["film_hash"]);
  const Image image = decode_exr(as_byte_view(read_file(file("a.exr")).value())).value();
  EXPECT_EQ(plane(image, "Direct.G"), plane(image, "G")) << "a single light";
  const std::size_t on_emitter = 96 * 16 + 48, beside = 96 * 60 + 48;
  EXPECT_EQ(plane(image, "G")[on_emitter], 3);
  EXPECT_LT(plane(image, "Z")[on_emitter], 5.1);
  EXPECT_EQ(plane(image, "Z")[beside], kNoDepth);
  const nlohmann::json verified = json({"verify", file("a.exr"), file("scene.json"), "--local", "--share", "all"});
  EXPECT_EQ(verified["verified"], verified["tiles"]);
}

TEST_F(CliTest, InvalidLayersAreRefusedAtOnce) {
  const std::string balls = scene("cornell-bench-balls.json");
  const auto error = [&](std::vector<std::string> arguments) {
    const CommandResult result = lightmill(std::move(arguments));
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_NE(error({"render", balls, "-o", file("a.exr"), "--layers", "depht"})
                .find("unknown layer 'depht'. Did you mean 'depth'?"),
            std::string::npos);
  EXPECT_NE(error({"render", balls, "-o", file("a.exr"), "--method", "preview", "--layers", "direct"})
                .find("method preview has no layer \"direct\""),
            std::string::npos);
  EXPECT_NE(error({"submit", balls, "--layers", "light:key"}).find("the scene has no light group \"key\". It has none"),
            std::string::npos);
}

}  // namespace
}  // namespace lightmill::test
