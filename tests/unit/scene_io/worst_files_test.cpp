// Hostile files: the work to read them, or to refuse them, grows with their size and not with its square.
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/unit/scene_io/gltf_text.h"
#include "tests/unit/scene_io/load_fixture.h"
#include "tests/unit/scene_io/work_done.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

using test::Load;

/// Files of a scene by name. The first one is the scene.
using Files = std::vector<std::pair<std::string, std::string>>;

/// Twice the statements take about twice the work, and about twice the memory.
class WorstFiles : public Load {
 protected:
  static constexpr int kMany = 4'000;
  /// Bytes that are allocated in all for each byte of the files. Paths of many short names take most.
  static constexpr std::uint64_t kMaxAllocated = 1'000;

  /// Reads the files that `make` gives for a number of statements. Returns the result for the larger number.
  Result<LoadedScene> expect_proportional(const std::function<Files(int count)>& make, int many = kMany) {
    std::array<std::uint64_t, 2> work{}, allocated{};
    Result<LoadedScene> last = LoadedScene();
    for (const int times : {1, 2}) {
      const Files files = make(times * many);
      std::uint64_t bytes = 0;
      for (const auto& [name, text] : files) {
        write(name, text);
        bytes += text.size();
      }
      const std::uint64_t work_before = *test::work_done(), allocated_before = *test::bytes_allocated();
      last = load({folder_ / files.front().first});
      const auto which = static_cast<std::size_t>(times - 1);
      work[which] = *test::work_done() - work_before;
      allocated[which] = *test::bytes_allocated() - allocated_before;
      EXPECT_LT(allocated[which], kMaxAllocated * bytes + (1 << 20));
    }
    EXPECT_GT(work[0], static_cast<std::uint64_t>(many)) << "the work is not counted";
    EXPECT_LT(work[1], 5 * work[0] / 2);
    EXPECT_LT(allocated[1], 5 * allocated[0] / 2 + (1 << 20));
    return last;
  }
  static constexpr int kCorners = 16'000;
  /// Reads files with a polygon of kCorners. Triangulation may take 2,000 steps of about ten blocks for each.
  void expect_few_steps_for_each_corner(const Files& files) {
    for (const auto& [name, text] : files) {
      write(name, text);
    }
    const std::uint64_t before = *test::work_done();
    const Result<LoadedScene> loaded = load({folder_ / files.front().first});
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    EXPECT_LT(*test::work_done() - before, std::uint64_t{30'000} * kCorners);
  }
  void expect_read(const std::function<Files(int count)>& make, int many = kMany) {
    const Result<LoadedScene> loaded = expect_proportional(make, many);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
  }
};

using Point = std::array<double, 2>;

/// Outlines with `n` corners that make it hard to find ears.
std::vector<std::pair<std::string, std::function<std::vector<Point>(int n)>>> outlines() {
  const auto dart = [](std::vector<Point> tail) {
    std::vector<Point> out{{4, 0}, {1, 1}, {0, 4}};  // reflex at (1, 1), where a fan spills
    out.insert(out.end(), tail.begin(), tail.end());
    out.push_back({0, 0});
    return out;
  };
  return {
      {"corners on one edge",
       [=](int n) {
         std::vector<Point> edge;
         for (int i = 1; i < n; ++i) {
           edge.push_back({0, 4 - 4.0 * i / n});
         }
         return dart(edge);
       }},
      {"a line that is walked to and fro",
       [=](int n) {
         std::vector<Point> line;
         for (int i = 0; i < n; ++i) {
           line.push_back({0, i % 2 == 0 ? 1.0 : 3.0});
         }
         return dart(line);
       }},
      {"spikes of many lengths",
       [=](int n) {
         std::vector<Point> line;
         for (int i = 0; i < n; ++i) {
           line.push_back({0, 4 - (i % 2 == 0 ? 0.001 * i : 3.5)});
         }
         return dart(line);
       }},
      {"one place",
       [=](int n) {
         return dart(std::vector<Point>(static_cast<std::size_t>(n), Point{0, 2}));
       }},
      {"points anywhere",
       [](int n) {
         std::vector<Point> out;
         std::uint64_t random = 1;
         const auto next = [&] {
           random = random * 6364136223846793005u + 1442695040888963407u;
           return static_cast<double>(random >> 40) / (1 << 24);
         };
         for (int i = 0; i < n; ++i) {
           const double x = next();
           out.push_back({x, next()});
         }
         return out;
       }},
      {"a hollow arc",
       [](int n) {
         std::vector<Point> out{{2, -1}, {2, 2}, {-2, 2}, {-2, -1}};
         for (int i = 1; i < n; ++i) {
           const double angle = std::numbers::pi * (1 - static_cast<double>(i) / n);
           out.push_back({std::cos(angle), std::sin(angle) - 1});
         }
         return out;
       }},
      {"a spiral",
       [](int n) {
         std::vector<Point> out;
         for (int i = 0; i < n; ++i) {
           const int step = i < n / 2 ? i : n - 1 - i;
           const double angle = 0.05 * step, radius = (1 + angle) * (i < n / 2 ? 1 : 0.98);
           out.push_back({radius * std::cos(angle), radius * std::sin(angle)});
         }
         return out;
       }},
      {"long teeth",
       [](int n) {
         std::vector<Point> out{{-1, 0}, {-1, 1.0 * n}};
         for (int i = n; i > 1; --i) {
           out.push_back({i % 2 == 0 ? 1e4 : 0.5, static_cast<double>(i)});
         }
         return out;
       }},
  };
}

std::string pbrt(const std::string& world) {
  return "Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" 20\nWorldBegin\n" +
         world;
}

TEST_F(WorstFiles, OutlinesOfObjFacesTakeFewStepsForEachCorner) {
  for (const auto& [name, outline] : outlines()) {
    SCOPED_TRACE(name);
    std::string obj, face = "f";
    int i = 0;
    for (const auto& [x, y] : outline(kCorners)) {
      obj += fmt::format("v {} {} 0\n", x, y);
      face += fmt::format(" {}", ++i);
    }
    expect_few_steps_for_each_corner({{"a.obj", obj + face + "\n"}});
  }
}

TEST_F(WorstFiles, OutlinesOfPlyFacesTakeFewStepsForEachCorner) {
  for (const auto& [name, outline] : outlines()) {
    SCOPED_TRACE(name);
    const std::vector<Point> points = outline(kCorners);
    std::string ply = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {0}\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list int int vertex_indices\nend_header\n",
        points.size());
    std::string face = fmt::format("{}", points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      ply += fmt::format("{} {} 0\n", points[i][0], points[i][1]);
      face += fmt::format(" {}", i);
    }
    expect_few_steps_for_each_corner(
        {{"a.pbrt", pbrt("Shape \"plymesh\" \"string filename\" \"a.ply\"\n")}, {"a.ply", ply + face}});
  }
}

TEST_F(WorstFiles, PlyFacesOfFewBytesTakeProportionalWork) {
  expect_read([](int count) {
    std::string ply = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\nproperty char z\n"
        "element face {}\nproperty list uchar char vertex_indices\nend_header\n",
        count);
    ply += std::string("\0\0\0\1\0\0\0\1\0", 9);
    for (int i = 0; i < count; ++i) {
      ply += i % 2 == 0 ? std::string("\3\0\1\2", 4) : std::string("\0", 1);
    }
    return Files{{"a.pbrt", pbrt("Shape \"plymesh\" \"string filename\" \"a.ply\"\n")}, {"a.ply", ply}};
  });
}

