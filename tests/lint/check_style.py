#!/usr/bin/env python3
"""Checks the rules on folders, includes and names in a source tree. Prints each violation as file:line: what.

  check_style.py [--root DIR]                    checks the sources
  check_style.py --update-proto [--root DIR]     records new proto fields, so that they can never be renumbered
  check_style.py --links NAME=BINARY ...         checks which libraries the programs link, directly or not
"""
import argparse
import pathlib
import re
import subprocess
import sys

COMMON_ORDER = ["base", "command_line", "security", "math", "geometry", "sampling", "image", "materials", "film", "lights", "scene",
                "methods", "planner", "farm", "wire", "scene_io"]
SERVER_ORDER = ["access", "scheduling", "domain", "store", "assembly", "listen", "runtime", "operations", "api", "web"]
METHODS_ORDER = ["spec", "tracer", "path", "photons", "raycast", "whitted", "preview", "ao", "caustic", "ppm", "vcm"]
LAYERS = {"common": COMMON_ORDER, "server": SERVER_ORDER, "common/methods": METHODS_ORDER}
SIBLINGS = [{"api", "web"}, {"preview", "ao", "caustic", "ppm", "vcm"}]  # these do not include each other
PROGRAMS = ["decoder", "server", "worker", "client"]
SOURCE_SUFFIXES = {".h", ".cpp"}

# One door per library: (what, pattern of the include, folders that may).
DOORS = [
    ("gRPC", r"(grpc|grpcpp|grpc\+\+)/|\.grpc\.pb\.h$", ["server/api", "worker/rpc", "client/cli"]),
    ("protobuf", r"^google/protobuf/|(?<!grpc)\.pb\.h$", ["common/wire", "server/api", "server/operations", "server/store", "server/web", "worker/rpc",
                                                                     "client/cli"]),
    ("Boost", r"^boost/", ["server/api", "server/web"]),
    ("OpenSSL", r"^openssl/", ["common/base", "common/security"]),
    ("SQL", r"^(sqlite3\.h|libpq-fe\.h|pqxx/)", ["server/store"]),
    ("Embree", r"^embree", ["common/scene/accel"]),
    ("an image library", r"^(Imf|OpenEXR/|Iex|Imath|spng\.h|png\.h)", ["common/image"]),
    ("OpenImageIO", r"^OpenImageIO/", ["common/image/read", "decoder"]),
    ("Draco", r"^draco/", ["decoder"]),
    ("seccomp", r"^(seccomp\.h|linux/seccomp\.h)", ["decoder"]),
]

# Folders that must run without a thread, a socket, a disk or a real clock.
PURE = ["server/access", "server/domain", "server/scheduling", "server/assembly", "worker/session"]
PURE_INCLUDES = (r"^(thread|mutex|shared_mutex|condition_variable|future|fstream|filesystem|iostream|csignal|unistd\.h|fcntl\.h"
                 r"|sys/.*|pthread\.h|random)$|^common/base/(file|mutex|log|signals)\.h$")
PURE_WORDS = (r"std::(jthread|thread|mutex|condition_variable|async|ifstream|ofstream|random_device)\b"
              r"|\bsystem_clock\b|\bsteady_clock\b|\bhigh_resolution_clock\b")
# Common code uses no real clock. base has the injected one.
CLOCK_WORDS = r"\b(system_clock|steady_clock|high_resolution_clock)\b|\b(gettimeofday|clock_gettime)\s*\("
STANDARD_DISTRIBUTIONS = r"std::\w+_distribution\b"
# These return a std::ranges::subrange, which clang 14 does not compile with the library of GCC 12.
SUBRANGES = r"std::ranges::(unique|partition|stable_partition|remove|remove_if|rotate|search|equal_range|find_end)\("

# In two parts, so that this file does not contain the words.
MACHINE_WORDS = ["/home" + "/", "/ro" + "ot/", "/wo" + "rk/", "registry.npm" + "js", "py" + "pi.org", "files.python" + "hosted",
                 "deb.deb" + "ian.org", "crates" + ".io", "proxy.gol" + "ang"]
