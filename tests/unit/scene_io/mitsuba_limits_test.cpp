// Limits of what an untrusted Mitsuba scene can ask for.
#include "tests/unit/scene_io/mitsuba_fixture.h"

namespace lightmill::test {
namespace {

TEST(MitsubaLimits, DefaultsThatGrowAreRefused) {
  std::string body = "<default name=\"a0\" value=\"xxxxxxxxxx\"/>\n";
  for (int i = 1; i < 30; ++i) {
    body += fmt::format("<default name=\"a{0}\" value=\"$a{1}.$a{1}.\"/>\n", i, i - 1);
  }
  EXPECT_NE(mitsuba_error(body + kSphere).find("the values of defaults make too much text"), std::string::npos);
}

TEST(MitsubaLimits, ReferencesInACircleEnd) {
  EXPECT_EQ(
      mitsuba_error(
          "<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf><shape type=\"sphere\"><ref id=\"a\"/></shape>"),
      "a.xml:2: materials are nested more than 50 deep");
  EXPECT_EQ(mitsuba_error(R"(<shape type="sphere"><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf></shape>
<texture type="checkerboard" id="t"><ref name="color0" id="t"/><ref name="color1" id="t"/></texture>)"),
            "a.xml:3: textures are nested more than 50 deep");
  EXPECT_EQ(mitsuba_error(R"(<shape type="shapegroup" id="g"><ref id="g"/></shape>)"),
            "a.xml:2: shapes of the type \"shapegroup\" cannot be rendered");
}

TEST(MitsubaLimits, DeepNestingIsRefused) {
  std::string body;
  for (int i = 0; i < 100'000; ++i) {
    body += "<shape type=\"shapegroup\">";
  }
  EXPECT_EQ(mitsuba_error(body), "a.xml:3: the XML cannot be read: Start-end tags mismatch");
  for (int i = 0; i < 100'000; ++i) {
    body += "</shape>";
  }
  EXPECT_EQ(mitsuba_error(body), "a.xml:2: elements are nested more than 50 deep");
}

TEST(MitsubaLimits, EntitiesAreNotExpanded) {
  const Result<LoadedScene> loaded = read_xml(
      "<!DOCTYPE scene [<!ENTITY file SYSTEM \"file:///etc/passwd\">]>\n"
      "<scene version=\"3.0.0\"><shape type=\"sphere\" id=\"&file;\"/></scene>");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->scene.objects[0].name, "&file;");
}

TEST(MitsubaLimits, ObjectsHaveFewParts) {
  std::string parameters, children;
  for (int i = 0; i < 101; ++i) {
    parameters += fmt::format("<float name=\"p{}\" value=\"1\"/>", i);
    children += "<ref id=\"red\"/>";
  }
  EXPECT_EQ(mitsuba_error("<shape type=\"sphere\">" + parameters + "</shape>"),
            "a.xml:2: shape sphere: at most 100 parameters are expected");
  EXPECT_EQ(mitsuba_error("<shape type=\"sphere\">" + children + "</shape>"),
            "a.xml:2: shape sphere: at most 100 nested objects are expected");
}

// Objects that are left out take time, too.
TEST(MitsubaLimits, ShapesWithoutASizeAreCounted) {
  std::string body = "<shape type=\"shapegroup\" id=\"g\">";
  for (int i = 0; i < 1100; ++i) {
    body += "<ref id=\"flat\"/>";
  }
  body += R"(</shape><shape type="shapegroup"><shape type="cube" id="flat"><transform name="to_world"><scale value="0"/>
</transform></shape></shape>)";
  for (int i = 0; i < 1000; ++i) {
    body += "<shape type=\"instance\"><ref id=\"g\"/></shape>";
  }
  EXPECT_EQ(mitsuba_error(body), "a.xml:3: there are more than 1000000 shapes and instances");
}

TEST(MitsubaLimits, LongNamesOfFilesAreRefused) {
  EXPECT_EQ(mitsuba_error("<include filename=\"" + std::string(5000, 'a') + "\"/>"),
            "a.xml:2: the name of a file has more than 4096 bytes");
  EXPECT_EQ(mitsuba_error("<path value=\"" + std::string(5000, 'a') + "\"/>"),
            "a.xml:2: at most 20 paths can be read, of 4096 bytes each");
}

TEST(MitsubaLimits, IncludedTextIsLimitedInAll) {
  std::string body;
  for (int i = 0; i < 6; ++i) {
    body += "<include filename=\"b.xml\"/>";
  }
  EXPECT_EQ(mitsuba_error(body, {{"b.xml", "<scene version=\"3.0.0\">" + std::string(50 << 20, ' ') + "</scene>"}}),
            "b.xml:1: at most 64 MiB a file and 256 MiB in all can be read");
}

TEST(MitsubaLimits, FilesOfSharedObjectsAreReadOnce) {
  std::map<std::string, int> reads;
  const Result<LoadedScene> loaded = read_mitsuba(
      scene_xml(R"(<emitter type="area" id="lamp"><spectrum name="radiance" filename="a.spd"/></emitter>
<medium type="homogeneous" id="fog"><spectrum name="albedo" filename="b.spd"/></medium>
<shape type="sphere"><ref id="lamp"/></shape><shape type="cube"><ref id="lamp"/></shape>
<shape type="sphere"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
<shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
<shape type="obj"><string name="filename" value="c.obj"/></shape>
<shape type="obj"><string name="filename" value="c.obj"/><boolean name="face_normals" value="true"/></shape>)"),
      "a.xml", [&](const std::string& name) -> Result<SourceFile> {
        ++reads[name];
        return SourceFile{name, name == "c.obj" ? "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" : "400 0.5\n700 0.5\n"};
      });
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->scene.objects.size(), 6u);
  EXPECT_EQ(reads, (std::map<std::string, int>{{"a.spd", 1}, {"b.spd", 1}, {"c.obj", 1}}));
}

}  // namespace
}  // namespace lightmill::test