TEST_F(WorstFiles, ObjStatementsTakeProportionalWork) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  expect_read([&](int count) {  // a material and a smoothing group for each face
    std::string obj = corners;
    for (int i = 0; i < count; ++i) {
      obj += fmt::format("usemtl {}\ns {}\nf 1 2 3\n", i, i + 1);
    }
    return Files{{"a.obj", obj}};
  });
  expect_read([&](int count) {  // unknown statements, wrong corners, faces before their corners
    std::string obj = corners;
    for (int i = 0; i < count; ++i) {
      obj += fmt::format("x{0} 1\nf 1 2 {1}\nf 1 2 3/{1}/{1}\nf {2} 2 3\nl 1 2\n", i, i + 5, i + 4);
    }
    for (int i = 0; i < count; ++i) {
      obj += fmt::format("v 0 {} 0\n", i);
    }
    return Files{{"a.obj", obj}};
  });
  expect_read([&](int count) {  // one library again and again
    std::string obj = corners, mtl;
    for (int i = 0; i < count; ++i) {
      obj += "mtllib a.mtl\n";
      mtl += fmt::format("newmtl {}\nKd 1 0 0\n", i);
    }
    return Files{{"a.obj", obj + "f 1 2 3\n"}, {"a.mtl", mtl}};
  });
  expect_read([&](int count) {  // a long name of a library
    std::string obj = corners + "mtllib ";
    for (int i = 0; i < count; ++i) {
      obj += "../a\\b ";
    }
    return Files{{"a.obj", obj + "\nf 1 2 3\n"}};
  });
}

