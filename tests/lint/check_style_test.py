#!/usr/bin/env python3
"""Tests that the style checker finds planted violations, and nothing in a clean tree."""
import pathlib
import tempfile
import unittest

import check_style


class CheckerFinds(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        self.addCleanup(self.folder.cleanup)

    def plant(self, path, text):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def found(self):
        return "\n".join(check_style.check_tree(self.root).lines)

    def assert_finds(self, path, text, what):
        self.plant(path, text)
        self.assertIn(what, self.found())

    def test_nothing_in_a_clean_tree(self):
        self.plant("common/film/film.h", '#include <vector>\n#include "common/base/status.h"\n')
        self.plant("common/wire/x.cpp", '#include "lightmill/v1/farm.pb.h"\n#include "common/farm/job.h"\n')
        self.plant("server/api/x.cpp", '#include <grpcpp/grpcpp.h>\n#include "server/domain/x.h"\n')
        self.plant("server/store/sqlite/x.cpp", "#include <sqlite3.h>\n")
        self.plant("server/domain/x.h", "#include <map>\n// std::thread is not used here, nor steady_clock\n")
        self.plant("run.sh", "#!/bin/sh\necho ok\n")
        self.plant("tests/unit/CMakeLists.txt", "lightmill_test(unit_tests LABELS unit SOURCES a_test.cpp b/b_test.cpp DEPS x)\n")
        self.plant("tests/unit/b/b_test.cpp", "TEST(B, IsListedAbove) {}\n")
        self.plant("tests/unit/a_test.cpp", """
struct Case {
  std::string name;
  friend void PrintTo(const Case& what, std::ostream* out) { *out << what.name; }
};
class A : public testing::TestWithParam<Case> {};
class B : public Other, public ::testing::WithParamInterface<std::pair<const char*, std::vector<std::uint64_t>>> {};
INSTANTIATE_TEST_SUITE_P(All, A, testing::Values(Case{"one, two"}, Case{"three"}),
                         [](const auto& info) { return info.param.name; });
INSTANTIATE_TEST_SUITE_P(All, B, kPairs, name_of<const char*, int>);
""")
        self.assertEqual(self.found(), "")

    def test_a_common_folder_that_includes_one_below_it(self):
        self.assert_finds("common/base/x.h", '#include "common/film/film.h"\n', "common/base must not include")

    def test_a_common_folder_that_is_not_in_the_list(self):
        self.assert_finds("common/misc/x.h", '#include "common/base/ids.h"\n', "unknown folder")

    def test_a_server_folder_that_includes_one_below_it(self):
        self.assert_finds("server/runtime/x.h", '#include "server/operations/x.h"\n', "server/runtime must not include")
        self.assert_finds("server/web/x.h", '#include "server/api/x.h"\n', "server/web must not include")
        self.assert_finds("server/api/x.h", '#include "server/web/x.h"\n', "server/api must not include")
        self.assert_finds("server/misc/x.h", '#include "server/domain/x.h"\n', "unknown folder in server")

    def test_a_method_that_includes_another(self):
        self.assert_finds("common/methods/photons/x.h", '#include "common/methods/vcm/x.h"\n', "common/methods/photons must not include")
        self.assert_finds("common/methods/vcm/x.h", '#include "common/methods/ppm/x.h"\n', "common/methods/vcm must not include")
        self.assert_finds("common/methods/misc/x.h", '#include "common/methods/path/x.h"\n', "unknown folder in common/methods")

    def test_programs_that_include_each_other(self):
        self.assert_finds("client/cli/x.h", '#include "server/domain/x.h"\n', "client must not include")
        self.assert_finds("common/film/y.h", '#include "worker/session/x.h"\n', "common must not include")

    def test_libraries_behind_the_wrong_door(self):
        for path, include, what in [
            ("server/domain/a.cpp", "grpcpp/grpcpp.h", "gRPC"),
            ("worker/session/b.cpp", "lightmill/v1/worker_service.grpc.pb.h", "gRPC"),
            ("common/film/c.cpp", "lightmill/v1/farm.pb.h", "protobuf"),
            ("common/scene/d.cpp", "google/protobuf/message.h", "protobuf"),
            ("server/api/e.cpp", "sqlite3.h", "SQL"),
            ("common/methods/f.cpp", "embree3/rtcore.h", "Embree"),
            ("client/cli/g.cpp", "ImfHeader.h", "an image library"),
            ("worker/rpc/h.cpp", "spng.h", "an image library"),
            ("worker/render/i.cpp", "OpenImageIO/imageio.h", "OpenImageIO"),
            ("common/image/j.cpp", "OpenImageIO/imageio.h", "OpenImageIO"),
            ("worker/render/k.cpp", "seccomp.h", "seccomp"),
        ]:
            self.assert_finds(path, f"#include <{include}>\n", f"{path}:1: {include}: {what} is for")

    def test_threads_clocks_and_disks_in_pure_folders(self):
        self.assert_finds("server/domain/a.cpp", "#include <thread>\n", "server/domain/a.cpp:1")
        self.assert_finds("server/scheduling/b.cpp", '#include "common/base/file.h"\n', "server/scheduling/b.cpp:1")
        self.assert_finds("worker/session/c.cpp", "auto t = std::chrono::steady_clock::now();\n", "worker/session/c.cpp:1")
        self.assert_finds("server/assembly/d.cpp", "\nstd::mutex m;\n", "server/assembly/d.cpp:2")

    def test_the_real_clock_in_common(self):
        self.assert_finds("common/farm/a.cpp", "auto t = std::chrono::system_clock::now();\n", "common/farm/a.cpp:1")

    def test_subranges(self):
        self.assert_finds("common/scene/a.cpp", "std::ranges::unique(keys);\n", "clang does not compile it")

    def test_standard_distributions(self):
        self.assert_finds("common/sampling/a.cpp", "std::uniform_real_distribution<float> u;\n", "not standardised")

    def test_test_files_that_nothing_compiles(self):
        self.plant("tests/unit/CMakeLists.txt", "lightmill_test(unit_tests LABELS unit SOURCES a_test.cpp DEPS x)\n")
        self.assert_finds("tests/unit/b_test.cpp", "TEST(B, IsNotListed) {}\n", "b_test.cpp:1: is in no CMakeLists.txt")
        self.plant("tests/e2e/CMakeLists.txt", "foreach(idea page chart)\n")
        self.plant("tests/e2e/chart_test.mjs", "")
        self.assert_finds("tests/e2e/edit_test.mjs", "", "edit_test.mjs:1: is in no CMakeLists.txt")
        self.assertNotIn("chart_test.mjs", self.found())
        self.plant("tests/lint/CMakeLists.txt", "add_test(NAME a COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/a_test.py)\n")
        self.plant("tests/lint/a_test.py", "")
        for name in ("b_test.py", "b_test.sh", "b_test.cjs"):
            self.assert_finds(f"tests/lint/{name}", "", f"{name}:1: is in no CMakeLists.txt")
        self.assertNotIn("a_test.py", self.found())

    def test_parameterised_tests_without_names(self):
        for values in ['testing::Values("a, b", "c")', "testing::Range<std::uint64_t>(0, 8)",
                       "testing::ValuesIn(std::map<int, int>{{1, 2}, {3, 4}})", "\n    kAll"]:
            self.assert_finds("tests/unit/a_test.cpp", f"\nINSTANTIATE_TEST_SUITE_P(All, A, {values});\n",
                              "tests/unit/a_test.cpp:2: A: name its tests")

    def test_parameters_that_are_printed_as_bytes_or_addresses(self):
        for written, what in [("Case", "Case: reports show its bytes"), ("std::vector<test::Case>", "std::vector<test::Case>: reports"),
                              ("std::function<int()>", "std::function<int()>: reports"), ("int*", "int*: a pointer is printed")]:
            for base in ("TestWithParam", "WithParamInterface"):
                self.assert_finds("tests/unit/a_test.cpp", f"class A : public testing::{base}<{written}> {{}};\n",
                                  f"tests/unit/a_test.cpp:1: {what}")

    def test_paths_and_hosts_of_machines(self):
        for word in check_style.MACHINE_WORDS:
            self.assert_finds("docs/a.md", f"see {word}x\n", "docs/a.md:1")

    def test_unfinished_work(self):
        self.assert_finds("common/base/a.h", "// " + "TO" + "DO: later\n", "unfinished")

    def test_shell_scripts_that_do_not_parse(self):
        self.assert_finds("a.sh", "#!/bin/sh\nif true; then\n", "sh finds faults")

    def test_renumbered_and_reused_proto_fields(self):
        proto = "message A {\n  message B { int32 z = 1; }\n  oneof k { int32 x = 1; }\n  repeated bytes y = 2;\n}\n"
        self.plant("proto/lightmill/v1/a.proto", proto)
        self.assertIn("A.x = 1 is not recorded", self.found())
        (self.root / "tests/lint").mkdir(parents=True)
        check_style.update_proto(self.root)
        self.assertEqual(check_style.read_record(self.root), {"A.B.z": 1, "A.x": 1, "A.y": 2})
        self.assertEqual(self.found(), "")
        self.plant("proto/lightmill/v1/a.proto", proto.replace("x = 1", "x = 3"))
        self.assertIn("A.x was 1 and is 3", self.found())
        self.plant("proto/lightmill/v1/a.proto", proto.replace("int32 x = 1", "int32 w = 1"))
        self.assertIn("A.w takes number 1, which was A.x's", self.found())


class LinkCheckFinds(unittest.TestCase):
    def test_a_library_that_a_program_must_not_link(self):
        check_style.FORBIDDEN_LINKS["sh"] = r"libc\.so"
        self.assertIn("must not link", "\n".join(check_style.check_links(["sh=/bin/sh"]).lines))
        check_style.FORBIDDEN_LINKS["sh"] = r"libembree"
        self.assertEqual(check_style.check_links(["sh=/bin/sh"]).lines, [])


if __name__ == "__main__":
    unittest.main()