UNFINISHED = ["TO" + "DO", "FIX" + "ME", "X" + "XX:"]
TEXT_SUFFIXES = SOURCE_SUFFIXES | {".txt", ".cmake", ".md", ".json", ".proto", ".py", ".sh", ".yml", ".yaml", ".ts", ".tsx", ".js", ".mjs",
                                   ".cjs", ".css", ".html", ".sbatch", ".service", ""}

# Libraries that a program must not link, directly or not.
FORBIDDEN_LINKS = {
    "lightmill-server": r"libembree|libOpenImageIO|libdraco",
    "lightmill-worker": r"libOpenImageIO|libdraco|libsqlite3|libpq",
    "lightmill": r"libembree|libOpenImageIO|libdraco|libsqlite3|libpq",
}

PROTO_RECORD = "tests/lint/proto_fields.txt"

# Types that GoogleTest prints by value. It may print other types of the standard library as bytes.
PRINTED_TYPES = {"bool", "char", "double", "float", "int", "long", "unsigned", "const", "std", "size_t", "string", "string_view",
                 "array", "map", "optional", "pair", "set", "tuple", "vector",
                 *(f"{sign}int{bits}_t" for sign in ("", "u") for bits in (8, 16, 32, 64))}


class Report:
    def __init__(self):
        self.lines = []

    def add(self, path, line, text):
        self.lines.append(f"{path}:{line}: {text}")


def tree_files(root):
    """Files that git tracks or would track, relative to the root. All files if there is no git."""
    listed = subprocess.run(["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard"],
                            capture_output=True, text=True, check=False)
    if listed.returncode == 0:
        names = listed.stdout.splitlines()
    else:
        names = [str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()]
    return sorted(name for name in names if (root / name).is_file() and not name.startswith("build/"))