TEST_F(WorstFiles, MtlStatementsTakeProportionalWork) {
  const std::string obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
  const auto of_one_material = [&](const std::function<std::string(int)>& statement) {
    expect_read([&](int count) {
      std::string mtl = "newmtl m\n";
      for (int i = 0; i < count; ++i) {
        mtl += statement(i);
      }
      return Files{{"a.obj", obj}, {"a.mtl", mtl}};
    });
  };
  of_one_material([](int i) { return fmt::format("map_Kd {}.png\nmap_Ks -s {} a.png\n", i, i); });
  of_one_material([](int i) { return fmt::format("unknown{} 1\n", i); });
  of_one_material([](int i) { return fmt::format("newmtl m\nKd 0 0 {}\n", 1.0 / (i + 1)); });
  expect_read([&](int count) {
    std::string option = "newmtl m\nmap_Kd";
    for (int i = 0; i < count; ++i) {
      option += " -s 1 2 -mm 0 2";
    }
    return Files{{"a.obj", obj}, {"a.mtl", option + " a.png\n"}};
  });
  expect_read([&](int count) {
    std::string path = "newmtl m\nmap_Kd ";
    for (int i = 0; i < count; ++i) {
      path += i % 2 == 0 ? "../" : "a/";
    }
    return Files{{"a.obj", obj}, {"a.mtl", path + "a.png\n"}};
  });
}

TEST_F(WorstFiles, MaterialsOfOneNameInManyFilesTakeProportionalWork) {
  const auto work_of = [&](int count) {
    std::vector<fs::path> paths;
    for (int i = 0; i < count; ++i) {
      const std::string folder = fmt::format("{}", i);
      fs::create_directories(folder_ / folder);
      write(folder + "/a.mtl", fmt::format("newmtl m\nKd 0 0 {}\n", 1.0 / (i + 1)));
      paths.push_back(write(folder + "/a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"));
    }
    const std::uint64_t before = *test::work_done();
    const Result<LoadedScene> loaded = load(paths);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    EXPECT_EQ(loaded->scene.materials.size(), static_cast<std::size_t>(count));
    return *test::work_done() - before;
  };
  const std::uint64_t one = work_of(200), two = work_of(400);
  EXPECT_LT(two, 5 * one / 2);
}

/// A glTF file with one triangle. `members` begin with a comma, as do those of the primitive.
std::string one_triangle(const std::string& members, const std::string& attributes = "",
                         const std::string& nodes = R"({"mesh":0})") {
  test::GltfBuffer buffer;
  buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  return test::gltf(
      fmt::format(R"({},"nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{}}}}}]}}]{})",
                  buffer.embedded(), nodes, attributes, members));
}

std::string repeated(int count, const std::function<std::string(int)>& text) {
  std::string out;
  for (int i = 0; i < count; ++i) {
    out += (i == 0 ? "" : ",") + text(i);
  }
  return out;
}

TEST_F(WorstFiles, GltfListsTakeProportionalWork) {
  expect_read([](int count) {
    return Files{{"a.gltf", one_triangle(fmt::format(R"(,"extensionsUsed":[{}])", repeated(count, [](int i) {
                                                       return fmt::format(R"("EXT_{}")", i);
                                                     })))}};
  });
  expect_read([](int count) {
    std::string attributes;
    for (int i = 0; i < count; ++i) {
      attributes += fmt::format(R"(,"_A{}":0)", i);
    }
    return Files{{"a.gltf", one_triangle("", attributes)}};
  });
  expect_read([](int count) {  // values without a use, as short as they can be
    return Files{
        {"a.gltf", one_triangle(fmt::format(R"(,"extras":[{}])", repeated(count, [](int) { return "{},[]"; })))}};
  });
  expect_read([](int count) {
    return Files{
        {"a.gltf", one_triangle(fmt::format(R"(,"extras":{}{})", std::string(count, '['), std::string(count, ']')))}};
  });
  expect_read([](int count) {  // a chain of nodes
    return Files{{"a.gltf", one_triangle("", "", repeated(count, [&](int i) {
                                           return i + 1 < count ? fmt::format(R"({{"children":[{}]}})", i + 1)
                                                                : std::string(R"({"mesh":0})");
                                         }))}};
  });
  expect_read([](int count) {  // each primitive has its own material, texture and image, and all share their bytes
    test::GltfBuffer buffer;
    buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    buffer.add(test::packed<float>({0, 0, 1, 0, 0, 1}), "VEC2", 5126, 3);
    const std::string materials = repeated(count, [](int i) {
      return fmt::format(R"({{"name":"m","pbrMetallicRoughness":{{"baseColorTexture":{{"index":{}}}}}}})", i);
    });
    const std::string primitives = repeated(count, [](int i) {
      return fmt::format(R"({{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":{}}})", i);
    });
    const std::string textures = repeated(count, [](int i) { return fmt::format(R"({{"source":{}}})", i); });
    const std::string images = repeated(count, [](int i) { return fmt::format(R"({{"uri":"{}.png"}})", i % 9); });
    Files files{{"a.gltf", test::gltf(fmt::format(R"({},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}],
        "materials":[{}],"textures":[{}],"images":[{}])",
                                                  buffer.embedded(), primitives, materials, textures, images))}};
    for (int i = 0; i < 9; ++i) {
      files.emplace_back(fmt::format("{}.png", i), "\x89PNG\r\n\x1a\n");
    }
    return files;
  });
}

TEST_F(WorstFiles, SharedGltfNamesAndBuffersTakeProportionalWork) {
  const std::string name(900, 'n');
  expect_read([&](int count) {  // instances of a mesh, lights and cameras with long names
    test::GltfBuffer buffer;
    buffer.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const std::string nodes = repeated(
        count, [](int) { return R"({"mesh":0,"camera":0,"extensions":{"KHR_lights_punctual":{"light":0}}})"; });
    return Files{{"a.gltf", test::gltf(fmt::format(
                                R"({0},"nodes":[{1}],"meshes":[{{"name":"{2}","primitives":[{{"attributes":
        {{"POSITION":0}}}}]}}],"cameras":[{{"name":"{2}","type":"perspective","perspective":{{"yfov":1}}}}],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"name":"{2}","type":"point"}}]}}}})",
                                buffer.embedded(), nodes, name))}};
  });
  const Result<LoadedScene> flat = expect_proportional([](int count) {  // many buffers of one file
    const std::string buffers = repeated(count, [](int) { return R"({"byteLength":36,"uri":"a.bin"})"; });
    return Files{{"a.gltf", test::gltf(fmt::format(R"("buffers":[{}],"bufferViews":[{{"buffer":0,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"type":"VEC3","componentType":5126,"count":3}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}])",
                                                   buffers))},
                 {"a.bin", std::string(static_cast<std::size_t>(count) * 36, 'b')}};
  });
  EXPECT_NE(test::error_message(flat).find("none of its triangles has an area"), std::string::npos);
}