def without_comments(text):
    """The code by line, with comments and string literals blanked."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))
    return re.sub(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"', blank, text, flags=re.S)


def folder_within(path, folders):
    return any(path.startswith(folder + "/") for folder in folders)


def check_layer(path, layered, order, own, other, include, line, report):
    if own not in order or other not in order:
        report.add(path, line, f"unknown folder in {layered}: {own} includes {include}")
    elif order.index(other) > order.index(own) or any({own, other} <= group and own != other for group in SIBLINGS):
        report.add(path, line, f"{layered}/{own} must not include {include}: {other} does not stand above it")


def check_layers(path, include, line, report):
    """Rule 1: a folder of a layered one includes only folders above it, and programs do not include each other."""
    top, target = path.split("/")[0], include.split("/")[0]
    if top in PROGRAMS + ["common"] and target in PROGRAMS and target != top:
        report.add(path, line, f"{top} must not include {include}")
    for layered, order in LAYERS.items():
        inside = re.compile(rf"{layered}/([^/]+)/")
        if (own := inside.match(path)) and (other := inside.match(include)):
            check_layer(path, layered, order, own.group(1), other.group(1), include, line, report)


def check_doors(path, include, line, report):
    """Rule 2: one door per library. Tests may use what they test."""
    if path.split("/")[0] not in PROGRAMS + ["common"]:
        return
    for what, pattern, folders in DOORS:
        if re.search(pattern, include) and not folder_within(path, folders):
            report.add(path, line, f"{include}: {what} is for {', '.join(folders)} alone")


def check_source(path, text, report):
    # A directive begins a line. Its operand is read here, because blanking removes it.
    for number, line in enumerate(text.splitlines(), 1):
        match = re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line)
        if not match:
            continue
        include = match.group(1)
        check_layers(path, include, number, report)
        check_doors(path, include, number, report)
        if folder_within(path, PURE) and re.search(PURE_INCLUDES, include):
            report.add(path, number, f"{include}: this folder runs without threads, sockets, disk and clock")
    in_common = path.startswith("common/")
    for number, line in enumerate(without_comments(text).splitlines(), 1):
        if folder_within(path, PURE) and (match := re.search(PURE_WORDS, line)):
            report.add(path, number, f"{match.group(0)}: this folder runs without threads, sockets, disk and clock")
        if in_common and not path.startswith("common/base/") and (match := re.search(CLOCK_WORDS, line)):
            report.add(path, number, f"{match.group(0)}: common knows no real clock; take a Time or a Clock")
        if in_common and (match := re.search(STANDARD_DISTRIBUTIONS, line)):
            report.add(path, number, f"{match.group(0)}: its output is not standardised")
        if not path.startswith("tests/") and (match := re.search(SUBRANGES, line)):
            report.add(path, number, f"{match.group(0)}: clang does not compile it; take the function of std")


def between_brackets(text, start, brackets):
    """The text in the pair of brackets that opens at `start`."""
    depth = 0
    for at in range(start, len(text)):
        depth += {brackets[0]: 1, brackets[1]: -1}.get(text[at], 0)
        if depth == 0:
            return text[start + 1:at]
    return text[start + 1:]


def arguments_of(text):
    """The arguments of a macro, separated by its own commas. Commas in brackets and in <> lists of types do not count."""
    for inner in [r"\([^()]*\)", r"\{[^{}]*\}", r"\[[^\[\]]*\]", r"<[\w\s:,*&]*>"] * 10:
        text = re.sub(inner, " ", text)
    return text.split(",")


def check_parameterised_tests(path, text, all_code, report):
    """Names and reports of parameterised tests are the same in every run: no index instead of a name, and no bytes of an
    object."""
    code = without_comments(text)
    for match in re.finditer(r"\bINSTANTIATE_TEST_SUITE_P\s*\(", code):
        line = code.count("\n", 0, match.start()) + 1
        arguments = arguments_of(between_brackets(code, match.end() - 1, "()"))
        if len(arguments) < 4:
            report.add(path, line, f"{arguments[1].strip()}: name its tests, by a third argument after the suite's name: letters and digits")
    for match in re.finditer(r"\b(?:TestWithParam|WithParamInterface)\s*<", code):
        line = code.count("\n", 0, match.start()) + 1
        written = between_brackets(code, match.end() - 1, "<>")
        if "*" in written.replace("const char*", ""):
            report.add(path, line, f"{written}: a pointer is printed as an address, another one in each run")
        for name in set(re.findall(r"\w+(?!\w|\s*::)", written)) - PRINTED_TYPES:
            if not re.search(rf"\b(PrintTo|operator\s*<<)\s*\([^()]*\b{name}\b", all_code):
                report.add(path, line, f"{written}: reports show its bytes: write a PrintTo(const {name}&, std::ostream*)")


def check_text(path, text, report):
    for number, line in enumerate(text.splitlines(), 1):
        for word in MACHINE_WORDS:
            if word in line:
                report.add(path, number, f"'{word}': a path or host of some machine")
        for word in UNFINISHED:
            if re.search(rf"\b{word}", line):
                report.add(path, number, f"'{word}': unfinished")


def proto_fields(text):
    """{"Message.field": number} of a proto file, with enum values. Nested names are joined with dots."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)
    fields, scope = {}, []
    for token in re.finditer(r"\b(message|enum|oneof|service)\s+(\w+)\s*\{|\{|\}|(\w+)\s*=\s*(\d+)\s*(?:\[[^\]]*\])?\s*;", text):
        if token.group(1):
            scope.append(token.group(2) if token.group(1) != "oneof" else None)  # a oneof's fields belong to its message
        elif token.group(0) == "{":
            scope.append(None)
        elif token.group(0) == "}":
            scope.pop()
        else:
            fields[".".join([name for name in scope if name] + [token.group(3)])] = int(token.group(4))
    return fields


def all_proto_fields(root, files):
    fields = {}
    for path in files:
        if path.startswith("proto/") and path.endswith(".proto"):
            fields.update(proto_fields((root / path).read_text()))
    return fields


def read_record(root):
    record = root / PROTO_RECORD
    if not record.exists():
        return {}
    pairs = (line.split(" = ") for line in record.read_text().splitlines() if line and not line.startswith("#"))
    return {name: int(number) for name, number in pairs}