TEST_F(WorstFiles, PbrtDirectivesTakeProportionalWork) {
  expect_read([](int count) {  // each medium is within the next one
    std::string text = "MakeNamedMedium \"0\" \"string type\" \"homogeneous\"\nMaterial \"interface\"\n";
    for (int i = 1; i <= count; ++i) {
      text += fmt::format(
          "MakeNamedMedium \"{0}\" \"string type\" \"homogeneous\"\nMediumInterface \"{1}\" \"{0}\"\n"
          "Shape \"sphere\"\n",
          i, i - 1);
    }
    return Files{{"a.pbrt", pbrt(text + fmt::format("MediumInterface \"{}\" \"\" Shape \"sphere\"\n", count))}};
  });
  expect_read([](int count) {  // materials of one name, and shapes with a state of their own
    std::string text;
    for (int i = 0; i < count; ++i) {
      text += fmt::format("Material \"diffuse\" \"rgb reflectance\" [0 0 {}] AttributeBegin Translate 1 0 0 ",
                          1.0 / (i + 1));
      text += "Shape \"sphere\" AttributeEnd ";
    }
    return Files{{"a.pbrt", pbrt(text)}};
  });
  expect_read([](int count) {  // unknown parameters, and textures of textures
    std::string text = "Texture \"0\" \"spectrum\" \"constant\" \"rgb value\" [1 1 1]\n", shape = "Shape \"sphere\"";
    for (int i = 1; i < count; ++i) {
      text += fmt::format("Texture \"{0}\" \"spectrum\" \"mix\" \"texture tex1\" \"{1}\" \"texture tex2\" \"{1}\"\n", i,
                          i - 1);
      shape += fmt::format(" \"float x{}\" 1", i);
    }
    text += fmt::format("Material \"diffuse\" \"texture reflectance\" \"{}\"\n", count - 1);
    return Files{{"a.pbrt", pbrt(text + shape)}};
  });
  expect_read([](int count) {  // instances of an object
    std::string text = "ObjectBegin \"a\" Shape \"sphere\" ObjectEnd\n";
    for (int i = 0; i < count; ++i) {
      text += "ObjectInstance \"a\" LightSource \"point\"\n";
    }
    return Files{{"a.pbrt", pbrt(text)}};
  });
}

TEST_F(WorstFiles, ValuesOfAPbrtAttributeAreLimited) {
  std::string values;
  for (int i = 0; i < 1001; ++i) {
    values += " 0";
  }
  write("a.pbrt", pbrt("Attribute \"shape\" \"point3 P\" [" + values + " ]\nShape \"sphere\"\n"));
  EXPECT_EQ(error({folder_ / "a.pbrt"}), "a.pbrt:3: Attribute: P has more than 1000 values");
}

std::string xml(const std::string& body) {
  return "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n" + body + "\n</scene>";
}