def check_proto(root, files, report):
    """Rule 5: a field keeps its number, and a used number is not given to another field."""
    fields, record = all_proto_fields(root, files), read_record(root)
    used = {(name.rpartition(".")[0], number): name for name, number in record.items()}
    for name, number in fields.items():
        before = used.get((name.rpartition(".")[0], number))
        if name in record and record[name] != number:
            report.add(PROTO_RECORD, 1, f"{name} was {record[name]} and is {number}: fields are never renumbered")
        elif before is not None and before != name:
            report.add(PROTO_RECORD, 1, f"{name} takes number {number}, which was {before}'s")
        elif name not in record:
            report.add(PROTO_RECORD, 1, f"{name} = {number} is not recorded: run tests/lint/check_style.py --update-proto")


def update_proto(root):
    record = read_record(root)
    for name, number in all_proto_fields(root, tree_files(root)).items():
        record.setdefault(name, number)
    lines = ["# Every proto field there has been: a number, once used, is never given to another. Kept by check_style.py."]
    lines += [f"{name} = {number}" for name, number in sorted(record.items())]
    (root / PROTO_RECORD).write_text("\n".join(lines) + "\n")


def check_shell(root, path, text, report):
    found = re.match(r"#!.*\b(sh|bash)\b", text)
    if not (path.endswith(".sh") or found):
        return
    for command in ([found.group(1) if found else "sh", "-n", path], ["shellcheck", "-S", "warning", path]):
        done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            report.add(path, 1, f"{command[0]} finds faults:\n{done.stdout}{done.stderr}")


def check_listed(root, files, report):
    """Each test file is in the CMakeLists.txt of its folder, or of one above. Otherwise it never runs."""
    lists = {str(pathlib.PurePath(path).parent): set(re.split(r"[\s()\"]+", re.sub(r"\$\{\w+\}/|#.*", "", (root / path).read_text())))
             for path in files if pathlib.PurePath(path).name == "CMakeLists.txt"}
    for path in files:
        file = pathlib.PurePath(path)
        if not re.search(r"_test\.(cjs|cpp|mjs|py|sh)$", path):
            continue
        # The page's tests are listed by their names alone. A run.sh runs the tests of its folder.
        names = (file, file.with_name(file.name.removesuffix("_test.mjs")), file.with_name("run.sh"))
        if not any(str(name.relative_to(folder)) in lists.get(str(folder), ()) for name in names for folder in file.parents):
            report.add(path, 1, "is in no CMakeLists.txt of its folder or above, so it never runs")


def check_tree(root):
    report = Report()
    files = tree_files(root)
    sources = {}
    for path in files:
        if pathlib.PurePath(path).suffix not in TEXT_SUFFIXES:
            continue
        try:
            text = (root / path).read_text()
        except UnicodeDecodeError:
            continue
        if pathlib.PurePath(path).suffix in SOURCE_SUFFIXES:
            check_source(path, text, report)
            sources[path] = text
        check_text(path, text, report)
        check_shell(root, path, text, report)
    all_code = "\n".join(sources.values())
    for path, text in sources.items():
        check_parameterised_tests(path, text, all_code, report)
    check_proto(root, files, report)
    check_listed(root, files, report)
    return report


def check_links(pairs):
    report = Report()
    for pair in pairs:
        name, binary = pair.split("=", 1)
        listed = subprocess.run(["ldd", binary], capture_output=True, text=True, check=False)
        if listed.returncode != 0:
            report.add(binary, 0, f"ldd failed: {listed.stderr.strip()}")
        for line in listed.stdout.splitlines():
            if found := re.search(FORBIDDEN_LINKS[name], line):
                report.add(binary, 0, f"{name} must not link {found.group()}")
    return report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2])
    parser.add_argument("--update-proto", action="store_true")
    parser.add_argument("--links", nargs="+", metavar="NAME=BINARY")
    options = parser.parse_args()
    if options.update_proto:
        update_proto(options.root)
        return 0
    report = check_links(options.links) if options.links else check_tree(options.root)
    for line in report.lines:
        print(line)
    print(f"violations: {len(report.lines)}")
    return 1 if report.lines else 0


if __name__ == "__main__":
    sys.exit(main())