TEST_F(WorstFiles, MitsubaElementsTakeProportionalWork) {
  expect_read([](int count) {  // shapes that share one bsdf with a long name
    const std::string id(2'000, 'i');
    std::string text = fmt::format("<bsdf type=\"diffuse\" id=\"{}\"/>", id);
    for (int i = 0; i < count; ++i) {
      text += fmt::format("<shape type=\"sphere\" id=\"s{}\"><ref id=\"b\"/></shape>\n", i);
    }
    return Files{{"a.xml", xml(text + fmt::format("<alias id=\"{}\" as=\"b\"/>", id))}};
  });
  expect_read([](int count) {  // materials and emitters of each shape, all of one name
    std::string text;
    for (int i = 0; i < count; ++i) {
      text += fmt::format(
          "<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0 0 {}\"/></bsdf>"
          "<float name=\"unknown{}\" value=\"1\"/></shape>",
          1.0 / (i + 1), i);
    }
    return Files{{"a.xml", xml(text)}};
  });
  expect_read([](int count) {  // blends of blends
    std::string text = "<bsdf type=\"diffuse\" id=\"0\"/>";
    for (int i = 1; i < 50; ++i) {
      text += fmt::format("<bsdf type=\"blendbsdf\" id=\"{0}\"><ref id=\"{1}\"/><ref id=\"{1}\"/></bsdf>", i, i - 1);
    }
    for (int i = 0; i < count; ++i) {
      text += fmt::format("<shape type=\"sphere\"><ref id=\"{}\"/></shape>", i % 50);
    }
    return Files{{"a.xml", xml(text)}};
  });
  expect_read([](int count) {  // instances of a group
    std::string text = "<shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\"/></shape>";
    for (int i = 0; i < count; ++i) {
      text += "<shape type=\"instance\"><ref id=\"g\"/></shape>";
    }
    return Files{{"a.xml", xml(text)}};
  });
}

std::string scene_document(const std::string& members) {
  return fmt::format(R"({{"camera": {{"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1}}, {}}})", members);
}

TEST_F(WorstFiles, DocumentListsTakeProportionalWork) {
  expect_read([](int count) {  // textures of one image, and objects of one file with many parts
    const std::string textures =
        repeated(count, [](int i) { return fmt::format(R"({{"name": "t{}", "file": "a.png"}})", i); });
    const std::string objects = repeated(count, [](int i) {
      return fmt::format(R"({{"name": "o{}", "material": "m", "mesh": {{"file": "a.obj"}}}})", i);
    });
    std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < count; ++i) {
      obj += fmt::format("usemtl {}\nf 1 2 3\n", i);
    }
    return Files{
        {"a.json", scene_document(fmt::format(R"("textures": [{}], "materials": [{{"name": "m", "mirror": {{}}}}],
        "objects": [{}])",
                                              textures, objects))},
        {"a.obj", obj},
        {"a.png", "an image"}};
  });
  expect_read([](int count) {  // lights, and objects without a file
    const std::string lights = repeated(count, [](int i) {
      return fmt::format(R"({{"name": "l{}", "point": {{"position": [0, 0, 1], "intensity": {{"rgb": [1, 1, 1]}}}}}})",
                         i);
    });
    const std::string objects =
        repeated(count, [](int) { return R"({"material": "m", "sphere": {"center": [0, 0, 0], "radius": 1}})"; });
    return Files{
        {"a.json", scene_document(fmt::format(R"("materials": [{{"name": "m", "mirror": {{}}}}], "lights": [{}],
        "objects": [{}])",
                                              lights, objects))}};
  });
}

// 400 objects with 400 parts each would have 160 MB of names.
TEST_F(WorstFiles, NamesOfObjectsThatShareAFileAreLimited) {
  const std::string long_name(1'000, 'n');
  std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", materials;
  for (int i = 0; i < 400; ++i) {
    obj += fmt::format("usemtl m{}\nf 1 2 3\n", i);
    materials += fmt::format(R"({}{{"name": "m{}", "mirror": {{}}}})", i == 0 ? "" : ",", i);
  }
  const std::string objects =
      repeated(400, [&](int) { return fmt::format(R"({{"name": "{}", "mesh": {{"file": "a.obj"}}}})", long_name); });
  write("a.obj", obj);
  write("a.json", scene_document(fmt::format(R"("materials": [{}], "objects": [{}])", materials, objects)));
  const std::uint64_t before = *test::bytes_allocated();
  const std::string refusal = error({folder_ / "a.json"});
  EXPECT_NE(refusal.find(": the names of the scene's objects have more than 64.0 MiB"), std::string::npos) << refusal;
  EXPECT_LT(*test::bytes_allocated() - before, std::uint64_t{512} << 20);
}

}  // namespace
}  // namespace lightmill
